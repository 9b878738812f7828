# SPDX-License-Identifier: Apache-2.0
"""Options that read the files of one instrument, kept as a small TOML file: shipped, of the user, or in the folder of
the recordings."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec

from ..errors import InputError
from ..files import MAX_DEFINITION_BYTES, atomic_write, decode_toml, read_bytes

IN_FOLDER = "needleforce.toml"
_SHIPPED = Path(__file__).with_name("mappings")
_FACTORS = {"speed_mm_s": ("speed", 1e-3), "step_um": ("step", 1e-6), "start_depth_mm": ("start_depth", 1e-3),
            "rate_hz": ("rate", 1.0), "stroke_mm": ("stroke", 1e-3), "hold_s": ("hold", 1.0),
            "motion_shift_s": ("motion_shift", 1.0)}  # fmt: skip
_PLAIN = ("part", "motion_part", "inwards", "filter_length", "first_row")


class MappingFile(msgspec.Struct, forbid_unknown_fields=True, omit_defaults=True):
    """The content of a mapping file; a column may have several headers, of which the first that a file has is used."""

    description: str = ""
    columns: dict[str, str | int | list[str]] = {}
    units: dict[str, str] = {}
    part: str | int | None = None
    motion_part: str | int | None = None
    inwards: str | None = None
    filter_length: int | None = None
    first_row: int | None = None
    rate_hz: float | None = None
    speed_mm_s: float | None = None
    step_um: float | None = None
    stroke_mm: float | None = None
    hold_s: float | None = None
    motion_shift_s: float | None = None
    start_depth_mm: float | None = None

    def options(self) -> dict[str, Any]:
        """The options of ``read``, in SI."""
        found: dict[str, Any] = {"columns": dict(self.columns), "units": dict(self.units)}
        found |= {name: getattr(self, name) for name in _PLAIN if getattr(self, name) is not None}
        values = ((getattr(self, name), *how) for name, how in _FACTORS.items())
        return found | {option: factor * value for value, option, factor in values if value is not None}


def mapping_names() -> dict[str, str]:
    """The mappings that ``--as`` knows, with their descriptions; those of the user replace shipped ones."""
    files = {path.stem: path for folder in (_SHIPPED, user_folder()) for path in sorted(folder.glob("*.toml"))}
    return {name: load_mapping(path).description for name, path in sorted(files.items())}


def user_folder() -> Path:
    """Where the mappings of the user are: ``NEEDLEFORCE_MAPPINGS``, or the folder of settings of the system."""
    given = os.environ.get("NEEDLEFORCE_MAPPINGS")
    settings = os.environ.get("APPDATA" if os.name == "nt" else "XDG_CONFIG_HOME") or Path.home() / ".config"
    return Path(given) if given else Path(settings) / "needleforce" / "mappings"


def load_mapping(name: str | os.PathLike) -> MappingFile:
    """A mapping by its name, or from a TOML file. Raises InputError for an unknown name and an invalid file."""
    path = _path_of(name)
    try:
        return decode_toml(read_bytes(path, "mapping", MAX_DEFINITION_BYTES), "mapping", MappingFile)
    except InputError as error:
        raise error if error.place else error.at(str(path)) from None


def _path_of(name: str | os.PathLike) -> Path:
    text = os.fspath(name)
    if text.endswith(".toml") or os.sep in text or isinstance(name, os.PathLike):
        return Path(text)
    known = [folder / f"{text.casefold()}.toml" for folder in (user_folder(), _SHIPPED)]
    found = next((path for path in known if path.is_file()), None)
    if found is None:
        names = ", ".join(mapping_names())
        step = "Give one of these, or a TOML file; inspect --save makes one."
        raise InputError("mapping", repr(text[:60]), f"known are {names}", next_step=step)
    return found


def with_mapping(path: Path, name: str | os.PathLike | None, options: Mapping[str, Any]) -> tuple[dict[str, Any], str]:
    """Options that were given, completed by a mapping: the named one, or that in the folder of the file.

    Parameters
    ----------
    path : Path
        The file that is read.
    name : str or os.PathLike, optional
        A mapping; without one the file ``needleforce.toml`` in the folder of ``path`` is used if there is one.
    options : mapping
        Options of ``read``; those given are kept.

    Returns
    -------
    options : dict
    sentence : str
        What is assumed, empty without a mapping.

    Raises
    ------
    InputError
        As ``load_mapping``.
    """
    of_folder = path.parent / IN_FOLDER
    if name is None and not of_folder.is_file():
        return dict(options), ""
    mapping = load_mapping(of_folder if name is None else name).options()
    given = {key: value for key, value in options.items() if value is not None}
    joined = mapping | given
    for key in ("columns", "units"):
        joined[key] = mapping[key] | dict(given.get(key) or {})
    origin = f"{IN_FOLDER} in the folder of the file" if name is None else f"the mapping {os.fspath(name)}"
    return dict(options) | joined, f"columns, units and other options are those of {origin}"


def save_mapping(options: Mapping[str, Any], target: str, description: str = "") -> Path:
    """Write options of ``read`` as a mapping.

    Parameters
    ----------
    options : mapping
        Options of ``read``, in SI.
    target : str
        A name, under which ``--as`` finds it, or a file that ends with ``.toml``; ``needleforce.toml`` in the folder of
        recordings applies to all of them.
    description : str
        One sentence.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        A file that cannot be written.
    """
    fields = {name: options[name] for name in ("columns", "units", *_PLAIN) if options.get(name) not in (None, {})}
    for name, (option, factor) in _FACTORS.items():
        if options.get(option) is not None:
            fields[name] = float(f"{options[option] / factor:.12g}")
    path = Path(target)
    if not target.endswith(".toml"):
        path = user_folder() / f"{_checked_name(target)}.toml"
        path.parent.mkdir(parents=True, exist_ok=True)
    content = msgspec.to_builtins(MappingFile(description=description, **fields))
    with atomic_write(path) as file:
        file.write("# how needleforce reads the files of one instrument\n" + _toml(content))
    return path


def _checked_name(name: str) -> str:
    if not name.replace("-", "").replace("_", "").isalnum() or not name.isascii():
        limit = "letters, digits, - and _ are allowed"
        raise InputError("name of the mapping", repr(name[:60]), limit, next_step="Give such a name, or a .toml file.")
    return name.casefold()


def _toml(content: Mapping[str, Any]) -> str:
    """A flat document with tables one level deep."""
    plain = [f"{key} = {_value(value)}\n" for key, value in content.items() if not isinstance(value, dict)]
    for key, table in content.items():
        if isinstance(table, dict) and table:
            plain.append(f"\n[{key}]\n" + "".join(f"{name} = {_value(value)}\n" for name, value in table.items()))
    return "".join(plain)


def _value(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(_value, value))}]"
    return msgspec.json.encode(value).decode() if isinstance(value, str) else repr(value)
