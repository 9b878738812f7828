# SPDX-License-Identifier: Apache-2.0
"""What a page may ask of recordings: the options of reading, from their own table, the events that are given, and what
is fitted. No path and no unknown key is taken."""

from dataclasses import replace
from typing import Any, Literal

import msgspec

from ..errors import InputError
from ..identification.models import COMPARED, IDENTIFIED, OF_LAYERS
from ..preset_files.presets import preset, presets
from ..recording.mappings import KEPT, MappingFile
from ..recording.options import ReadOptions, flags
from ..recording.quantities import QUANTITIES
from ..recording.reader import INWARDS
from ..units import symbols

MAX_FILES = 200  # of one fit
CHOSEN = ("time", "depth", "velocity", "force")  # quantities whose columns, units and signs are chosen


class GivenTimes(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """Events of a recording, as ``Recording.with_events`` takes them."""

    contact: float | None = None
    punctures: list[float] | None = None
    exit: float | None = None


class FileChoices(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """A file by its key, the options by which it is read, the key of the one with its motion, and the events of each
    of its recordings by name."""

    key: str
    options: MappingFile = msgspec.field(default_factory=MappingFile)
    motion: str = ""
    events: dict[str, GivenTimes] = {}

    def reading(self) -> ReadOptions:
        """The options as those of ``read``, in SI; the motion by its key."""
        found = dict[str, Any](motion=self.motion or None)
        for name, (key, factor, _) in KEPT.items():
            value = getattr(self.options, key)
            found[name] = value * factor if factor is not None and value is not None else value or None
        return replace(ReadOptions(), **found)


class FitChoices(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """The files of a fit, what is done with them, and the names of a preset with the needle and of a model."""

    files: list[FileChoices]
    task: Literal["identify", "compare"] = "identify"
    needle: str = ""
    model: str = ""


def checked_choices(text: bytes) -> FitChoices:
    """What a page asks. Raises InputError for anything that the page does not offer."""
    try:
        found = msgspec.json.decode(text, type=FitChoices)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise InputError("request", "not one of the page", str(error), next_step="Load the page again.") from None
    known = {"needle": (found.needle, needles()), "model": (found.model, IDENTIFIED)}
    for what, (name, names) in known.items():
        if name and name not in names:
            raise InputError(what, repr(name[:60]), f"known are {', '.join(names)}", next_step="Choose one of these.")
    if not 0 < len(found.files) <= MAX_FILES:
        step = "Identify more of them with needleforce campaign."
        raise InputError("number of files", len(found.files), f"the page takes 1 to {MAX_FILES}", next_step=step)
    return found


def needles() -> tuple[str, ...]:
    """The presets that have a needle."""
    return tuple(name for name in sorted(presets()) if preset(name).needle is not None)


def choices() -> dict[str, Any]:
    """What the page offers: options of reading with their help, units by quantity, needles and models."""
    words = flags()
    return {
        "options": [
            {"key": key, "name": name, "help": words[name].help, "kind": _kind(words[name].kind)}
            for name, (key, _, _) in KEPT.items()
        ],
        "quantities": {name: list(symbols(QUANTITIES[name][0])) for name in CHOSEN},
        "inwards": list(INWARDS),
        "needles": list(needles()),
        "models": list(IDENTIFIED),
        "compared": [*COMPARED, *OF_LAYERS],
        "most": MAX_FILES,
    }


def _kind(kind: type) -> str:
    return {list: "table", str: "text", int: "integer", float: "number"}[kind]
