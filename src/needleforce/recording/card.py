# SPDX-License-Identifier: Apache-2.0
"""The card written as comment lines above the table, ``# key: value``, and read from them."""

import math
import re
from collections.abc import Iterator
from numbers import Integral

from ..errors import InputError
from .recording import Card, Note

_MAX_FILTER_SAMPLES = 1_000_000  # samples
_FILTER_LIMIT = f"a whole number of samples from 1 to {_MAX_FILTER_SAMPLES} is needed"
_QUOTED_CHARS = 40  # characters of an entry that an error quotes
_COUNT = re.compile("[0-9]{1,15}")
_TEXTS = ("needle", "tissue", "rig")
SIGNS = "depth increases inwards, force is positive against insertion"
_ESCAPED = re.compile(r"\\x([0-9a-f]{2})")
# line ends, the backslash itself, and a comma or semicolon after which a spreadsheet would find a formula
_TO_ESCAPE = re.compile(r"[\x00-\x1f\x7f\x85\\]|[,;](?=\"?[=+\-@])")


def card_lines(card: Card, notes: tuple[Note, ...] = (), **extra: str) -> list[str]:
    """The lines of a card without line ends; ``extra`` contains further keys, such as ``start_depth_m``."""
    entries = [("signs", SIGNS), *((key, getattr(card, key)) for key in _TEXTS)]
    entries += [("origin", card.source), ("origin_sha256", card.sha256)]
    entries += [("filter_length", str(card.filter_length) if card.filter_length != 1 else ""), *extra.items()]
    entries += [("assumption", sentence) for sentence in card.assumptions]
    entries += [("note", f"{note.kind} {note.count} {note.message}") for note in notes]
    return [f"# {key}: {_TO_ESCAPE.sub(_escape, value)}" for key, value in entries if value]


def check_filter_length(length: int | None) -> None:
    """Raise InputError unless ``length`` is None or a number of samples."""
    valid = isinstance(length, Integral) and not isinstance(length, bool) and 1 <= length <= _MAX_FILTER_SAMPLES
    if length is not None and not valid:
        raise InputError("filter_length", repr(length), _FILTER_LIMIT, next_step="Give 1 for an unfiltered force.")


class Preamble:
    """The entries of the card above a table; ``motion`` and ``start_depth_m`` are text, empty if absent."""

    def __init__(self, comments: list[tuple[int, str]], place: str = ""):
        self._place = place
        self._texts: dict[str, list[str]] = {}
        self._lines: dict[str, list[int]] = {}
        for line, comment in comments:
            key, _, text = comment.partition(": ")
            self._texts.setdefault(key, []).append(_ESCAPED.sub(lambda code: chr(int(code[1], 16)), text))
            self._lines.setdefault(key, []).append(line)

    def text(self, key: str) -> str:
        """The first entry with this key, empty if it is absent."""
        return self._texts.get(key, [""])[0]

    @property
    def has_signs(self) -> bool:
        """Whether the file states that its signs are those of a recording."""
        return self.text("signs") == SIGNS

    def number(self, key: str) -> float | None:
        """The entry as a finite number, None if it is absent. Raises InputError if it is not a finite number."""
        try:  # Python alone reads 1_0 as a number
            number = float(self.text(key).replace("_", "?")) if self.text(key) else None
        except ValueError:
            number = math.nan
        if number is not None and not math.isfinite(number):
            raise self.refusal(key, "a number is needed")
        return number

    def refusal(self, key: str, needed: str, entry: int = 0) -> InputError:
        """The error for an invalid entry, with its line; ``needed`` states what is needed."""
        text, place = self._texts[key][entry], f"{self._place}, line {self._lines[key][entry]}"
        shown = repr(text if len(text) <= _QUOTED_CHARS else text[:_QUOTED_CHARS] + "…")
        return InputError(f"{key} in the file's card", shown, needed, place, "Correct or remove the line.")

    def card(self, source: str, sha256: str, filter_length: int | None, assumptions: list[str]) -> Card:
        """The card of the recording: ``source`` and ``sha256`` identify the file read, the rest comes from its card."""
        sentences = [*self._texts.get("assumption", []), *assumptions]
        return Card(
            source=source,
            sha256=sha256,
            **{key: self.text(key) for key in _TEXTS},
            filter_length=filter_length or self._filter_length(),
            assumptions=tuple(dict.fromkeys(sentences)),
        )

    def notes(self) -> list[Note]:
        """The notes stored in the file, and the origin of its data."""
        notes = [Note(kind, message, int(count)) for kind, count, message in self._split_notes()]
        if self.text("origin") or self.text("origin_sha256"):
            origin = f"written from {self.text('origin') or 'a recording'}"
            origin += f", SHA-256 {self.text('origin_sha256')}" if self.text("origin_sha256") else ""
            notes.append(Note("origin", origin))
        return notes

    def _filter_length(self) -> int:
        length = self.number("filter_length")
        if length is None:
            return 1
        if length != int(length) or not 1 <= length <= _MAX_FILTER_SAMPLES:
            raise self.refusal("filter_length", _FILTER_LIMIT)
        return int(length)

    def _split_notes(self) -> Iterator[list[str]]:
        for entry, text in enumerate(self._texts.get("note", [])):
            parts = text.split(" ", 2)
            if len(parts) == 3 and parts[1].isdigit():
                if not _COUNT.fullmatch(parts[1]):
                    raise self.refusal("note", "its second word is a count of at most 15 digits 0 to 9", entry)
                yield parts


def _escape(character: re.Match) -> str:
    return f"\\x{ord(character[0]):02x}"
