# SPDX-License-Identifier: Apache-2.0
"""Recordings: files read into SI arrays with their provenance, and written again."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .reader import read as read
    from .reader import read_all as read_all
    from .recording import Card as Card
    from .recording import Note as Note
    from .recording import Recording as Recording
    from .writer import write as write
    from .writer import write_columns as write_columns

_HOME = {
    "Card": "recording",
    "Note": "recording",
    "Recording": "recording",
    "read": "reader",
    "read_all": "reader",
    "write": "writer",
    "write_columns": "writer",
}
__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    """Loads a name when it is first used: the process that reads foreign formats needs none of them."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = getattr(import_module(f".{_HOME[name]}", __name__), name)
    return globals()[name]
