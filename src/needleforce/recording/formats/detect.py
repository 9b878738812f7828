# SPDX-License-Identifier: Apache-2.0
"""The formats, that of a file by its content, independent of its name, and its tables by the module that reads it."""

import os
import re
from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from ...errors import InputError, install_step
from ...files import BAG, MCAP, open_regular, same_file
from . import Format

if TYPE_CHECKING:
    from ..table import Table

_SEARCHED_BYTES = 1 << 16  # at either end of a zip archive, where the names of its parts are
_ZIP = b"PK\x03\x04"
_PARTS_OF_SECOND = re.compile(r"(n|u|nano|micro)(sec|second)s?\W*$", re.IGNORECASE)  # the end of a header
_ROWS = "recording/formats/detect.py"
_STORAGE = ("*.db3", "*.mcap")  # files of a ROS 2 bag

_EXCEL = {"module": ".excel", "limited": True, "bytes_per_s": 1e6, "package": "python_calamine"}  # of objects: slow
_LABS = {"limited": True, "extra": "labs"}
_HDF5 = {"module": ".hdf5", "package": "h5py", **_LABS}


def _is_json(start: bytes) -> bool:
    """Whether an object of JSON comes first, which may be in a list."""
    return bool(re.match(rb"(\xef\xbb\xbf)?\s*(\{|\[\s*\{)", start))


def _is_matlab4(start: bytes) -> bool:
    if b"\0\0" not in start[:4]:  # a small number comes first
        return False
    from .matlab import is_version4

    return is_version4(start)


def _is_igor(start: bytes) -> bool:
    if b"\0" not in start[:2]:  # the version comes first
        return False
    from .igor import is_wave

    return is_wave(start)


def _is_nanoscope(start: bytes) -> bool:
    """Whether a file has the head of a NanoScope file, and is not the text that its program exports with this head."""
    return start.startswith((b"\\*Force file list", b"\\*File list")) and b"\0" in start


JSON = Format(module=".json_lines", name="JSON", suffixes=(".json", ".jsonl"), matches=_is_json)
# of a file that none of the rows fits, of another zip archive, and of a folder
TEXT = Format(module=".text", name="text", suffixes=(".csv", ".tsv", ".txt", ".dat"))
ARCHIVE = Format(name="a zip archive", advice="Unpack it, and name the recording in it.")
ROS2_BAG = Format(name="a ROS 2 bag", log=True)
# a row each; of two that fit a file, the first is its format; the functions above import a module only where it may fit
FORMATS = (
    Format(name="an Excel workbook (xlsx)", suffixes=(".xlsx", ".xlsm"), member=b"xl/workbook", **_EXCEL),
    Format(name="an Excel workbook (xls)", suffixes=(".xls",), starts=(b"\xd0\xcf\x11\xe0",), **_EXCEL),
    Format(
        module=".jpk",
        name="a JPK force curve",
        suffixes=(".jpk-force", ".jpk-force-map"),
        member=b"header.properties",
        package="afmformats",
        **_LABS,
    ),
    Format(module=".numpy_arrays", name="NumPy (npz)", suffixes=(".npz",), member=b".npy"),
    Format(module=".numpy_arrays", name="NumPy (npy)", suffixes=(".npy",), starts=(b"\x93NUMPY",)),
    Format(
        module=".parquet",
        name="Parquet",
        suffixes=(".parquet",),
        starts=(b"PAR1",),
        limited=True,
        package="pyarrow",
        extra="parquet",
    ),
    Format(name="HDF5", suffixes=(".h5", ".hdf5"), starts=(b"\x89HDF",), **_HDF5),
    Format(name="MATLAB 7.3", suffixes=(".mat",), starts=(b"MATLAB 7.3",), **_HDF5),
    Format(module=".tdms", name="TDMS (LabVIEW)", suffixes=(".tdms",), starts=(b"TDSm",), package="nptdms", **_LABS),
    Format(
        module=".nanosurf",
        name="a Nanosurf file (nid)",
        suffixes=(".nid",),
        starts=(b"[DataSet]",),
        package="NSFopen",
        **_LABS,
    ),
    Format(module=".lvm", name="LabVIEW measurement (lvm)", suffixes=(".lvm",), starts=(b"LabVIEW Measurement",)),
    JSON,
    Format(module=".matlab", name="MATLAB 5", suffixes=(".mat",), starts=(b"MATLAB 5.0",), limited=True),
    Format(module=".matlab", name="MATLAB 4", suffixes=(".mat",), matches=_is_matlab4, limited=True),
    Format(module=".igor", name="an Igor wave (ibw)", suffixes=(".ibw",), matches=_is_igor, package="igor2", **_LABS),
    Format(name="MCAP", suffixes=(".mcap",), starts=(MCAP,), log=True),
    Format(name="a ROS 1 bag", suffixes=(".bag",), starts=(b"#ROSBAG",), log=True),
    Format(
        name="a database",
        suffixes=(".db3",),
        starts=(b"SQLite format 3",),
        advice=f"If it is of a ROS 2 bag, name the bag's folder; without {BAG}, run ros2 bag reindex FOLDER first.",
    ),
    Format(
        name="a NanoScope file (Bruker)",
        suffixes=(".spm",),
        matches=_is_nanoscope,
        advice="In NanoScope Analysis, export the curves as ASCII text.",
    ),
    Format(
        name="a TDM file (National Instruments)",
        suffixes=(".tdm",),
        matches=lambda start: b"<usi:tdm" in start[:4096],
        advice="Save it as TDMS in LabVIEW or DIAdem, or as a workbook with NI's TDM add-in for Excel.",
    ),
)


@cache
def declared() -> tuple[Format, ...]:
    """The formats of the rows. Raises InputError for one that is incomplete, or declared twice."""
    for number, form in enumerate(FORMATS):
        check_declaration(form, FORMATS[:number])
    return FORMATS


def check_declaration(form: Format, others: Iterable[Format]) -> None:
    """Raise InputError for a format that lacks a part of its declaration, or that one of the ``others`` is, too."""
    step = "Complete its row in FORMATS; recording/formats/template.py explains the parts."
    missing = {
        "name": not form.name,
        "suffixes": not form.suffixes,
        "starts, member or matches": not (form.starts or form.member or form.matches),
        "module": not (form.module or form.log or form.advice),
        "package": form.extra != "" and not form.package,
    }
    for part, is_missing in missing.items():
        if is_missing:
            raise InputError(f"{part} of the format {form.name!r}", "missing", "", _ROWS, step)
    for other in others:
        marks = {"name": form.name == other.name, "member": form.member != b"" and form.member == other.member}
        marks["starts"] = any(a.startswith(b) or b.startswith(a) for a in form.starts for b in other.starts)
        for part in (part for part, is_same in marks.items() if is_same):
            value, limit = repr(getattr(form, part)), f"the format {other.name!r} has it, too"
            raise InputError(f"{part} of the format {form.name!r}", value, limit, _ROWS, "Declare each format once.")


def format_of(path: Path) -> Format:
    """The format of a file or of the folder of a bag; ``TEXT`` for a file that cannot be read or that no other fits."""
    formats = declared()
    try:
        if (path / BAG).is_file():
            return ROS2_BAG
        with open_regular(path) as file:
            start = file.read(_SEARCHED_BYTES)
            if start.startswith(_ZIP):
                file.seek(max(0, os.fstat(file.fileno()).st_size - _SEARCHED_BYTES))
                ends = start, file.read(_SEARCHED_BYTES)
                zipped = (each for each in formats if each.member and any(each.member in end for end in ends))
                return next(zipped, ARCHIVE)
    except (OSError, ValueError):  # InputError is a ValueError
        return TEXT
    fitting = (each for each in formats if start.startswith(each.starts) or (each.matches and each.matches(start)))
    return next(fitting, TEXT)


def tables_of(path: Path) -> "list[Table]":
    """The tables of a file that is not a log, in the order of the file.

    Raises InputError for a format that is recognised and not read, a missing package, and a damaged file.
    """
    form = format_of(path)
    if path.is_dir() and any(next(path.glob(pattern), None) for pattern in _STORAGE):
        limit, step = f"it has no {BAG}", f"Make it with ros2 bag reindex {path}, or name an mcap file in it."
        raise InputError("ROS 2 bag", "without an index", limit, str(path), step)
    if not form.module:
        raise InputError("file", form.name, "a table of numbers is needed", str(path), form.advice)
    try:
        tables = read_tables(form, path)
    except ImportError as error:
        limit = f"reading {form.name} needs the package {error.name}"
        step = install_step(str(error.name), form.extra)
        raise InputError(f"package {error.name}", "missing", limit, str(path), step) from None
    if any(_PARTS_OF_SECOND.search(header) for table in tables for header in table.headers):
        from .clock_times import join_stamps

        return [join_stamps(table) for table in tables]
    return tables


def read_tables(form: Format, path: Path) -> "list[Table]":
    """The tables of the file that the name has now. Raises InputError, and ImportError without the format's package."""
    reading = same_file(path)
    with reading():
        if form.limited:
            from .worker import tables_by_worker

            return [replace(table, reading=reading) for table in tables_by_worker(form, path)]
        return [replace(table, reading=reading) for table in import_module(form.module, __package__).tables(path)]
