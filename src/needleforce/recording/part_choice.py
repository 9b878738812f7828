# SPDX-License-Identifier: Apache-2.0
"""Which recording of a file, or cycle of it, a name or number means."""

import re
from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path

from ..errors import InputError
from .parts import Part

_CYCLE = re.compile(r"(?:(.*): )?(cycle ?\S+)", re.IGNORECASE | re.DOTALL)
_MAX_LISTED = 12  # names in a message


def asked(wanted: str | int | None, names: Sequence[str]) -> tuple[str | int | None, str]:
    """The recording of a file with these names, and the cycle of it that is asked for, empty for the whole; a number is
    that of a cycle where the file has one recording."""
    text = "" if wanted is None else str(wanted).strip()
    if not text or text.casefold() in [name.casefold() for name in names]:
        return wanted, ""
    if len(names) < 2 and text.isdecimal():
        return None, text
    found = _CYCLE.fullmatch(text)
    return (wanted, "") if found is None else (found[1], found[2])


def chosen_part(parts: Sequence[Part], wanted: str | int | None, path: Path, option: str = "--part") -> Part:
    """The part with this name or number from 1. Raises InputError if it is absent, or needed and not given."""
    if wanted is None:
        if len(parts) == 1:
            return parts[0]
        step = f"Choose one by its name or number, such as {option} {parts[0].name!r} or {option} 1"
        step += "; campaign takes all." if option == "--part" else "."
        what = "number of recordings" if option == "--part" else "number of tables with a motion"
        raise InputError(what, len(parts), f"the file has {listed(parts)}", str(path), step)
    text = str(wanted).strip()
    plain = text.casefold().strip("/")  # the slash of a group is optional
    named = [] if isinstance(wanted, int) else [p for p in parts if p.name.casefold().strip("/") == plain]
    if len(named) == 1:
        return named[0]
    of_table = [part for part in parts if part.name.casefold().startswith(f"{text.casefold()}: ")]
    if of_table:
        return chosen_part(of_table, None, path, option)
    if text.isdecimal() and 1 <= int(text) <= len(parts):
        return parts[int(text) - 1]
    several = len(parts) > 1 or parts[0].name
    limit = f"the file has {listed(parts)}" if several else "the file has one recording, without a name"
    step = f"Give one of these names, or a number from 1 to {len(parts)}." if several else "Leave it out."
    raise InputError(option.removeprefix("--").replace("-", " "), repr(text[:60]), limit, str(path), step)


def fitting_parts(names: Sequence[str], pattern: str, place: str) -> list[int]:
    """The numbers, from 1, of the recordings whose names fit a pattern such as ``B*``, or of all. Raises InputError if
    none fits."""
    text = "*" if pattern.casefold() == "all" else pattern.casefold()
    found = [number for number, name in enumerate(names, 1) if fnmatchcase(name.casefold(), text)]
    if not found:
        shown = ", ".join(map(repr, names[:_MAX_LISTED]))
        step = "Give a pattern that one of them fits."
        raise InputError("part", repr(pattern[:60]), f"the file has {shown}", place, step)
    return found


def listed(parts: Sequence[Part]) -> str:
    """The names of the first parts as a message shows them."""
    names = ", ".join(repr(part.name) for part in parts[:_MAX_LISTED])
    return names + (f" and {len(parts) - _MAX_LISTED} more" if len(parts) > _MAX_LISTED else "")
