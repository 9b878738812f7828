# SPDX-License-Identifier: Apache-2.0
"""Options that read the files of one instrument, kept as a small TOML file: shipped, of the user, or in the folder of
the recordings."""

import os
from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import msgspec

from ..errors import InputError
from ..files import MAX_DEFINITION_BYTES, atomic_write, decode_toml, read_bytes, toml_value
from .options import ReadOptions, flags, plain_type

IN_FOLDER = "needleforce.toml"
_SHIPPED = Path(__file__).with_name("mappings")
_TABLES = {"columns": dict[str, str | int | list[str]], "units": dict[str, str], "segment": dict[str, str]}


def _kept() -> dict[str, tuple[str, float | None, Any]]:
    """The options that a mapping file keeps, all with a flag but those that name a file: the key of each, which has the
    unit of the flag if there is one, the factor to SI, and the type."""
    known, kept = flags(), {}
    for row in fields(ReadOptions):
        flag, of_type = known.get(row.name), plain_type(row)
        if flag is not None and "PathLike" not in str(of_type):
            key = row.name if flag.factor is None else flag.word.removeprefix("--").replace("-", "_")
            kept[row.name] = (key, flag.factor, of_type)
    return kept


KEPT = _kept()
MappingFile = msgspec.defstruct(
    "MappingFile",
    [
        ("description", str, ""),
        *((name, of_type, {}) for name, of_type in _TABLES.items()),
        *((key, of_type, None) for name, (key, _, of_type) in KEPT.items() if name not in _TABLES),
    ],
    forbid_unknown_fields=True,
    omit_defaults=True,
)
"""The content of a mapping file; a column may have several headers, of which the first that a file has is used."""


def mapping_names() -> dict[str, str]:
    """The mappings that ``--as`` knows, with their descriptions; those of the user replace shipped ones."""
    files = {path.stem: path for folder in (_SHIPPED, user_folder()) for path in sorted(folder.glob("*.toml"))}
    return {name: load_mapping(path).description for name, path in sorted(files.items())}


def user_folder() -> Path:
    """Where the mappings of the user are: ``NEEDLEFORCE_MAPPINGS``, or the folder of settings of the system."""
    given = os.environ.get("NEEDLEFORCE_MAPPINGS")
    settings = os.environ.get("APPDATA" if os.name == "nt" else "XDG_CONFIG_HOME") or Path.home() / ".config"
    return Path(given) if given else Path(settings) / "needleforce" / "mappings"


def load_mapping(name: str | os.PathLike) -> msgspec.Struct:
    """A mapping by its name, or from a TOML file. Raises InputError for an unknown name and an invalid file."""
    path = _path_of(name)
    try:
        return decode_toml(read_bytes(path, "mapping", MAX_DEFINITION_BYTES), "mapping", MappingFile)
    except InputError as error:
        raise error if error.place else error.at(str(path)) from None


def _path_of(name: str | os.PathLike) -> Path:
    text = os.fspath(name)
    if text.endswith(".toml") or Path(text).name != text or isinstance(name, os.PathLike):
        return Path(text)
    known = [folder / f"{text.casefold()}.toml" for folder in (user_folder(), _SHIPPED)]
    found = next((path for path in known if path.is_file()), None)
    if found is None:
        names = ", ".join(mapping_names())
        step = "Give one of these, or a TOML file; inspect --save makes one."
        raise InputError("mapping", repr(text[:60]), f"known are {names}", next_step=step)
    return found


def completed(path: Path, options: ReadOptions) -> tuple[ReadOptions, str]:
    """Options that were given, completed by their mapping, or by that in the folder of the file.

    Parameters
    ----------
    path : Path
        The file that is read. Without a mapping ``needleforce.toml`` in its folder is used if there is one.
    options : ReadOptions
        Those given are kept.

    Returns
    -------
    options : ReadOptions
        Without a mapping.
    sentence : str
        What is assumed, empty without a mapping.

    Raises
    ------
    InputError
        As ``load_mapping``.
    """
    name, of_folder = options.mapping, path.parent / IN_FOLDER
    if name is None and not of_folder.is_file():
        return options, ""
    if name is None and of_folder.resolve().parent != path.parent.resolve():
        step = "Name it with --as, or copy it into the folder."
        raise InputError(IN_FOLDER, "a link", "leads out of the folder of the file", str(of_folder), step)
    mapping = load_mapping(of_folder if name is None else name)
    kept, changed = dict[str, Any](mapping=None), []
    for option, (key, factor, _) in KEPT.items():
        value, given = getattr(mapping, key), getattr(options, option)
        if option in _TABLES:
            kept[option] = value | dict(given or {})
            changed += [
                f"{key}.{name} = {toml_value(each)}" for name, each in value.items() if name not in (given or {})
            ]
        elif given is None and value is not None:
            kept[option] = value if factor is None else factor * value
            changed.append(f"{key} = {toml_value(value)}")
    origin = f"{IN_FOLDER} in the folder of the file" if name is None else f"the mapping {Path(name).name}"
    what = f": {', '.join(changed)}" if changed else ""
    return replace(options, **kept), f"columns, units and other options are those of {origin}{what}"


def save_mapping(options: ReadOptions, target: str, description: str = "") -> Path:
    """Write options of ``read`` as a mapping.

    Parameters
    ----------
    options : ReadOptions
        Those of ``read``, in SI.
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
    content: dict[str, Any] = {}
    for option, (key, factor, _) in KEPT.items():
        value = getattr(options, option)
        if value is not None:
            content[key] = value if factor is None else float(f"{value / factor:.12g}")
    path = Path(target)
    if not target.endswith(".toml"):
        path = user_folder() / f"{_checked_name(target)}.toml"
        path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_write(path) as file:
        file.write(
            "# how needleforce reads the files of one instrument\n"
            + _toml(msgspec.to_builtins(MappingFile(description=description, **content)))
        )
    return path


def _checked_name(name: str) -> str:
    if not name.replace("-", "").replace("_", "").isalnum() or not name.isascii():
        limit = "letters, digits, - and _ are allowed"
        raise InputError("name of the mapping", repr(name[:60]), limit, next_step="Give such a name, or a .toml file.")
    return name.casefold()


def _toml(content: Mapping[str, Any]) -> str:
    """A flat document with tables one level deep."""
    plain = [f"{key} = {toml_value(value)}\n" for key, value in content.items() if not isinstance(value, dict)]
    for key, table in content.items():
        if isinstance(table, dict) and table:
            plain.append(f"\n[{key}]\n" + "".join(f"{name} = {toml_value(value)}\n" for name, value in table.items()))
    return "".join(plain)
