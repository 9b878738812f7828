# SPDX-License-Identifier: Apache-2.0
"""The error for input that a user can correct: quantity, value, limit, place and next step; text for a terminal."""

import re
import sys
from collections.abc import Iterable

_MAX_PART_CHARS = 2000  # of one part of a message
# what a terminal obeys instead of showing it: control characters but line feed and tab, marks that reorder or hide the
# text around them, other line ends, and halves of characters
_CONTROLS = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff\ud800-\udfff]")


def printable(text: str) -> str:
    """``text`` for a terminal: control characters, marks that reorder text, and bytes that are no character are written
    as ``\\x1b`` or ``\\u202e``; line feeds and tabs are kept."""
    return _CONTROLS.sub(_written, text.replace("\r\n", "\n"))


def _written(character: re.Match) -> str:
    number = ord(character[0])
    if 0xDC80 <= number <= 0xDCFF:  # a byte of a file's name
        number -= 0xDC00
    return f"\\x{number:02x}" if number < 0x100 else f"\\u{number:04x}"


class InputError(ValueError):
    """An input is missing, out of range, inconsistent or not readable.

    The message joins the parts in this order: ``place: quantity is value, limit. next step``. Empty parts are left out.
    It is one line of printable text, because parts of it come from files and devices; the attributes are as given.

    Parameters
    ----------
    quantity : str
        What is wrong, such as ``"unit of depth"``.
    value : object
        The value found.
    limit : str
        The limit that the value violates, or what is needed.
    place : str
        Where: a file with its line, a key path, or a function.
    next_step : str
        What to do, as a sentence.
    """

    exit_code = 2  # of a command that ends with this error

    def __init__(self, quantity: str, value: object = "", limit: str = "", place: str = "", next_step: str = ""):
        self.quantity, self.value, self.limit = quantity, value, limit
        self.place, self.next_step = place, next_step
        super().__init__(self._message())

    def __reduce__(self) -> tuple:
        """Its parts, so that a copy from another process is the same."""
        return type(self), (self.quantity, self.value, self.limit, self.place, self.next_step)

    def _message(self) -> str:
        parts = (self.quantity, self.value, self.limit, self.place, self.next_step)
        quantity, value, limit, place, next_step = map(_part, parts)
        problem = f"{quantity} is {value}" if value else quantity
        problem += f", {limit}" if limit else ""
        return (f"{place}: " if place else "") + f"{problem}." + (f" {next_step}" if next_step else "")

    def at(self, place: str) -> "InputError":
        """Return a copy of the error with an outer place added.

        Parameters
        ----------
        place : str
            Written before the place that the error already has.

        Returns
        -------
        InputError
            The new error.
        """
        inner = f"{place}: {self.place}" if self.place else place
        return InputError(self.quantity, self.value, self.limit, inner, self.next_step)


def _part(value: object) -> str:
    """A part of a message: printable, without line ends, and no longer than a message can be read."""
    text = str(value)
    text = text if len(text) <= _MAX_PART_CHARS else text[:_MAX_PART_CHARS] + "…"
    return " ".join(printable(text).splitlines()) if "\n" in text else printable(text)


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """A question that proposes the names most like a ``word`` that is not among them; empty where none is like it."""
    from difflib import get_close_matches

    near = get_close_matches(word, list(known), 2, 0.5)
    return f"Did you mean {' or '.join(near)}? " if near else ""


def install_step(package: str, extra: str = "") -> str:
    """What to type to install a missing package for the Python that runs, as a next step of an ``InputError``.
    ``extra`` is the one of needleforce that has it, which pip knows where needleforce itself is installed."""
    import shlex
    from importlib.metadata import PackageNotFoundError, version

    try:
        version("needleforce")
        wanted = f'"needleforce[{extra}]"' if extra else package
    except PackageNotFoundError:  # run from a folder of sources
        wanted = package
    return f"Install it with {shlex.quote(sys.executable or 'python')} -m pip install {wanted}."
