# SPDX-License-Identifier: Apache-2.0
"""The shipped presets, and a model from a preset's name or file."""

import os
from pathlib import Path

from ..errors import InputError
from ..models.model import Model
from ..models.named_models import NAMED_MODELS, names_of

BOM = b"\xef\xbb\xbf"  # byte order mark that some editors write before UTF-8
FOLDER = Path(__file__).parents[1] / "presets"


def presets() -> tuple[str, ...]:
    """Names of the presets that are shipped with needleforce.

    Returns
    -------
    tuple of str
        The names in alphabetical order.
    """
    return tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))


def preset(name_or_path: str | os.PathLike) -> Model:
    """The model of a shipped preset or of a preset file.

    Parameters
    ----------
    name_or_path : str or path
        Name of a shipped preset, or path of a file that ends in ``.toml``.

    Returns
    -------
    Model

    Raises
    ------
    InputError
        With the path inside the file, if a name or key is unknown, the reference is missing, or a value is invalid.
    """
    path = _path(name_or_path)
    try:
        return _parse(path.read_bytes().removeprefix(BOM))
    except InputError as error:
        raise error.at(path.name) from None
    except OSError as error:
        next_step = "Check the path and its permissions."
        raise InputError("preset", "not readable", error.strerror or "", str(path), next_step) from None


def preset_of(document: dict) -> Model:
    """The model of a preset inside a larger document, such as the JSON of a fit.

    Raises InputError, with the path inside the preset, as ``preset`` does.
    """
    import msgspec

    from .build import build
    from .schema import PresetFile

    try:
        return build(msgspec.convert(document, type=PresetFile))
    except msgspec.ValidationError as error:
        raise InputError("preset", limit=str(error), next_step="Identify again and write the fit again.") from None


def _path(name_or_path: str | os.PathLike) -> Path:
    if name_or_path in presets():
        return FOLDER / f"{name_or_path}.toml"
    path = Path(name_or_path)
    if path.suffix == ".toml" and path.is_file():
        return path
    raise _not_found(str(name_or_path), path.suffix == ".toml")


def _not_found(text: str, is_path: bool) -> InputError:
    if text in NAMED_MODELS:
        shipped = ", ".join(name for name in presets() if text in names_of(preset(name)))
        next_step = f"Give Model.named its values, or use one of its presets: {shipped}."
        return InputError("preset", repr(text), "a named model without values", next_step=next_step)
    next_step = f"Give a path ending in .toml, or one of {', '.join(presets())}."
    return InputError("preset", repr(text), "not a file" if is_path else "unknown", next_step=next_step)


def _parse(text: bytes) -> Model:
    import tomllib

    import msgspec

    from .build import build
    from .schema import PresetFile

    try:
        return build(msgspec.toml.decode(text, type=PresetFile))
    except (msgspec.DecodeError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError("preset", limit=str(error), next_step="Correct the file at this place.") from None
