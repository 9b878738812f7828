# SPDX-License-Identifier: Apache-2.0
"""The format of a file by its first bytes, independent of its name, and the module and extra that read it."""

import os
import re
import struct
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from ...errors import InputError
from ...files import BAG, MCAP, open_regular

if TYPE_CHECKING:
    from ..file_table import FileTable

_SEARCHED_BYTES = 1 << 16  # at either end of a zip archive, where the names of its parts are
LABS = "needleforce[labs]"


@dataclass(frozen=True, kw_only=True)
class Format:
    """A format: its name in words, the module in this folder that has its ``tables(path)``, and the extra that it
    needs, if any; ``log`` for messages with topics; ``advice`` for a format that is recognised and not read."""

    name: str
    module: str = ""
    extra: str = ""
    log: bool = False
    advice: str = ""


TEXT = Format(name="text", module="text")
JSON = Format(name="JSON", module="json_lines")
ARCHIVE = Format(name="a zip archive", advice="Unpack it, and name the recording in it.")
MATLAB4 = Format(name="MATLAB 4", module="matlab")
IGOR = Format(name="an Igor wave (ibw)", module="igor", extra=LABS)
TDM = Format(
    name="a TDM file (National Instruments)",
    advice="Save it as TDMS in LabVIEW or DIAdem, or as a workbook with NI's TDM add-in for Excel.",
)
_IGOR_HEADERS = {2: 126, 5: 384}  # version -> bytes of which 16-bit words add up to zero
NANOSCOPE = Format(name="a NanoScope file (Bruker)", advice="In NanoScope Analysis, export the curves as ASCII text.")
ROS2_BAG = Format(name="a ROS 2 bag", log=True)
# first bytes -> format
_BY_START = {
    MCAP: Format(name="MCAP", log=True),
    b"#ROSBAG": Format(name="a ROS 1 bag", log=True),
    b"PAR1": Format(name="Parquet", module="parquet", extra="needleforce[parquet]"),
    b"\xd0\xcf\x11\xe0": Format(name="an Excel workbook (xls)", module="excel", extra=LABS),
    b"\x89HDF": Format(name="HDF5", module="hdf5", extra=LABS),
    b"MATLAB 5.0": Format(name="MATLAB 5", module="matlab"),
    b"MATLAB 7.3": Format(name="MATLAB 7.3", module="hdf5", extra=LABS),
    b"LabVIEW Measurement": Format(name="LabVIEW measurement (lvm)", module="lvm"),
    b"TDSm": Format(name="TDMS (LabVIEW)", module="tdms", extra=LABS),
    b"\x93NUMPY": Format(name="NumPy (npy)", module="numpy_arrays"),
    b"[DataSet]": Format(name="a Nanosurf file (nid)", module="nanosurf", extra=LABS),
    b"\\*Force file list": NANOSCOPE,
    b"\\*File list": NANOSCOPE,
    b"SQLite format 3": Format(
        name="a database",
        advice=f"If it is of a ROS 2 bag, name the bag's folder; without {BAG}, run ros2 bag reindex FOLDER first.",
    ),
}
_JSON = re.compile(rb"(\xef\xbb\xbf)?\s*(\{|\[\s*\{)")
_MATLAB4_NAME = re.compile(rb"[A-Za-z]\w*\0")
# a part of a zip archive -> format
_ZIPPED = {
    b"xl/workbook": Format(name="an Excel workbook (xlsx)", module="excel", extra=LABS),
    b"header.properties": Format(name="a JPK force curve", module="jpk", extra=LABS),
    b".npy": Format(name="NumPy (npz)", module="numpy_arrays"),
}
_PARTS_OF_SECOND = re.compile(r"(n|u|nano|micro)(sec|second)s?\W*$", re.IGNORECASE)  # the end of a header
_STORAGE = ("*.db3", "*.mcap")  # files of a ROS 2 bag
_ZIP = b"PK\x03\x04"


def format_of(path: Path) -> Format:
    """The format of a file or of the folder of a bag; ``TEXT`` for a file that cannot be read or has no known mark.

    JSON lines have no mark and begin with a brace.
    """
    try:
        if (path / BAG).is_file():
            return ROS2_BAG
        with open_regular(path) as file:
            start = file.read(_SEARCHED_BYTES)
            if start.startswith(_ZIP):
                file.seek(max(0, os.fstat(file.fileno()).st_size - _SEARCHED_BYTES))
                return _zipped(start, file.read(_SEARCHED_BYTES))
    except (OSError, ValueError):  # InputError is a ValueError
        return TEXT
    found = next((each for mark, each in _BY_START.items() if start.startswith(mark)), None)
    if found is None and _JSON.match(start):
        return JSON
    if found is None and _is_matlab4(start):
        return MATLAB4
    if found is None and b"<usi:tdm" in start[:4096]:
        return TDM
    if found is None and _is_igor_wave(start):
        return IGOR
    if found == NANOSCOPE and b"\0" not in start:  # the head of a text that this program exported
        return TEXT
    return found or TEXT


def _is_matlab4(start: bytes) -> bool:
    """Whether a file begins with an array of MATLAB 4: type, rows, columns, complex or not, and its name."""
    if len(start) < 24:
        return False
    for order, machine in (("<", 0), (">", 1)):
        kind, _, _, is_complex, length = struct.unpack_from(f"{order}5I", start)
        digits = kind // 1000, kind // 100 % 10, kind // 10 % 10, kind % 10
        if digits[:2] == (machine, 0) and digits[2] <= 5 and digits[3] <= 2 and is_complex <= 1 and 1 < length <= 64:
            return bool(_MATLAB4_NAME.fullmatch(start[20 : 20 + length]))
    return False


def _is_igor_wave(start: bytes) -> bool:
    """Whether a file begins with the header of an Igor wave, whose checksum is zero."""
    for order in "<>":
        version = struct.unpack_from(f"{order}h", start)[0] if len(start) > 1 else 0
        size = _IGOR_HEADERS.get(version, 0)
        if size and len(start) > size and any(start[2:size]):
            return sum(struct.unpack_from(f"{order}{size // 2}h", start)) % 2**16 == 0
    return False


def _zipped(start: bytes, end: bytes) -> Format:
    return next((each for part, each in _ZIPPED.items() if part in start or part in end), ARCHIVE)


def tables_of(path: Path) -> "list[FileTable]":
    """The tables of a file that is not a log, in the order of the file.

    Raises InputError for a format that is recognised and not read, a missing extra, and a damaged file.
    """
    found = format_of(path)
    if path.is_dir() and any(next(path.glob(pattern), None) for pattern in _STORAGE):
        limit, step = f"it has no {BAG}", f"Make it with ros2 bag reindex {path}, or name an mcap file in it."
        raise InputError("ROS 2 bag", "without an index", limit, str(path), step)
    if not found.module:
        raise InputError("file", found.name, "a table of numbers is needed", str(path), found.advice)
    try:
        tables = import_module(f".{found.module}", __package__).tables(path)
    except ImportError as error:
        limit = f"reading {found.name} needs the package {error.name}"
        step = f'Install it with pip install "{found.extra}".'
        raise InputError(f"package {error.name}", "missing", limit, str(path), step) from None
    if any(_PARTS_OF_SECOND.search(header) for table in tables for header in table.headers):
        from .clock_times import join_stamps

        return [join_stamps(table) for table in tables]
    return tables
