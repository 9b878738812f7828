# SPDX-License-Identifier: Apache-2.0
"""The shipped presets, and a model or a needle from a name, a preset file, or the JSON of a fit."""

import json
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .. import core
from ..errors import InputError, did_you_mean
from ..files import MAX_RESULT_BYTES, as_type, decode_toml, read_bytes, read_text
from ..models.laws import FAMILIES
from ..models.model import Model
from ..models.named_models import NAMED_MODELS, names_of

FOLDER = Path(__file__).parents[1] / "presets"
FIT_KEYS = {"recordings", "parameters", "model"}
_AGAIN = "See why in its table; a campaign of an older version is done again with --json."
_NEXT_STEP = "Identify again with --json, or give the preset that --save wrote."


def presets() -> tuple[str, ...]:
    """Names of the presets that are shipped with needleforce.

    Returns
    -------
    tuple of str
        The names in alphabetical order.
    """
    return tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))


def preset(source: Model | str | os.PathLike) -> Model:
    """The model of a shipped preset, of a preset file, or of a fit.

    Parameters
    ----------
    source : Model, str or path
        Name of a shipped preset, path of a preset file (``.toml``) or of a fit that ``needleforce identify --json``
        wrote (``.json``), or a model, which is returned as it is.

    Returns
    -------
    Model

    Raises
    ------
    InputError
        With the path inside the file, if a name or key is unknown, the reference is missing, or a value is invalid.
    """
    return source if isinstance(source, Model) else model_source(source).model


def models_of(source: Model | str | os.PathLike) -> tuple[Model, ...]:
    """The models of a campaign that ``needleforce campaign --json`` wrote, one of each condition; of anything else that
    of ``preset``.

    Parameters
    ----------
    source : Model, str or path
        As of ``preset``, or path of a campaign.

    Returns
    -------
    tuple of Model

    Raises
    ------
    InputError
        As of ``preset``, and if no condition of the campaign has a model.
    """
    if isinstance(source, Model) or Path(source).suffix.lower() != ".json":
        return (preset(source),)
    path = Path(source)
    conditions = _json(path).get("conditions")
    if not (isinstance(conditions, list) and all(isinstance(each, dict) for each in conditions)):
        return (preset(source),)
    found = [each["preset"] for each in conditions if isinstance(each.get("preset"), dict)]
    if not found:
        raise InputError("campaign", "without a model", "no condition has a complete one", path.name, _AGAIN)
    try:
        return tuple(map(preset_of, found))
    except InputError as error:
        raise error.at(path.name) from None


def needle_of(source: core.Needle | Model | str | os.PathLike) -> core.Needle:
    """A needle from all that names a model, or from a needle file.

    Parameters
    ----------
    source : Needle, Model, str or path
        A needle; or a model, the name of a preset, a preset file or the JSON of a fit, whose needle is used; or a TOML
        file with a section ``[needle]``.

    Returns
    -------
    Needle

    Raises
    ------
    InputError
        If there is no needle in it, or the file is none of these.
    """
    if isinstance(source, core.Needle):
        return source
    if isinstance(source, str | os.PathLike) and source not in presets() and Path(source).suffix.lower() != ".json":
        from .build import read_needle

        if not os.path.lexists(source):
            near = did_you_mean(str(source), presets())
            step = f"{near}Give a file with a [needle] section, or one of {', '.join(presets())}."
            raise InputError("needle", repr(str(source)), "neither a preset nor a file", next_step=step)

        return read_needle(source)
    if not isinstance(source, Model | str | os.PathLike):
        step = "Give a nf.Needle, a model, the name of a preset, or a file."
        raise InputError("needle", repr(source), "not a Needle", next_step=step)
    found = preset(source).needle
    if found is None:
        raise InputError("needle", str(source), "a model without a needle", next_step="Give a file with [needle].")
    return found


def model_name(source: Model | str | os.PathLike, known: Iterable[str]) -> str:
    """The name of the model to identify, one of ``known``.

    Parameters
    ----------
    source : Model, str or path
        A name, as ``cone_cylinder``; or a preset, a preset file, a fit or a model with the same laws.
    known : iterable of str
        The names that can be identified.

    Returns
    -------
    str

    Raises
    ------
    InputError
        If none of ``known`` has the laws of ``source``.
    """
    known = list(known)
    if isinstance(source, str) and (source in known or (source not in presets() and not Path(source).suffix)):
        return source
    model = preset(source)
    names = [name for name in (*names_of(model), model.name.removeprefix("identified_")) if name in known]
    if not names:
        shown = source.name if isinstance(source, Model) else str(source)
        raise InputError("model", repr(shown), "not identifiable", next_step=f"Give one of {', '.join(known)}.")
    return names[0]


def preset_of(document: dict) -> Model:
    """The model of a preset inside a larger document, such as the JSON of a fit.

    Raises InputError, with the path inside the preset, as ``preset`` does.
    """
    from .build import build
    from .schema import PresetFile

    return build(as_type(document, PresetFile, "preset", "Identify again and write the fit again."))


def _of_preset(name_or_path: str | os.PathLike) -> Model:
    path = _path(name_or_path)
    text = read_bytes(path, "preset")
    try:
        return _parse(text)
    except InputError as error:
        raise error.at(path.name) from None


def _path(name_or_path: str | os.PathLike) -> Path:
    if name_or_path in presets():
        return FOLDER / f"{name_or_path}.toml"
    path = Path(name_or_path)
    if path.suffix == ".toml" and path.is_file():
        return path
    raise _not_found(str(name_or_path), path.suffix == ".toml")


def _not_found(text: str, is_path: bool) -> InputError:
    if text in NAMED_MODELS:
        shipped = ", ".join(name for name in presets() if text in names_of(_of_preset(name)))
        next_step = f"Give Model.named its values, or use one of its presets: {shipped}."
        return InputError("preset", repr(text), "a named model without values", next_step=next_step)
    names = presets()
    next_step = f"{did_you_mean(text, names)}Give a path ending in .toml or .json, or one of {', '.join(names)}."
    return InputError("preset", repr(text), "not a file" if is_path else "unknown", next_step=next_step)


def _parse(text: bytes) -> Model:
    from .build import build
    from .schema import PresetFile

    document = decode_toml(text, "preset")
    if "needle" in document and document.keys().isdisjoint(FAMILIES):
        step = 'Give it where a needle is asked for, as in nf.identify(recording, needle="needle.toml").'
        raise InputError("preset", "a needle file", "it has no laws of a tissue", next_step=step)
    return build(as_type(document, PresetFile, "preset", "Correct the file at this place."))


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
        return ModelSource(_of_preset(name_or_path), path.stem)
    document = _read(path)
    try:
        return ModelSource(_model(document), path.stem, _sources(document))
    except InputError as error:
        raise error.at(path.name) from None
    except (TypeError, ValueError, AttributeError):  # JSON that was edited
        raise _no_fit(path) from None


def _json(path: Path) -> dict:
    text = read_text(path, "fit", MAX_RESULT_BYTES)
    try:
        document = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError("fit", "not JSON", str(error), path.name, _NEXT_STEP) from None
    return document if isinstance(document, dict) else {}


def _read(path: Path) -> dict:
    document = _json(path)
    if not (FIT_KEYS <= set(document) and isinstance(document["recordings"], list)):
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
