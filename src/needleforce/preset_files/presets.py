# SPDX-License-Identifier: Apache-2.0
"""The shipped presets, and a model from a preset's name or file."""

from pathlib import Path

from ..errors import InputError
from ..models.model import Model
from ..models.named_models import NAMED_MODELS, names_of

BOM = b"\xef\xbb\xbf"  # what some editors put before UTF-8
FOLDER = Path(__file__).parents[1] / "presets"


def presets() -> tuple[str, ...]:
    """The names of the presets that come with needleforce."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))


def preset(name_or_path) -> Model:
    """The model of a shipped preset, by name, or of a preset file, by path.

    Raises InputError, with the path inside the file, for an unknown name or key, a missing reference, an impossible
    value.
    """
    path = _path(name_or_path)
    try:
        return _parse(path.read_bytes().removeprefix(BOM))
    except InputError as error:
        raise error.at(path.name) from None
    except OSError as error:
        raise InputError("preset", "not readable", error.strerror or "", str(path)) from None


def preset_of(document: dict) -> Model:
    """The model of a preset that is held in a larger document, as JSON of a fit holds one.

    Raises InputError, with the path inside the preset, as ``preset`` does.
    """
    import msgspec

    from .build import build
    from .schema import PresetFile

    try:
        return build(msgspec.convert(document, type=PresetFile))
    except msgspec.ValidationError as error:
        raise InputError("preset", limit=str(error), next_step="Identify again and write the fit anew.") from None


def _path(name_or_path) -> Path:
    if name_or_path in presets():
        return FOLDER / f"{name_or_path}.toml"
    path = Path(name_or_path)
    if path.suffix == ".toml" and path.is_file():
        return path
    raise _not_found(str(name_or_path), path.suffix == ".toml")


def _not_found(text: str, is_path: bool) -> InputError:
    if text in NAMED_MODELS:
        shipped = ", ".join(name for name in presets() if text in names_of(preset(name)))
        next_step = f"Give Model.named its values, or take a preset of it: {shipped}."
        return InputError("preset", repr(text), "a named model without values", next_step=next_step)
    next_step = f"Give a path ending in .toml, or one of {', '.join(presets())}."
    return InputError("preset", repr(text), "not a file" if is_path else "not known", next_step=next_step)


def _parse(text: bytes) -> Model:
    import tomllib

    import msgspec

    from .build import build
    from .schema import PresetFile

    try:
        return build(msgspec.toml.decode(text, type=PresetFile))
    except (msgspec.DecodeError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError("preset", limit=str(error), next_step="Mend the file at this place.") from None
