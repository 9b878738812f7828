# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: E501 - the content of hostile files has long lines
"""Files that take far more to read than to store, of every format, for ``hostile_changes.py``."""

import random
import re
import struct
import zipfile
import zlib
from io import BytesIO
from pathlib import Path

import hostile_content as content
import log_files
import numpy as np
from mcap.data_stream import RecordBuilder
from mcap.records import Chunk

from needleforce.files import MCAP
from needleforce.recording.log import ros_messages


def csv_bomb(many: int, chance: random.Random) -> str:
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


def json_bomb(many: int, chance: random.Random) -> str:
    forms = ["[" * many, '{"a":' * many, "[" + "[]," * many + "0]", "9" * many, '"' + "\\u0000" * many + '"']
    return chance.choice(forms)


def parquet_of_zeros(many: int, chance: random.Random) -> bytes:
    """Values that take no space."""
    names = ("time_s", "depth_m", "force_N", "fx_N", "fy_N", "tx_N_m")
    return content.parquet_of(dict.fromkeys(names, np.zeros(20 * many)), compression="zstd")


def parquet_with_a_huge_page(many: int, chance: random.Random) -> bytes:
    """The sizes in the page headers are replaced by larger ones of as many bytes."""
    data = bytearray(content.parquet("zstd"))
    at = data.find(b"\x15", 4, 40)
    data[at + 2 : at + 6] = b"\x15\xfe\xff\xff"
    return bytes(data)


def parquet_of_columns(many: int, chance: random.Random) -> bytes:
    return content.parquet_of({f"c{k}": np.zeros(2) for k in range(min(many, 20_000) // 4)})


def _chunk(data: bytes, compression: str, size: int) -> bytes:
    builder = RecordBuilder()
    times = {"message_start_time": 0, "message_end_time": 0}
    Chunk(compression=compression, data=data, uncompressed_crc=0, uncompressed_size=size, **times).write(builder)
    return builder.end()


def mcap_bomb(many: int, chance: random.Random) -> bytes:
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


def bag_bomb(folder: Path, chance: random.Random) -> Path:
    match chance.randrange(5):
        case 0:
            return log_files.bag(folder, "sqlite3", log_files.database(views=True))
        case 1:
            return log_files.bag(folder, "mcap", mcap_bomb(0, chance))
        case 2:
            levels = "".join(f"l{k}: &l{k} {{<<: [*l{k - 1}, *l{k - 1}]}}\n" for k in range(1, 40))
            return log_files.bag(folder, "mcap", MCAP, b"l0: &l0 {a: 1}\n" + levels.encode())
        case 3:
            return log_files.bag(folder, "mcap", MCAP, b"[" * chance.choice([1000, 10**5, 10**6]))
    made = log_files.METADATA.format(storage="mcap", name="bag.mcap.zstd")
    for word, other in (("mode", "FILE"), ("format", "zstd")):
        made = made.replace(f"compression_{word}: ''", f"compression_{word}: {other}")
    return log_files.bag(folder, "mcap", MCAP, made.encode())


def toml_bomb(many: int, chance: random.Random) -> str:
    many //= 2
    forms = ["a" + ".a" * many + " = 1", "[a" + ".a" * many + "]", "a = " + "[" * many, "a = " + "{a=" * many, "a = " + "9" * many,
             "a = 0x" + "f" * many, "a = [" + "[]," * (many // 2) + "]", "a = [" + "{}," * (many // 2) + "]", "[[a]]\n" * (many // 6),
             'a = """' + "\\" * many, "a" * many + " = 1", "".join(f"k{k} = 1\n" for k in range(many // 10)), "a = 1" + " " * many,
             'a={b="""x"""", ' + "a." * many + "a=1}", "\n" * many, "a = 1e" + "9" * many, "#" * many]  # fmt: skip
    return chance.choice(forms)


def xml_bomb(many: int, chance: random.Random) -> str:
    laughs = "".join(f'<!ENTITY l{k} "{f"&l{k - 1};" * 10}">' for k in range(1, 12))
    forms = ["<a>" * many, "<a" + ' b="c"' * (many // 6) + "/>", f'<!DOCTYPE a [<!ENTITY l0 "x">{laughs}]><a>&l11;</a>', "<a>" + "&#65;" * (many // 5) + "</a>",
             "<a><!--" + "-" * many, "<a>" + "<b/>" * (many // 4) + "</a>", "<" + "a" * many + "/>"]  # fmt: skip
    return chance.choice(forms)


def npy_of_a_huge_shape(many: int, chance: random.Random) -> bytes:
    shape = chance.choice(
        ["(1000000000000,)", "(2000000000, 3)", "(99999999999999999999, 2)", "(-5, 2)", "(1,) * 99", "(" * 5000]
    )
    head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".encode()
    return b"\x93NUMPY\1\0" + struct.pack("<H", len(head)) + head + bytes(800)


def npz_of_zeros(many: int, chance: random.Random) -> bytes:
    made = BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name in ("time", "depth", "force"):
            one = BytesIO()
            np.save(one, np.zeros(chance.choice([10**6, 2 * 10**7])))
            archive.writestr(f"{name}.npy", one.getvalue())
    return made.getvalue()


def npz_that_states_little(many: int, chance: random.Random) -> bytes:
    data = bytearray(npz_of_zeros(many, chance))
    at = data.rfind(b"PK\1\2")
    data[at + 24 : at + 28] = struct.pack("<I", chance.choice([0, 128, 1000, 2**32 - 1]))
    return bytes(data)


def excel_bomb(many: int, chance: random.Random) -> bytes:
    head = b'<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><sheetData>'
    end = b"</sheetData></worksheet>"
    sheets = [
        lambda: bytes(400 << 20),
        lambda: (
            head + b'<row r="1"><c r="A1"><v>1</v></c></row><row r="1048576"><c r="XFD1048576"><v>1</v></c></row>' + end
        ),
        lambda: (
            b'<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>'
            + head
            + b"&b;" * 1000
            + end
        ),
        lambda: head + b'<row r="1"><c r="A1"><v>1</v></c></row>' * 10**6 + end,
        lambda: head + b"<row>" * 100_000,
    ]
    sheet = chance.choice(sheets)()
    return content.zipped_again(
        content.excel(0), lambda name, part: (name, sheet if name.endswith("sheet1.xml") else part)
    )


def forms_bomb(many: int, chance: random.Random) -> bytes:
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


def lvm_bomb(many: int, chance: random.Random) -> bytes:
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


def xls_bomb(many: int, chance: random.Random) -> bytes:
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


def matlab_bomb(many: int, chance: random.Random) -> bytes:
    empty = _element(14, b"")

    def within() -> bytes:
        inner = empty
        for _ in range(5000):
            inner = _matrix(1, (1, 1), inner)
        return inner

    forms = [
        lambda: _matrix(6, (20_000_000, 1), _element(9, bytes(160_000_000))),
        lambda: _matrix(1, (10**6, 1), empty * 10**6),
        lambda: _matrix(1, (2**31 - 1, 2**31 - 1), empty),
        lambda: _matrix(2, (2**20, 2**11), _element(5, struct.pack("<i", 8)), _element(1, b"a".ljust(8, b"\0"))),
        lambda: _matrix(2, (2**30, 1), _element(5, struct.pack("<i", 0)), _element(1, b"")),
        lambda: _matrix(4, (10**8, 1), _element(16, bytes(10**8))),
        lambda: _matrix(5, (2**30, 2**30), _element(5, bytes(8)), _element(5, bytes(8)), _element(9, bytes(8))),
        within,
    ]
    packed = zlib.compress(chance.choice(forms)(), 1)
    return content.matlab(0)[:128] + struct.pack("<II", 15, len(packed)) + packed * chance.choice([1, 1, 3])


def hdf5_bomb(many: int, chance: random.Random) -> bytes:
    import h5py

    def zeros(file):
        for name in ("time", "force"):
            file.create_dataset(name, data=np.zeros(20_000_000), compression="gzip", chunks=(1_000_000,))

    def unwritten(file):
        file.create_dataset("time", shape=(10**11,), dtype="f8", chunks=(10**6,), compression="gzip")

    def chunk(file):  # which unpacks to more than it may
        made = file.create_dataset("time", shape=(1000,), dtype="f8", chunks=(1000,), compression="gzip")
        made.id.write_direct_chunk((0,), zlib.compress(bytes(200_000_000), 1))

    def twice(file):
        plan = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        plan.set_chunk((1000,)), plan.set_deflate(9), plan.set_deflate(9)
        made = h5py.h5d.create(file.id, b"time", h5py.h5t.NATIVE_DOUBLE, h5py.h5s.create_simple((1000,)), plan)
        made.write_direct_chunk((0,), zlib.compress(zlib.compress(bytes(200_000_000), 1)))

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


def matlab73_bomb(many: int, chance: random.Random) -> bytes:
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


def tdms_bomb(many: int, chance: random.Random) -> bytes:
    data = bytearray(content.tdms(chance.randrange(6)))
    at = data.find(struct.pack("<Q", content.ROWS))  # the number of values of a channel
    data[at : at + 8] = struct.pack("<Q", chance.choice([2**62, 2**40, 2**32, 10**9, 2**64 - 1]))
    return bytes(data) * chance.choice([1, 1, 200, 5000])


def records_bomb(many: int, chance: random.Random) -> bytes:
    many = chance.choice([10**4, 10**5, 10**6])
    forms = ["[{" + '"a":[' * many, '{"a":' * many, '{"a":[' + "[]," * many + "0]}", '{"a":1}\n' * 2 + '{"a":[' + "1," * many + "1]}",
             "{}\n" * many, '{"a":' + "9" * many + "}", "".join(f'{{"k{k}":1}}\n' for k in range(min(many, 10**5))),
             "".join(f'{{"k{k % 1000}":1}}\n' for k in range(many)), "[" + ",".join(['{"a":{}}'] * many) + "]",
             "{" + ",".join(f'"k{k}":[1,2]' for k in range(min(many, 10**5))) + "}",
             "{" + ",".join(f'"k{k}":[{"1," * (k + 2)}1]' for k in range(min(many, 5000))) + "}"]  # fmt: skip
    return chance.choice(forms).encode()


def ros1_bomb(many: int, chance: random.Random) -> bytes:
    data = bytearray(log_files.ros1(chance.randrange(3)))
    field = chance.choice([b"conn_count=", b"chunk_count=", b"index_pos=", b"count=", b"chunk_pos=", b"conn="])
    places = [at for at in range(len(data)) if data.startswith(field, at)]
    for at in places[: chance.choice([1, 100])]:
        data[at + len(field) : at + len(field) + 4] = struct.pack("<I", chance.choice([2**32 - 1, 10**6, 0, 1, 4117]))
    return bytes(data)


def jpk_bomb(many: int, chance: random.Random) -> bytes:
    """Samples without end, or as many as the header states."""
    zeros = chance.choice([10**6, 2 * 10**8])

    def changed(name: str, part: bytes) -> tuple[str, bytes]:
        part = part.replace(b"num-points=400", b"num-points=%d" % chance.choice([400, 10**12]))
        return name, bytes(zeros) if name.endswith("1/channels/vDeflection.dat") else part

    return content.zipped_again(content.jpk(1), changed)


def igor_bomb(many: int, chance: random.Random) -> bytes:
    """A wave with more samples than the file has bytes, and a checksum that fits."""
    count = chance.choice([10**6, 2**31 - 1, -5])
    data = bytearray(content.igor(0))
    data[64 + 12 : 64 + 16] = data[64 + 68 : 64 + 72] = struct.pack("<i", count)
    data[2:4] = bytes(2)
    words = int(np.frombuffer(bytes(data[:384]), "<i2").astype(int).sum())
    data[2:4] = np.array(-words).astype("<i2").tobytes()
    return bytes(data)


def nanosurf_bomb(many: int, chance: random.Random) -> bytes:
    what = chance.choice([b"Points", b"Lines", b"SaveBits", b"GroupCount"])
    number = b"%d" % chance.choice([10**5, 10**9, 10**30, -1])
    return re.sub(rb"\n" + what + rb"=\d+", b"\n" + what + b"=" + number, content.nanosurf(0))
