# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: E501 - the content of hostile files has long lines
"""Hostile files for ``hostile_files.py``, in one table of formats: valid ones, how they are changed, also in what is
compressed in them, files that take far more to read than to store, and what is no regular file."""

import os
import random
import re
import socket
import struct
import zipfile
import zlib
from collections.abc import Callable, Sequence
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import NamedTuple

import damaged_files
import hostile_bombs as bombs
import hostile_content as content
import hostile_meshes as meshes
import log_files

from needleforce.wire.net_ft import SensorConfiguration

Change = Callable[[bytes, random.Random], bytes]
Bomb = Callable[[int, random.Random], bytes | str]
CELLS = [
    "nan", "inf", "-inf", "1e999", "1e-999", "", "x", "9" * 400, "0x10", "1_0", "١", "=1+1", '"', '"a\n', "\0", "\r", "#", "1,1", ";",
    "\t", "  ", "1e308", "-1e308", "5e-324", "\u202e", "\x1b[2J", "é", "\ufeff", "1" * 5001, "a" * 300, "[" * 200, "true", "1979-05-27",
]  # fmt: skip
NUMBERS = ["0", "-1", "1e-6", "1e6", "1e300", "-1e-300", "12345678901234567890", "0.5", "2e9"]
CARDS = ["motion: /dev/zero", "motion: run.csv", "motion: ..", "filter_length: 1e999", "filter_length: 1e9", "note: a 9 b",
         "note: gap " + "9" * 20 + " x", "start_depth_m: nan", "start_depth_m: 1e308", "assumption: \x1b]0;x\x07", "origin: " + "x" * 9999,
         "speed_mm_s: =1+1", "needle: \\xff\\x00"]  # fmt: skip
KEYS = ['"', "'''", '"""', "[", "]", "[[", "{", "}", "a.b.c.d = 1", "[a.b]", "=", ".", ",", "\\", "#", "inf", "-nan", "1e308", "1e400",
        "-1e308", "9" * 400, "0x" + "f" * 200, "1979-05-27T07:32:00Z", "[" * 40, "a." * 40 + "a=1", "[" * 5000, "\0", "\ufeff", "true",
        "{a={b={}}}", "[[[]]]", '""', "null", "-0", "5e-324", "\ud800".encode("utf-8", "replace").decode()]  # fmt: skip
OPTIONS = ["rate_hz = 0\n", "speed_mm_s = 1e300\n", "step_um = -1e-300\n", "first_row = 0\n", "first_row = 999999999999\n", 'part = "x"\n',
           "part = -1\n", 'columns.force = "*"\n', 'columns.force = "***********************a"\n', "columns.force = 0\n", "columns.time = -1\n",
           "columns.force = []\n", 'columns.x = "a"\n', 'units.force = "-1e308N"\n', 'units.force = "0N"\n', 'units.time = "N"\n',
           'units.depth = "1e-320mm"\n', 'inwards = ""\n', "filter_length = 0\n", "filter_length = 999999999999\n", "start_depth_mm = nan\n",
           'mapping = "x.toml"\n', "columns.force = 3\ncolumns.depth = 3\n", 'columns."motion.time" = 1\n']  # fmt: skip
TAGS = ["<!DOCTYPE a>", '<!DOCTYPE a [<!ENTITY b "c">]>', "&b;", "&#0;", "&#x110000;", "<a>", "</a>", "<![CDATA[", "]]>", "<?x?>", "<!--",
        "1e-6", "1e999", "nan", "-1", "0", "N" * 5000, "lbf-in", '"', "<", ">", "&", "9" * 400, '<?xml version="1.0" encoding="utf-16"?>',
        '<?xml version="1.0" encoding="x"?>']  # fmt: skip
YAML = [
    "&a",
    "*a",
    "<<: *a",
    "../../x",
    "/dev/zero",
    "!!python/object:os.system",
    "- " * 300,
    "zstd",
    "mcap",
    "sqlite3",
]
_CELLS = [b"\n", b"\r", b"\t", b";", b",", b"|", b"  ", b'"', b"#", b"# ", b"#N/A", b"--", b"OVER", b"12:30:01", b"1.234,5", b"1,234.5", b"(N)",
          b"Time", b"Force", b"Zeit;Weg", b"\n\n\n", b"nan", b"1e999", b"-1e308", b"9" * 400, b"a" * 300, b"\0", b"\xff\xfe", b"\xef\xbb\xbf",
          b"\n<DATA>\n", b"2026-01-02T03:04:05", b"99:99:99", b"1:1:1:1", b"0:0", b"=1+1", b"-", b"mm", b"\t" * 2000]  # fmt: skip
_VALUES = [b"0", b"1", b"-1", b"7", b"1e308", b"1e999", b"NaN", b"9" * 400, b"2147483648", b"-2147483649", b"4294967296", b"s", b"str", b"b",
           b"e", b"d", b"inlineStr", b"#N/A", b"#REF!", b"x", b"", b"A1", b"B3", b"XFD1048576", b"A0", b"AAAA99999999", b"C2:C61", b"&amp;",
           b"2026-01-02T03:04:05", b"=1+1", b"../../x.xml", b"/xl/workbook.xml", b"a" * 300, b"0.5", b"1,5", b"true", b"14", b"22"]  # fmt: skip
_WORDS = [b"null", b"NaN", b"[", b"]", b"{", b"}", b'"', b"1e999", b"9" * 400, b"-", b"\0", b"[" * 5000, b'{"a":' * 3000, b"true", b",",
          b"\n", b"\\ud800", b'"x"', b"[[1,2],[3]]"]  # fmt: skip


def _with_values(data: bytes, chance: random.Random) -> bytes:
    """A workbook with other values, names and attributes in one of its parts."""
    with zipfile.ZipFile(BytesIO(data)) as archive:
        names = archive.namelist()
    sheets = [name for name in names if "sheet" in name and name.endswith(".xml")]
    chosen = chance.choice(sheets if chance.random() < 0.7 else names)

    def changed(name: str, part: bytes) -> tuple[str, bytes]:
        for _ in range(chance.choice([1, 1, 2, 4, 16]) if name == chosen else 0):
            places = [found.span() for found in re.finditer(rb"(?<=>)[^<>]+(?=<)|(?<=\")[^\"<>]*(?=\")", part)]
            begin, end = chance.choice(places or [(0, 0)])
            part = part[:begin] + chance.choice(_VALUES) + part[end:]
        return name, part

    return content.zipped_again(data, changed)


def _with_members(others: float) -> Change:
    """An archive with members changed, and a share of them of names that lead elsewhere."""

    def change(data: bytes, chance: random.Random) -> bytes:
        def changed(name: str, part: bytes) -> tuple[str, bytes]:
            part = part[:8] + damaged_files.damaged(part, chance)[8:] if part and chance.random() < 0.5 else part
            elsewhere = ["../../" + name, "/" + name, "a\0b.npy", "\x1b[2J.npy"]
            return chance.choice(elsewhere) if chance.random() < others else name, part

        return content.zipped_again(data, changed)

    return change


def _with_cells(data: bytes, chance: random.Random) -> bytes:
    """Text with cells, delimiters and lines replaced, repeated or left out."""
    for _ in range(chance.choice([1, 1, 2, 4, 16])):
        at, size = chance.randrange(len(data)), chance.choice([0, 1, 5, 40])
        data = data[:at] + chance.choice([*_CELLS, data[at : at + 300]]) + data[at + size :]
    return data


def _with_json(data: bytes, chance: random.Random) -> bytes:
    """JSON with words inserted, in place of what is there or in addition to it."""
    for _ in range(chance.choice([1, 1, 2, 4])):
        at = chance.randrange(len(data))
        data = data[:at] + chance.choice(_WORDS) + data[at + chance.choice([0, 1, 5]) :]
    return data


def _overwritten(data: bytes, chance: random.Random) -> bytes:
    """Values of other bytes at the same places, so that what follows is found."""
    changed = bytearray(data)
    for _ in range(chance.choice([1, 1, 2, 4, 16])):
        at, size = chance.randrange(len(data)), chance.choice([1, 1, 2, 4, 8])
        drawn = chance.getrandbits(64), chance.getrandbits(8)
        value = chance.choice([0, 1, 2, 2**31, 2**32 - 1, 2**62, 2**64 - 1, *drawn])
        changed[at : at + size] = (value % 256**size).to_bytes(size, "little")
    return bytes(changed[: len(data)])


def _changed_elements(data: bytes, chance: random.Random) -> bytes:
    """Elements of MATLAB 5 changed before they are compressed again."""
    if not data.startswith(b"MATLAB 5.0"):
        return damaged_files.damaged(data, chance)
    parts, at = [data[:128]], 128
    while at + 8 <= len(data):
        kind, size = struct.unpack_from("<II", data, at)
        part = data[at + 8 : at + 8 + size]
        if kind == 15:
            unpacked = zlib.decompress(part)
            unpacked = unpacked[:8] + damaged_files.damaged(unpacked, chance)[8:] if chance.random() < 0.5 else unpacked
            part = zlib.compress(unpacked)
        parts.append(struct.pack("<II", kind, len(part)) + part)
        at += 8 + size
    return b"".join(parts)


def _with_words(text: str, words: list[str], chance: random.Random) -> bytes:
    """Values replaced, and words inserted, removed or repeated."""
    for _ in range(chance.choice([1, 1, 2, 4])):
        word = chance.choice(words) if chance.random() < 0.6 else chance.choice(NUMBERS)
        if chance.random() < 0.7:  # in place of a value
            values = list(re.finditer(r"-?\d[\d.e+-]*|\w+", text))
            if values:
                at = chance.choice(values)
                text = text[: at.start()] + word + text[at.end() :]
        else:
            at = chance.randrange(len(text) + 1)
            text = text[:at] + word * chance.choice([1, 1, 1, 2, 50, 1000]) + text[at + chance.choice([0, 0, 10]) :]
    return text.encode("utf-8", "replace")


def _bytes(*ways: tuple[float, Change], kept: int = 8) -> Change:
    """One of several ways by its share, otherwise other bytes at their places, or bytes moved, removed and repeated;
    those at the start, without which a file is of no format, are mostly kept."""

    def change(data: bytes, chance: random.Random) -> bytes:
        for share, way in ways:
            if chance.random() < share:
                return way(data, chance)
        keep = kept if chance.random() < 0.9 else 0
        changed = _overwritten(data, chance) if chance.random() < 0.6 else damaged_files.damaged(data, chance)
        return data[:keep] + changed[keep:]

    return change


def _text(words: list[str], encodings: tuple[str, ...] = ("utf-16", "utf-32", "utf-16-be", "utf-7", "cp037")) -> Change:
    """Words inserted or bytes damaged, sometimes in another encoding."""

    def change(data: bytes, chance: random.Random) -> bytes:
        plain = chance.random() < 0.3
        data = damaged_files.damaged(data, chance) if plain else _with_words(data.decode(), words, chance)
        if encodings and chance.random() < 0.05:
            data = data.decode("utf-8", "replace").encode(chance.choice(encodings), "replace")
        return data

    return change


def _changed_bag(folder: Path, chance: random.Random) -> Path:
    storage = chance.choice(["mcap", "sqlite3"])
    data = log_files.mcap(chance.randrange(4)) if storage == "mcap" else log_files.database()
    name = "bag.mcap" if storage == "mcap" else "bag.db3"
    metadata = log_files.METADATA.format(storage=storage, name=name).encode()
    if chance.random() < 0.5:
        data = damaged_files.damaged(data, chance)
    else:
        metadata = _with_words(metadata.decode(), [*KEYS, *YAML], chance)
    made = log_files.bag(folder, storage, data, metadata)
    if chance.random() < 0.05:
        (made / "more.db3").symlink_to("/dev/zero")
    return made


def _one(make: Callable[[int], bytes], count: int) -> Callable[[random.Random], bytes]:
    made = cache(make)
    return lambda chance: made(chance.randrange(count))


def _of(texts: Callable[[], Sequence[str]]) -> Callable[[random.Random], bytes]:
    return lambda chance: chance.choice(texts()).encode()


def _parquet(chance: random.Random) -> bytes:
    codec = chance.choice(["zstd", "snappy", "gzip", "none", "lz4", "brotli"])
    return content.parquet(codec, chance.choice(["1.0", "2.0"]), chance.random() < 0.5)


def _drawn(*makers: Bomb) -> Bomb:
    return lambda many, chance: chance.choice(makers)(many, chance)


class Format(NamedTuple):
    """Ending, what makes a valid content by chance, how it is changed, and what takes far more to read than to store."""

    ending: str
    content: Callable[[random.Random], bytes]
    change: Change
    bomb: Bomb | dict[str, Bomb]  # by the ending, if it has several


_CALIBRATION_BOMBS = {
    ".toml": bombs.toml_bomb,
    ".csv": lambda many, _: "axis,unit" + ",0" * (many // 2) + "\n" + "fx,N" + ",0" * (many // 2),
    ".cal": lambda many, chance: bombs.xml_bomb(many // 2, chance),
}
_CSV = [*CELLS, *(f"\n# {card}\n" for card in CARDS)]
_PARQUETS = (bombs.parquet_of_zeros, bombs.parquet_with_a_huge_page, bombs.parquet_of_columns)
_PAGE = SensorConfiguration(1e6, 1e6, 1000.0, "FT1", (1.0,) * 6)
_WORKBOOK = _bytes((0.6, _with_values), (0.5, _with_members(0.02)))
FORMATS = {
    "csv": Format(".csv", lambda _: content.csv_text().encode(), _text(_CSV), bombs.csv_bomb),
    "parquet": Format(".parquet", _parquet, damaged_files.damaged, _drawn(*_PARQUETS)),
    "mcap": Format(".mcap", _one(log_files.mcap, 4), damaged_files.damaged, bombs.mcap_bomb),
    "toml": Format(".toml", _of(content.definitions), _text(KEYS), bombs.toml_bomb),
    "json": Format(".json", lambda _: content.fit().encode(), _text(KEYS, ()), bombs.json_bomb),
    "mapping": Format(".toml", _of(content.mappings), _text(KEYS + OPTIONS), bombs.toml_bomb),
    "page": Format(".xml", lambda _: _PAGE.xml(), _text(TAGS), bombs.xml_bomb),
    "calibration": Format(
        ".cal", _of(lambda: list(content.CALIBRATION.values())), _text(KEYS + TAGS + CELLS), _CALIBRATION_BOMBS
    ),
    "table": Format(".csv", _of(lambda: content.TABLES), _text(CELLS), bombs.csv_bomb),
    "forms": Format(".txt", _one(content.texts, 14), _bytes((0.7, _with_cells), kept=0), _drawn(bombs.forms_bomb)),
    "lvm": Format(".lvm", _one(content.lvm, 6), _bytes((0.7, _with_cells), kept=19), _drawn(bombs.lvm_bomb)),
    "excel": Format(".xlsx", _one(content.excel, 6), _WORKBOOK, _drawn(bombs.excel_bomb)),
    "xlsm": Format(".xlsm", _one(content.xlsm, 3), _WORKBOOK, _drawn(bombs.excel_bomb)),
    "xls": Format(".xls", _one(content.xls, 6), _bytes(), _drawn(bombs.xls_bomb)),
    "npy": Format(".npy", _one(content.npy, 6), _bytes(), _drawn(bombs.npy_of_a_huge_shape)),
    "npz": Format(
        ".npz", _one(content.npz, 6), _bytes((0.5, _with_members(0.6)), kept=4),
        _drawn(bombs.npz_of_zeros, bombs.npz_that_states_little),
    ),
    "matlab": Format(
        ".mat", _one(content.matlab, 6), _bytes((0.5, _changed_elements), kept=4), _drawn(bombs.matlab_bomb)
    ),
    "matlab73": Format(".mat", _one(content.matlab73, 6), _bytes(kept=512), _drawn(bombs.matlab73_bomb)),
    "hdf5": Format(".h5", _one(content.hdf5, 6), _bytes(), _drawn(bombs.hdf5_bomb)),
    "tdms": Format(".tdms", _one(content.tdms, 6), _bytes(kept=4), _drawn(bombs.tdms_bomb)),
    "records": Format(".jsonl", _one(content.records, 6), _bytes((0.7, _with_json)), _drawn(bombs.records_bomb)),
    "ros1": Format(".bag", _one(log_files.ros1, 6), _bytes(kept=13), _drawn(bombs.ros1_bomb)),
    "jpk": Format(
        ".jpk-force", _one(content.jpk, 6), _bytes((0.5, _with_members(0.6)), kept=4), _drawn(bombs.jpk_bomb)
    ),
    "igor": Format(".ibw", _one(content.igor, 6), _bytes(kept=2), _drawn(bombs.igor_bomb)),
    "nanosurf": Format(".nid", _one(content.nanosurf, 6), _bytes(kept=9), _drawn(bombs.nanosurf_bomb)),
    **{
        kind: Format(ending, meshes.content(kind), _bytes((0.7, meshes.with_counts), kept=30), meshes.BOMBS[kind])
        for kind, ending in meshes.ENDINGS.items()
    },
}  # fmt: skip
BAG = "bag"  # a folder, for which the three functions here have ways of their own


def ending_of(kind: str) -> str:
    """The ending of a file of a format."""
    return "" if kind == BAG else FORMATS[kind].ending


def valid(kind: str, folder: Path) -> Path:
    """A valid file of a format."""
    if kind == BAG:
        return log_files.bag(folder, "sqlite3", log_files.database())
    path = folder / f"valid{ending_of(kind)}"
    path.write_bytes(FORMATS[kind].content(random.Random(0)))
    return path


def changed(kind: str, folder: Path, chance: random.Random) -> Path:
    """A valid file of a format with changes."""
    if kind == BAG:
        return _changed_bag(folder, chance)
    data = FORMATS[kind].content(chance)
    ending = next((each for each, text in content.CALIBRATION.items() if text.encode() == data), ending_of(kind))
    path = folder / f"x{ending}"
    path.write_bytes(FORMATS[kind].change(data, chance))
    return path


def bomb(kind: str, folder: Path, chance: random.Random) -> Path:
    """A file that takes far more to read than to store."""
    many = chance.choice([10**4, 10**5, 10**6])
    if kind == BAG:
        return bombs.bag_bomb(folder, chance)
    ending, make = ending_of(kind), FORMATS[kind].bomb
    if isinstance(make, dict):
        ending = chance.choice(list(make))
        make = make[ending]
    path, data = folder / f"x{ending}", make(many, chance)
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return path


def special(path: Path, chance: random.Random) -> Path:
    """What is no regular file, at ``path``."""
    match chance.randrange(7):
        case 0:
            os.mkfifo(path)
        case 1:
            path.mkdir()
        case 2:
            path.symlink_to(chance.choice(["/dev/zero", "/dev/full", "/dev/urandom", "/dev/tty", "/dev/null"]))
        case 3:
            path.symlink_to(path.name)
        case 4:
            with socket.socket(socket.AF_UNIX) as made:
                made.bind(str(path))
        case 5:
            return path.with_name("missing" + path.suffix)
        case 6:
            with open(path, "wb") as file:
                file.truncate(chance.choice([1 << 33, 1 << 40]))  # sparse: larger than any recording
    return path
