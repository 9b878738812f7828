# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: E501 - the content of hostile files has long lines
"""Hostile files for ``hostile_files.py``: valid ones with changes, also of what is compressed in them, and files that take
far more to read than to store."""

import random
import re
import struct
import zipfile
import zlib
from collections.abc import Callable, Sequence
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import NamedTuple

import damaged_files
import hostile_content as content
import numpy as np
from mcap.data_stream import RecordBuilder
from mcap.records import Chunk

from needleforce.files import MCAP
from needleforce.recording.log import ros_messages
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
    """JSON with words inserted, in place of what is there or besides it."""
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
    data = content.mcap(chance.randrange(4)) if storage == "mcap" else content.database()
    name = "bag.mcap" if storage == "mcap" else "bag.db3"
    metadata = content.METADATA.format(storage=storage, name=name).encode()
    if chance.random() < 0.5:
        data = damaged_files.damaged(data, chance)
    else:
        metadata = _with_words(metadata.decode(), [*KEYS, *YAML], chance)
    made = content.bag(folder, storage, data, metadata)
    if chance.random() < 0.05:
        (made / "more.db3").symlink_to("/dev/zero")
    return made


def _csv_bomb(many: int, chance: random.Random) -> str:
    head = "time_s,depth_mm,force_N"
    slow = ["(", "_", " ( ", "/ "]  # of headers for which a search takes long
    forms = [
        lambda: head + "".join(f",c{k}" for k in range(many)) + "\n" + ("0" + ",0" * (many + 2) + "\n") * 3,
        lambda: head + "\n0,0," + "9" * 1_000_000 * (many // 20_000 + 1),
        lambda: "# note: gap 1 x\n" * many,
        lambda: "\n" * many,
        lambda: head + '\n"' + "0,0,0\n" * many,
        lambda: head + "\n" + "0\n" * many,
        lambda: "time_s,depth_mm," + chance.choice(slow) * 20_000 + "\n0,0,0\n",
    ]
    return chance.choice(forms)()


def _json_bomb(many: int, chance: random.Random) -> str:
    forms = ["[" * many, '{"a":' * many, "[" + "[]," * many + "0]", "9" * many, '"' + "\\u0000" * many + '"']
    return chance.choice(forms)


def _parquet_of_zeros(many: int, chance: random.Random) -> bytes:
    """Values that take no space."""
    names = ("time_s", "depth_m", "force_N", "fx_N", "fy_N", "tx_N_m")
    return content.parquet_of(dict.fromkeys(names, np.zeros(20 * many)), compression="zstd")


def _parquet_with_a_huge_page(many: int, chance: random.Random) -> bytes:
    """The sizes in the page headers are replaced by larger ones of as many bytes."""
    data = bytearray(content.parquet("zstd"))
    at = data.find(b"\x15", 4, 40)
    data[at + 2 : at + 6] = b"\x15\xfe\xff\xff"
    return bytes(data)


def _parquet_of_columns(many: int, chance: random.Random) -> bytes:
    return content.parquet_of({f"c{k}": np.zeros(2) for k in range(min(many, 20_000) // 4)})


def _chunk(data: bytes, compression: str, size: int) -> bytes:
    builder = RecordBuilder()
    times = {"message_start_time": 0, "message_end_time": 0}
    Chunk(compression=compression, data=data, uncompressed_crc=0, uncompressed_size=size, **times).write(builder)
    return builder.end()


def _mcap_bomb(many: int, chance: random.Random) -> bytes:
    import lz4.frame
    import zstandard

    size = chance.choice([1 << 26, (1 << 26) + 1, 1 << 32, 2**63, 2**64 - 1])
    zeros = bytes(1 << 24)
    packed = {"zstd": zstandard.compress(zeros), "lz4": lz4.frame.compress(zeros)}
    compression = chance.choice(list(packed))
    forms = [
        _chunk(packed[compression], compression, size),
        _chunk(packed[compression] * 8, compression, 1 << 27),
        _chunk(packed[compression], compression, 1 << 24) * chance.choice([10, 100]),
        struct.pack("<BQ", 4, size % 2**64) + b"x" * 100,
        struct.pack("<BQ", 12, 200) + struct.pack("<I", 2**32 - 1) + b"x" * 196,
        _marks(chance),
    ]
    return MCAP + chance.choice(forms)


def _marks(chance: random.Random) -> bytes:
    """Marks whose facts take far more memory than their text."""
    from mcap.writer import Writer

    text = '{"kind": "a", "x": [' + "[]," * chance.choice([100, 20_000, 2_000_000]) + "0]}"
    made = BytesIO()
    writer = Writer(made, chunk_size=1 << 22)
    writer.start("ros2", "x")
    schema = writer.register_schema(ros_messages.STRING, "ros2msg", b"string data")
    channel = writer.register_channel("/needle/marks", "cdr", schema)
    data = ros_messages.string_message(text)
    for number in range(min(200, (50 << 20) // len(data))):
        writer.add_message(channel, number, data, number, number)
    writer.finish()
    return made.getvalue()[len(MCAP) :]


def _bag_bomb(folder: Path, chance: random.Random) -> Path:
    match chance.randrange(5):
        case 0:
            return content.bag(folder, "sqlite3", content.database(views=True))
        case 1:
            return content.bag(folder, "mcap", _mcap_bomb(0, chance))
        case 2:
            levels = "".join(f"l{k}: &l{k} {{<<: [*l{k - 1}, *l{k - 1}]}}\n" for k in range(1, 40))
            return content.bag(folder, "mcap", MCAP, b"l0: &l0 {a: 1}\n" + levels.encode())
        case 3:
            return content.bag(folder, "mcap", MCAP, b"[" * chance.choice([1000, 10**5, 10**6]))
    made = content.METADATA.format(storage="mcap", name="bag.mcap.zstd")
    for word, other in (("mode", "FILE"), ("format", "zstd")):
        made = made.replace(f"compression_{word}: ''", f"compression_{word}: {other}")
    return content.bag(folder, "mcap", MCAP, made.encode())


def _toml_bomb(many: int, chance: random.Random) -> str:
    many //= 2
    forms = ["a" + ".a" * many + " = 1", "[a" + ".a" * many + "]", "a = " + "[" * many, "a = " + "{a=" * many, "a = " + "9" * many,
             "a = 0x" + "f" * many, "a = [" + "[]," * (many // 2) + "]", "a = [" + "{}," * (many // 2) + "]", "[[a]]\n" * (many // 6),
             'a = """' + "\\" * many, "a" * many + " = 1", "".join(f"k{k} = 1\n" for k in range(many // 10)), "a = 1" + " " * many,
             'a={b="""x"""", ' + "a." * many + "a=1}", "\n" * many, "a = 1e" + "9" * many, "#" * many]  # fmt: skip
    return chance.choice(forms)


def _xml_bomb(many: int, chance: random.Random) -> str:
    laughs = "".join(f'<!ENTITY l{k} "{f"&l{k - 1};" * 10}">' for k in range(1, 12))
    forms = ["<a>" * many, "<a" + ' b="c"' * (many // 6) + "/>", f'<!DOCTYPE a [<!ENTITY l0 "x">{laughs}]><a>&l11;</a>', "<a>" + "&#65;" * (many // 5) + "</a>",
             "<a><!--" + "-" * many, "<a>" + "<b/>" * (many // 4) + "</a>", "<" + "a" * many + "/>"]  # fmt: skip
    return chance.choice(forms)


def _npy_of_a_huge_shape(many: int, chance: random.Random) -> bytes:
    shape = chance.choice(
        ["(1000000000000,)", "(2000000000, 3)", "(99999999999999999999, 2)", "(-5, 2)", "(1,) * 99", "(" * 5000]
    )
    head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".encode()
    return b"\x93NUMPY\1\0" + struct.pack("<H", len(head)) + head + bytes(800)


def _npz_of_zeros(many: int, chance: random.Random) -> bytes:
    made = BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in ("time", "depth", "force"):
            one = BytesIO()
            np.save(one, np.zeros(chance.choice([10**6, 2 * 10**7])))
            archive.writestr(f"{name}.npy", one.getvalue())
    return made.getvalue()


def _npz_that_states_little(many: int, chance: random.Random) -> bytes:
    data = bytearray(_npz_of_zeros(many, chance))
    at = data.rfind(b"PK\1\2")
    data[at + 24 : at + 28] = struct.pack("<I", chance.choice([0, 128, 1000, 2**32 - 1]))
    return bytes(data)


def _excel_bomb(many: int, chance: random.Random) -> bytes:
    head = b'<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><sheetData>'
    end = b"</sheetData></worksheet>"
    sheets = [
        bytes(400 << 20),
        head + b'<row r="1"><c r="A1"><v>1</v></c></row><row r="1048576"><c r="XFD1048576"><v>1</v></c></row>' + end,
        b'<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>' + head + b"&b;" * 1000 + end,
        head + b'<row r="1"><c r="A1"><v>1</v></c></row>' * 10**6 + end,
        head + b"<row>" * 100_000,
    ]
    sheet = chance.choice(sheets)
    return content.zipped_again(
        content.excel(0), lambda name, part: (name, sheet if name.endswith("sheet1.xml") else part)
    )


def _forms_bomb(many: int, chance: random.Random) -> bytes:
    forms = [
        b"1\t2\t3\n" * 2_000_000,
        b"a\t" * 500_000,
        b"".join(b"1\t2\nx\ty\n" for _ in range(300_000)),
        b"1:2\t" * 1000 + b"\n" + (b"0:00:01\t" * 1000 + b"\n") * 300,
        (b"1,5;" * 500 + b"\n") * 2000,
        b"# a\n" * 500_000,
        b"\n" * 5_000_000,
    ]
    return chance.choice(forms)


def _lvm_bomb(many: int, chance: random.Random) -> bytes:
    end = b"***End_of_Header***\n"
    forms = [
        b"\n" * 5_000_000,
        end * 300_000,
        (b"Channels\t2\n" + end + b"X_Value\tF\n0\t1\n1\t2\n") * 50_000,
        end + b"\t" * 2_000_000 + b"\n",
        end + b"Channels\t1\n" + end + b"X_Value\tF\n" + b"0\t1\n" * 1_000_000,
        b"a\tb\n" * 1_000_000,
    ]
    return b"LabVIEW Measurement\n" + chance.choice(forms)


def _xls_bomb(many: int, chance: random.Random) -> bytes:
    """Cells far apart, and sizes in the compound file that lie."""
    data = bytearray(content.xls(0))
    if chance.random() < 0.5:
        at = data.find(struct.pack("<HH", 0x203, 14))  # a cell with a number
        struct.pack_into("<HH", data, at + 4, 0xFFFF, chance.choice([0xFF, 0x3FFF, 0xFFFF]))
    else:  # sizes and first sectors in the header
        struct.pack_into(
            "<I", data, chance.choice([0x2C, 0x30, 0x3C, 0x40, 0x44, 0x48]), chance.choice([0, 1, 2**31, 2**32 - 3])
        )
    return bytes(data)


def _element(kind: int, data: bytes) -> bytes:
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def _matrix(matlab_class: int, shape: tuple[int, ...], *parts: bytes) -> bytes:
    head = (
        _element(6, struct.pack("<II", matlab_class, 0))
        + _element(5, struct.pack(f"<{len(shape)}i", *shape))
        + _element(1, b"x")
    )
    return _element(14, head + b"".join(parts))


def _matlab_bomb(many: int, chance: random.Random) -> bytes:
    empty = _element(14, b"")
    inner = _element(14, b"")
    for _ in range(5000):
        inner = _matrix(1, (1, 1), inner)
    forms = [
        _matrix(6, (20_000_000, 1), _element(9, bytes(160_000_000))),
        _matrix(1, (10**6, 1), empty * 10**6),
        _matrix(1, (2**31 - 1, 2**31 - 1), empty),
        _matrix(2, (2**20, 2**11), _element(5, struct.pack("<i", 8)), _element(1, b"a".ljust(8, b"\0"))),
        _matrix(2, (2**30, 1), _element(5, struct.pack("<i", 0)), _element(1, b"")),
        _matrix(4, (10**8, 1), _element(16, bytes(10**8))),
        _matrix(5, (2**30, 2**30), _element(5, bytes(8)), _element(5, bytes(8)), _element(9, bytes(8))),
        inner,
    ]
    packed = zlib.compress(chance.choice(forms))
    return content.matlab(0)[:128] + struct.pack("<II", 15, len(packed)) + packed * chance.choice([1, 1, 3])


def _hdf5_bomb(many: int, chance: random.Random) -> bytes:
    import h5py

    def zeros(file):
        for name in ("time", "force"):
            file.create_dataset(name, data=np.zeros(20_000_000), compression="gzip", chunks=(1_000_000,))

    def unwritten(file):
        file.create_dataset("time", shape=(10**11,), dtype="f8", chunks=(10**6,), compression="gzip")

    def chunk(file):  # which unpacks to more than it may
        made = file.create_dataset("time", shape=(1000,), dtype="f8", chunks=(1000,), compression="gzip")
        made.id.write_direct_chunk((0,), zlib.compress(bytes(200_000_000)))

    def twice(file):
        plan = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        plan.set_chunk((1000,)), plan.set_deflate(9), plan.set_deflate(9)
        made = h5py.h5d.create(file.id, b"time", h5py.h5t.NATIVE_DOUBLE, h5py.h5s.create_simple((1000,)), plan)
        made.write_direct_chunk((0,), zlib.compress(zlib.compress(bytes(200_000_000))))

    def groups(file):
        for number in range(20_000):
            file.create_group(f"g{number}")

    def deep(file):
        file.create_group("/".join("a" * 500)).create_dataset("time", data=content.TIME)

    def virtual(file):
        layout = h5py.VirtualLayout(shape=(100,), dtype="f8")
        layout[:] = h5py.VirtualSource("/etc/passwd", "time", shape=(100,))
        file.create_virtual_dataset("time", layout)

    def external(file):
        file.create_dataset("time", shape=(100,), dtype="u1", external=[("/etc/passwd", 0, 100)])

    def texts(file):
        file.create_dataset("time", data=["a" * 1000] * 10_000, compression="gzip")

    return content.h5_bytes(chance.choice([zeros, unwritten, chunk, twice, groups, deep, virtual, external, texts]))


def _matlab73_bomb(many: int, chance: random.Random) -> bytes:
    import h5py

    def fill(file):
        group = file.create_group("#refs#")
        target = group.create_dataset("a", data=content.TIME[None, :])
        target.attrs["MATLAB_class"] = np.bytes_("double")
        cells = None
        for number in range(chance.choice([1, 3, 40])):  # each cell array refers to the one before, a thousand times
            refs = np.array([[(cells or target).ref] * 1000], dtype=h5py.ref_dtype)
            cells = (file if number == 0 else group).create_dataset(f"c{number}", data=refs)
            cells.attrs["MATLAB_class"] = np.bytes_("cell")
        file["cells"] = cells
        made = file.create_dataset("loop", shape=(1, 1), dtype=h5py.ref_dtype)
        made[0, 0] = made.ref
        made.attrs["MATLAB_class"] = np.bytes_("cell")

    return b"MATLAB 7.3 MAT-file".ljust(512, b" ") + content.h5_bytes(fill, userblock_size=512)[512:]


def _tdms_bomb(many: int, chance: random.Random) -> bytes:
    data = bytearray(content.tdms(chance.randrange(6)))
    at = data.find(struct.pack("<Q", content.ROWS))  # the number of values of a channel
    data[at : at + 8] = struct.pack("<Q", chance.choice([2**62, 2**40, 2**32, 10**9, 2**64 - 1]))
    return bytes(data) * chance.choice([1, 1, 200, 5000])


def _records_bomb(many: int, chance: random.Random) -> bytes:
    many = chance.choice([10**4, 10**5, 10**6])
    forms = ["[{" + '"a":[' * many, '{"a":' * many, '{"a":[' + "[]," * many + "0]}", '{"a":1}\n' * 2 + '{"a":[' + "1," * many + "1]}",
             "{}\n" * many, '{"a":' + "9" * many + "}", "".join(f'{{"k{k}":1}}\n' for k in range(min(many, 10**5))),
             "".join(f'{{"k{k % 1000}":1}}\n' for k in range(many)), "[" + ",".join(['{"a":{}}'] * many) + "]",
             "{" + ",".join(f'"k{k}":[1,2]' for k in range(min(many, 10**5))) + "}",
             "{" + ",".join(f'"k{k}":[{"1," * (k + 2)}1]' for k in range(min(many, 5000))) + "}"]  # fmt: skip
    return chance.choice(forms).encode()


def _ros1_bomb(many: int, chance: random.Random) -> bytes:
    data = bytearray(content.ros1(chance.randrange(3)))
    field = chance.choice([b"conn_count=", b"chunk_count=", b"index_pos=", b"count=", b"chunk_pos=", b"conn="])
    places = [at for at in range(len(data)) if data.startswith(field, at)]
    for at in places[: chance.choice([1, 100])]:
        data[at + len(field) : at + len(field) + 4] = struct.pack("<I", chance.choice([2**32 - 1, 10**6, 0, 1, 4117]))
    return bytes(data)


def _jpk_bomb(many: int, chance: random.Random) -> bytes:
    """Samples without end, or as many as the header states."""
    zeros = chance.choice([10**6, 2 * 10**8])

    def changed(name: str, part: bytes) -> tuple[str, bytes]:
        part = part.replace(b"num-points=400", b"num-points=%d" % chance.choice([400, 10**12]))
        return name, bytes(zeros) if name.endswith("1/channels/vDeflection.dat") else part

    return content.zipped_again(content.jpk(1), changed)


def _igor_bomb(many: int, chance: random.Random) -> bytes:
    """A wave with more samples than the file has bytes, and a checksum that fits."""
    count = chance.choice([10**6, 2**31 - 1, -5])
    data = bytearray(content.igor(0))
    data[64 + 12 : 64 + 16] = data[64 + 68 : 64 + 72] = struct.pack("<i", count)
    data[2:4] = bytes(2)
    words = int(np.frombuffer(bytes(data[:384]), "<i2").astype(int).sum())
    data[2:4] = np.array(-words).astype("<i2").tobytes()
    return bytes(data)


def _nanosurf_bomb(many: int, chance: random.Random) -> bytes:
    what = chance.choice([b"Points", b"Lines", b"SaveBits", b"GroupCount"])
    number = b"%d" % chance.choice([10**5, 10**9, 10**30, -1])
    return re.sub(rb"\n" + what + rb"=\d+", b"\n" + what + b"=" + number, content.nanosurf(0))


def _one(make: Callable[[int], bytes], count: int) -> Callable[[random.Random], bytes]:
    made = cache(make)
    return lambda chance: made(chance.randrange(count))


def _of(texts: Callable[[], Sequence[str]]) -> Callable[[random.Random], bytes]:
    return lambda chance: chance.choice(texts()).encode()


def _parquet(chance: random.Random) -> bytes:
    codec = chance.choice(["zstd", "snappy", "gzip", "none", "lz4", "brotli"])
    return content.parquet(codec, chance.choice(["1.0", "2.0"]), chance.random() < 0.5)


def _drawn(*bombs: Bomb) -> Bomb:
    return lambda many, chance: chance.choice(bombs)(many, chance)


class Format(NamedTuple):
    """Ending, what makes a valid content by chance, how it is changed, and what takes far more to read than to store."""

    ending: str
    content: Callable[[random.Random], bytes]
    change: Change
    bomb: Bomb | dict[str, Bomb]  # by the ending, if it has several


_CALIBRATION_BOMBS = {
    ".toml": _toml_bomb,
    ".csv": lambda many, _: "axis,unit" + ",0" * (many // 2) + "\n" + "fx,N" + ",0" * (many // 2),
    ".cal": lambda many, chance: _xml_bomb(many // 2, chance),
}
_CSV = [*CELLS, *(f"\n# {card}\n" for card in CARDS)]
_PARQUETS = (_parquet_of_zeros, _parquet_with_a_huge_page, _parquet_of_columns)
_PAGE = SensorConfiguration(1e6, 1e6, 1000.0, "FT1", (1.0,) * 6)
_WORKBOOK = _bytes((0.6, _with_values), (0.5, _with_members(0.02)))
FORMATS = {
    "csv": Format(".csv", lambda _: content.csv_text().encode(), _text(_CSV), _csv_bomb),
    "parquet": Format(".parquet", _parquet, damaged_files.damaged, _drawn(*_PARQUETS)),
    "mcap": Format(".mcap", _one(content.mcap, 4), damaged_files.damaged, _mcap_bomb),
    "toml": Format(".toml", _of(content.definitions), _text(KEYS), _toml_bomb),
    "json": Format(".json", lambda _: content.fit().encode(), _text(KEYS, ()), _json_bomb),
    "mapping": Format(".toml", _of(content.mappings), _text(KEYS + OPTIONS), _toml_bomb),
    "page": Format(".xml", lambda _: _PAGE.xml(), _text(TAGS), _xml_bomb),
    "calibration": Format(
        ".cal", _of(lambda: list(content.CALIBRATION.values())), _text(KEYS + TAGS + CELLS), _CALIBRATION_BOMBS
    ),
    "table": Format(".csv", _of(lambda: content.TABLES), _text(CELLS), _csv_bomb),
    "forms": Format(".txt", _one(content.texts, 14), _bytes((0.7, _with_cells), kept=0), _drawn(_forms_bomb)),
    "lvm": Format(".lvm", _one(content.lvm, 6), _bytes((0.7, _with_cells), kept=19), _drawn(_lvm_bomb)),
    "excel": Format(".xlsx", _one(content.excel, 6), _WORKBOOK, _drawn(_excel_bomb)),
    "xlsm": Format(".xlsm", _one(content.xlsm, 3), _WORKBOOK, _drawn(_excel_bomb)),
    "xls": Format(".xls", _one(content.xls, 6), _bytes(), _drawn(_xls_bomb)),
    "npy": Format(".npy", _one(content.npy, 6), _bytes(), _drawn(_npy_of_a_huge_shape)),
    "npz": Format(
        ".npz", _one(content.npz, 6), _bytes((0.5, _with_members(0.6)), kept=4),
        _drawn(_npz_of_zeros, _npz_that_states_little),
    ),
    "matlab": Format(
        ".mat", _one(content.matlab, 6), _bytes((0.5, _changed_elements), kept=4), _drawn(_matlab_bomb)
    ),
    "matlab73": Format(".mat", _one(content.matlab73, 6), _bytes(kept=512), _drawn(_matlab73_bomb)),
    "hdf5": Format(".h5", _one(content.hdf5, 6), _bytes(), _drawn(_hdf5_bomb)),
    "tdms": Format(".tdms", _one(content.tdms, 6), _bytes(kept=4), _drawn(_tdms_bomb)),
    "records": Format(".jsonl", _one(content.records, 6), _bytes((0.7, _with_json)), _drawn(_records_bomb)),
    "ros1": Format(".bag", _one(content.ros1, 6), _bytes(kept=13), _drawn(_ros1_bomb)),
    "jpk": Format(
        ".jpk-force", _one(content.jpk, 6), _bytes((0.5, _with_members(0.6)), kept=4), _drawn(_jpk_bomb)
    ),
    "igor": Format(".ibw", _one(content.igor, 6), _bytes(kept=2), _drawn(_igor_bomb)),
    "nanosurf": Format(".nid", _one(content.nanosurf, 6), _bytes(kept=9), _drawn(_nanosurf_bomb)),
}  # fmt: skip
BAG = "bag"  # a folder, for which the three functions here have ways of their own


def ending_of(kind: str) -> str:
    """The ending of a file of a format."""
    return "" if kind == BAG else FORMATS[kind].ending


def valid(kind: str, folder: Path) -> Path:
    """A valid file of a format."""
    if kind == BAG:
        return content.bag(folder, "sqlite3", content.database())
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
        return _bag_bomb(folder, chance)
    ending, make = ending_of(kind), FORMATS[kind].bomb
    if isinstance(make, dict):
        ending = chance.choice(list(make))
        make = make[ending]
    path, data = folder / f"x{ending}", make(many, chance)
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return path
