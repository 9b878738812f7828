# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: E501 - the content of hostile files has long lines
"""Changes of the files of ``hostile_arrays.py`` and ``hostile_tables.py``, also of what is compressed in them."""

import random
import re
import struct
import warnings
import zipfile
import zlib
from io import BytesIO

import damaged_files
import hostile_arrays
import hostile_tables

ENDINGS = {**hostile_arrays.ENDINGS, **hostile_tables.ENDINGS}
_WORKBOOKS = ("excel", "xlsm")
# bytes at the start that mostly stay, without which a file is of no format
_KEPT = {
    "matlab73": 512,
    "tdms": 4,
    "npy": 8,
    "npz": 4,
    "ros1": 13,
    "matlab": 4,
    "forms": 0,
    "lvm": 19,
    "jpk": 4,
    "igor": 2,
    "nanosurf": 9,
}
_CELLS = [b"\n", b"\r", b"\t", b";", b",", b"|", b"  ", b'"', b"#", b"# ", b"#N/A", b"--", b"OVER", b"12:30:01", b"1.234,5", b"1,234.5", b"(N)",
          b"Time", b"Force", b"Zeit;Weg", b"\n\n\n", b"nan", b"1e999", b"-1e308", b"9" * 400, b"a" * 300, b"\0", b"\xff\xfe", b"\xef\xbb\xbf",
          b"\n<DATA>\n", b"2026-01-02T03:04:05", b"99:99:99", b"1:1:1:1", b"0:0", b"=1+1", b"-", b"mm", b"\t" * 2000]  # fmt: skip
_VALUES = [b"0", b"1", b"-1", b"7", b"1e308", b"1e999", b"NaN", b"9" * 400, b"2147483648", b"-2147483649", b"4294967296", b"s", b"str", b"b",
           b"e", b"d", b"inlineStr", b"#N/A", b"#REF!", b"x", b"", b"A1", b"B3", b"XFD1048576", b"A0", b"AAAA99999999", b"C2:C61", b"&amp;",
           b"2026-01-02T03:04:05", b"=1+1", b"../../x.xml", b"/xl/workbook.xml", b"a" * 300, b"0.5", b"1,5", b"true", b"14", b"22"]  # fmt: skip
_WORDS = [b"null", b"NaN", b"[", b"]", b"{", b"}", b'"', b"1e999", b"9" * 400, b"-", b"\0", b"[" * 5000, b'{"a":' * 3000, b"true", b",",
          b"\n", b"\\ud800", b'"x"', b"[[1,2],[3]]"]  # fmt: skip


def content(kind: str, chance: random.Random) -> bytes:
    """A valid content of a format."""
    if kind in hostile_tables.ENDINGS:
        return hostile_tables.content(kind, chance.randrange(hostile_tables.N_FORMS[kind]))
    return hostile_arrays.content(kind, chance.randrange(hostile_arrays.N_FORMS))


def changed(kind: str, chance: random.Random) -> bytes:
    """A valid content with changes, also of what is compressed in it."""
    data = content(kind, chance)
    if kind in ("forms", "lvm") and chance.random() < 0.7:
        return _with_cells(data, chance)
    if kind in _WORKBOOKS and chance.random() < 0.6:
        return _with_values(data, chance)
    if kind in ("npz", "jpk", *_WORKBOOKS) and chance.random() < 0.5:
        return _changed_members(data, chance, 0.6 if kind in ("npz", "jpk") else 0.02)
    if kind == "matlab" and chance.random() < 0.5:
        return _changed_elements(data, chance)
    if kind == "records" and chance.random() < 0.7:
        for _ in range(chance.choice([1, 1, 2, 4])):
            at = chance.randrange(len(data))
            data = data[:at] + chance.choice(_WORDS) + data[at + chance.choice([0, 1, 5]) :]
        return data
    keep = _KEPT.get(kind, 8) if chance.random() < 0.9 else 0
    changed = _overwritten(data, chance) if chance.random() < 0.6 else damaged_files.damaged(data, chance)
    return data[:keep] + changed[keep:]


def _with_values(data: bytes, chance: random.Random) -> bytes:
    """A workbook with other values, names and attributes in one of its parts."""
    made = BytesIO()
    with zipfile.ZipFile(BytesIO(data)) as archive, zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as new:
        names = archive.namelist()
        sheets = [name for name in names if "sheet" in name and name.endswith(".xml")]
        chosen = chance.choice(sheets if chance.random() < 0.7 else names)
        for name in names:
            part = archive.read(name)
            for _ in range(chance.choice([1, 1, 2, 4, 16]) if name == chosen else 0):
                places = [found.span() for found in re.finditer(rb"(?<=>)[^<>]+(?=<)|(?<=\")[^\"<>]*(?=\")", part)]
                begin, end = chance.choice(places or [(0, 0)])
                part = part[:begin] + chance.choice(_VALUES) + part[end:]
            new.writestr(name, part)
    return made.getvalue()


def _with_cells(data: bytes, chance: random.Random) -> bytes:
    """Text with cells, delimiters and lines replaced, repeated or left out."""
    for _ in range(chance.choice([1, 1, 2, 4, 16])):
        at, size = chance.randrange(len(data)), chance.choice([0, 1, 5, 40])
        data = data[:at] + chance.choice([*_CELLS, data[at : at + 300]]) + data[at + size :]
    return data


def _overwritten(data: bytes, chance: random.Random) -> bytes:
    """Values of other bytes at the same places, so that what follows is found."""
    changed = bytearray(data)
    for _ in range(chance.choice([1, 1, 2, 4, 16])):
        at, size = chance.randrange(len(data)), chance.choice([1, 1, 2, 4, 8])
        value = chance.choice(
            [0, 1, 2, 2**31, 2**32 - 1, 2**62, 2**64 - 1, chance.getrandbits(64), chance.getrandbits(8)]
        )
        changed[at : at + size] = (value % 256**size).to_bytes(size, "little")
    return bytes(changed[: len(data)])


def _changed_members(data: bytes, chance: random.Random, other: float) -> bytes:
    made = BytesIO()
    with zipfile.ZipFile(BytesIO(data)) as archive, zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as new:
        for name in archive.namelist():
            part = archive.read(name)
            part = part[:8] + damaged_files.damaged(part, chance)[8:] if part and chance.random() < 0.5 else part
            others = ["../../" + name, "/" + name, "a\0b.npy", "\x1b[2J.npy"]
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # a name that is there twice is meant
                new.writestr(chance.choice(others) if chance.random() < other else name, part)
    return made.getvalue()


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
