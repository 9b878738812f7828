# SPDX-License-Identifier: Apache-2.0
"""A card as comment lines above the table, ``# key: value``, and back."""

import re

from ..errors import InputError
from .recording import Card, Note

_TEXTS = ("needle", "tissue", "rig")
_ESCAPED = re.compile(r"\\x([0-9a-f]{2})")
_TO_ESCAPE = re.compile(r"[\x00-\x1f\x7f\x85\\]")


def card_lines(card: Card, notes: tuple[Note, ...] = (), **more: str) -> list[str]:
    """The lines of a card, without line ends; ``more`` are further keys, such as ``start_depth_m``."""
    entries = [(key, getattr(card, key)) for key in _TEXTS]
    entries += [("origin", card.source), ("origin_sha256", card.sha256)]
    entries += [("filter_length", str(card.filter_length) if card.filter_length != 1 else ""), *more.items()]
    entries += [("assumption", sentence) for sentence in card.assumptions]
    entries += [("note", f"{note.kind} {note.count} {note.message}") for note in notes]
    return [f"# {key}: {_TO_ESCAPE.sub(_escape, value)}" for key, value in entries if value]


class Preamble:
    """The card's entries found above a table; ``motion`` and ``start_depth_m`` are text, empty if absent."""

    def __init__(self, comments: list[str], place: str = ""):
        entries = [line.partition(": ") for line in comments]
        self._place = place
        self._texts: dict[str, list[str]] = {}
        for key, _, text in entries:
            self._texts.setdefault(key, []).append(_ESCAPED.sub(lambda code: chr(int(code[1], 16)), text))

    def text(self, key: str) -> str:
        """The first entry with this key, empty if there is none."""
        return self._texts.get(key, [""])[0]

    def number(self, key: str) -> float | None:
        """The entry as a number, None if there is none. Raises InputError if it is no number."""
        try:
            return float(self.text(key)) if self.text(key) else None
        except ValueError:
            name = f"{key} in the file's card"
            raise InputError(name, repr(self.text(key)), "a number is needed", self._place) from None

    def card(self, source: str, sha256: str, filter_length: int | None, assumptions: list[str]) -> Card:
        """The card of the recording: ``source`` and ``sha256`` name the file read, the rest is the file's own."""
        length = filter_length or int(self.number("filter_length") or 1)
        said = [*self._texts.get("assumption", []), *assumptions]
        return Card(source, sha256, *(self.text(key) for key in _TEXTS), length, tuple(dict.fromkeys(said)))

    def notes(self) -> list[Note]:
        """The notes the file brings along, and where its numbers come from."""
        notes = [Note(kind, message, int(count)) for kind, count, message in self._split_notes()]
        if self.text("origin") or self.text("origin_sha256"):
            origin = f"written from {self.text('origin') or 'a recording'}"
            origin += f", SHA-256 {self.text('origin_sha256')}" if self.text("origin_sha256") else ""
            notes.append(Note("origin", origin))
        return notes

    def _split_notes(self):
        for text in self._texts.get("note", []):
            parts = text.split(" ", 2)
            if len(parts) == 3 and parts[1].isdigit():
                yield parts


def _escape(character: re.Match) -> str:
    return f"\\x{ord(character[0]):02x}"
