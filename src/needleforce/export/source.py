# SPDX-License-Identifier: Apache-2.0
"""What is exported: a preset by name, a preset file, or the JSON of a fit, with the lines that say where it is from."""

import json
from dataclasses import dataclass
from pathlib import Path

from ..errors import InputError
from ..models.model import Model
from ..preset_files import preset, preset_of

FIT = {"recordings", "parameters", "model"}
AGAIN = "Identify again with --json, or give the preset that --save wrote."


@dataclass(frozen=True)
class ModelSource:
    """A model, the name under which it was given, and lines on where it comes from."""

    model: Model
    name: str
    sources: tuple[str, ...] = ()


def model_source(name_or_path) -> ModelSource:
    """The model of ``needleforce identify --json`` or ``--save``, or of a shipped preset by its name.

    Raises InputError for a file that is none of them, for a fit without a model, and for one without its numbers.
    """
    path = Path(name_or_path)
    if path.suffix.lower() != ".json":
        return ModelSource(preset(name_or_path), path.stem)
    document = _read(path)
    try:
        return ModelSource(_model(document), path.stem, _sources(document))
    except InputError as error:
        raise error.at(path.name) from None
    except (TypeError, ValueError, AttributeError):  # JSON, but altered by hand
        raise _no_fit(path) from None


def _read(path: Path) -> dict:
    try:
        document = json.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise InputError("fit", "not readable", error.strerror or "", str(path)) from None
    except (ValueError, RecursionError) as error:  # of JSON, and of text that is not UTF-8
        raise InputError("fit", "no JSON", str(error), path.name, AGAIN) from None
    if not (isinstance(document, dict) and FIT <= set(document) and isinstance(document["recordings"], list)):
        raise _no_fit(path)
    if not all(map(_is_recording, document["recordings"])):
        raise _no_fit(path)
    return document


def _no_fit(path: Path) -> InputError:
    return InputError("file", "no fit", "needed is what identify --json writes", path.name, AGAIN)


def _is_recording(each) -> bool:
    return isinstance(each, dict) and isinstance(each.get("file"), str) and "status" in each


def _model(document: dict) -> Model:
    if document["model"] is None:
        raise InputError("fit", "without a model", "no recording could answer", next_step="See its notes and warnings.")
    if not isinstance(document.get("preset"), dict):
        limit = "it was written before fits kept the whole model"
        raise InputError("fit", "without the numbers of its model", limit, next_step=AGAIN)
    return preset_of(document["preset"])


def _sources(document: dict) -> tuple[str, ...]:
    """The recordings, each with the start of its hash, the speed the forces are for, and the warnings of the fit."""
    lines = []
    for each in document["recordings"]:
        mark = each.get("sha256") or ""
        lines.append(f"Recording {Path(each['file']).name}, {each['status']}" + f", sha256 {mark[:16]}" * bool(mark))
    speed = document.get("settings", {}).get("speed_m_s")
    lines += [] if speed is None else [f"Forces are those at a speed of {speed:.4g} m/s"]
    return (*lines, *(f"Warning: {text}" for text in document.get("warnings", ())))
