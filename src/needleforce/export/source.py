# SPDX-License-Identifier: Apache-2.0
"""The model to export, from a preset by name, a preset file, or the JSON of a fit, with lines on its source."""

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..models.model import Model
from ..preset_files import preset, preset_of

FIT_KEYS = {"recordings", "parameters", "model"}
_NEXT_STEP = "Identify again with --json, or give the preset that --save wrote."


@dataclass(frozen=True)
class ModelSource:
    """A model, the name of its file or preset, and lines on its source."""

    model: Model
    name: str
    sources: tuple[str, ...] = ()


def model_source(name_or_path: str | os.PathLike) -> ModelSource:
    """The model of a fit, of a preset file, or of a shipped preset.

    Parameters
    ----------
    name_or_path : str or path
        File written by ``needleforce identify`` with ``--json`` or ``--save``, or name of a shipped preset.

    Returns
    -------
    ModelSource

    Raises
    ------
    InputError
        If the file is none of these, or the fit has no model.
    """
    path = Path(name_or_path)
    if path.suffix.lower() != ".json":
        return ModelSource(preset(name_or_path), path.stem)
    document = _read(path)
    try:
        return ModelSource(_model(document), path.stem, _sources(document))
    except InputError as error:
        raise error.at(path.name) from None
    except (TypeError, ValueError, AttributeError):  # JSON that was edited
        raise _no_fit(path) from None


def _read(path: Path) -> dict:
    try:
        document = json.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise InputError("fit", "not readable", error.strerror or "", str(path), "Check the path.") from None
    except (ValueError, RecursionError) as error:  # of JSON, and of text that is not UTF-8
        raise InputError("fit", "not JSON", str(error), path.name, _NEXT_STEP) from None
    if not (isinstance(document, dict) and FIT_KEYS <= set(document) and isinstance(document["recordings"], list)):
        raise _no_fit(path)
    if not all(map(_is_recording, document["recordings"])):
        raise _no_fit(path)
    return document


def _no_fit(path: Path) -> InputError:
    limit = "a file written by identify --json is needed"
    return InputError("file", "not a fit", limit, path.name, _NEXT_STEP)


def _is_recording(each: Any) -> bool:
    return isinstance(each, dict) and isinstance(each.get("file"), str) and "status" in each


def _model(document: dict) -> Model:
    if document["model"] is None:
        raise InputError(
            "fit", "without a model", "no recording could be evaluated", next_step="See its notes and warnings."
        )
    if not isinstance(document.get("preset"), dict):
        limit = "it was written by a version that did not save the complete model"
        raise InputError("fit", "without the parameters of its model", limit, next_step=_NEXT_STEP)
    return preset_of(document["preset"])


def _sources(document: dict) -> tuple[str, ...]:
    """Lines on the recordings with the start of their hashes, the speed of the forces, and the warnings of the fit."""
    lines = []
    for each in document["recordings"]:
        mark = each.get("sha256") or ""
        lines.append(f"Recording {Path(each['file']).name}, {each['status']}" + f", sha256 {mark[:16]}" * bool(mark))
    speed = document.get("settings", {}).get("speed_m_s")
    lines += [] if speed is None else [f"Forces are those at a speed of {speed:.4g} m/s"]
    return (*lines, *(f"Warning: {text}" for text in document.get("warnings", ())))
