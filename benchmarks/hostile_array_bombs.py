# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: E501 - the content of hostile files has long lines
"""Files of arrays and tables for ``hostile_files.py`` that take far more to read than to store."""

import random
import re
import struct
import zipfile
import zlib
from io import BytesIO

import hostile_arrays
import hostile_tables
import numpy as np
from hostile_arrays import h5_bytes
from hostile_tables import ROWS, TIME


def bomb(kind: str, chance: random.Random) -> bytes:
    """A content that takes far more to read than to store."""
    return chance.choice(_BOMBS[kind])(chance)


def _npy_of_a_huge_shape(chance: random.Random) -> bytes:
    shape = chance.choice(
        ["(1000000000000,)", "(2000000000, 3)", "(99999999999999999999, 2)", "(-5, 2)", "(1,) * 99", "(" * 5000]
    )
    head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".encode()
    return b"\x93NUMPY\1\0" + struct.pack("<H", len(head)) + head + bytes(800)


def _npz_of_zeros(chance: random.Random) -> bytes:
    made = BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in ("time", "depth", "force"):
            one = BytesIO()
            np.save(one, np.zeros(chance.choice([10**6, 2 * 10**7])))
            archive.writestr(f"{name}.npy", one.getvalue())
    return made.getvalue()


def _npz_that_states_little(chance: random.Random) -> bytes:
    data = bytearray(_npz_of_zeros(chance))
    at = data.rfind(b"PK\1\2")
    data[at + 24 : at + 28] = struct.pack("<I", chance.choice([0, 128, 1000, 2**32 - 1]))
    return bytes(data)


def _workbook(sheet: bytes, chance: random.Random) -> bytes:
    """A workbook whose first sheet has another content."""
    made = BytesIO()
    with (
        zipfile.ZipFile(BytesIO(hostile_tables.content("excel", 0))) as archive,
        zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as new,
    ):
        for name in archive.namelist():
            new.writestr(name, sheet if name.endswith("sheet1.xml") else archive.read(name))
    return made.getvalue()


def _excel_bomb(chance: random.Random) -> bytes:
    head = b'<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><sheetData>'
    end = b"</sheetData></worksheet>"
    sheets = [
        bytes(400 << 20),
        head + b'<row r="1"><c r="A1"><v>1</v></c></row><row r="1048576"><c r="XFD1048576"><v>1</v></c></row>' + end,
        b'<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>' + head + b"&b;" * 1000 + end,
        head + b'<row r="1"><c r="A1"><v>1</v></c></row>' * 10**6 + end,
        head + b"<row>" * 100_000,
    ]
    return _workbook(chance.choice(sheets), chance)


def _forms_bomb(chance: random.Random) -> bytes:
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


def _lvm_bomb(chance: random.Random) -> bytes:
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


def _xls_bomb(chance: random.Random) -> bytes:
    """Cells far apart, and sizes in the compound file that lie."""
    data = bytearray(hostile_tables.content("xls", 0))
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


def _matlab_bomb(chance: random.Random) -> bytes:
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
    return (
        hostile_arrays.content("matlab", 0)[:128]
        + struct.pack("<II", 15, len(packed))
        + packed * chance.choice([1, 1, 3])
    )


def _hdf5_bomb(chance: random.Random) -> bytes:
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
        file.create_group("/".join("a" * 500)).create_dataset("time", data=TIME)

    def virtual(file):
        layout = h5py.VirtualLayout(shape=(100,), dtype="f8")
        layout[:] = h5py.VirtualSource("/etc/passwd", "time", shape=(100,))
        file.create_virtual_dataset("time", layout)

    def external(file):
        file.create_dataset("time", shape=(100,), dtype="u1", external=[("/etc/passwd", 0, 100)])

    def texts(file):
        file.create_dataset("time", data=["a" * 1000] * 10_000, compression="gzip")

    return h5_bytes(chance.choice([zeros, unwritten, chunk, twice, groups, deep, virtual, external, texts]))


def _matlab73_bomb(chance: random.Random) -> bytes:
    import h5py

    def fill(file):
        group = file.create_group("#refs#")
        target = group.create_dataset("a", data=TIME[None, :])
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

    return b"MATLAB 7.3 MAT-file".ljust(512, b" ") + h5_bytes(fill, userblock_size=512)[512:]


def _tdms_bomb(chance: random.Random) -> bytes:
    data = bytearray(hostile_arrays.content("tdms", chance.randrange(hostile_arrays.N_FORMS)))
    at = data.find(struct.pack("<Q", ROWS))  # the number of values of a channel
    data[at : at + 8] = struct.pack("<Q", chance.choice([2**62, 2**40, 2**32, 10**9, 2**64 - 1]))
    return bytes(data) * chance.choice([1, 1, 200, 5000])


def _records_bomb(chance: random.Random) -> bytes:
    many = chance.choice([10**4, 10**5, 10**6])
    forms = ["[{" + '"a":[' * many, '{"a":' * many, '{"a":[' + "[]," * many + "0]}", '{"a":1}\n' * 2 + '{"a":[' + "1," * many + "1]}",
             "{}\n" * many, '{"a":' + "9" * many + "}", "".join(f'{{"k{k}":1}}\n' for k in range(min(many, 10**5))),
             "".join(f'{{"k{k % 1000}":1}}\n' for k in range(many)), "[" + ",".join(['{"a":{}}'] * many) + "]",
             "{" + ",".join(f'"k{k}":[1,2]' for k in range(min(many, 10**5))) + "}",
             "{" + ",".join(f'"k{k}":[{"1," * (k + 2)}1]' for k in range(min(many, 5000))) + "}"]  # fmt: skip
    return chance.choice(forms).encode()


def _ros1_bomb(chance: random.Random) -> bytes:
    data = bytearray(hostile_arrays.content("ros1", chance.randrange(3)))
    field = chance.choice([b"conn_count=", b"chunk_count=", b"index_pos=", b"count=", b"chunk_pos=", b"conn="])
    places = [at for at in range(len(data)) if data.startswith(field, at)]
    for at in places[: chance.choice([1, 100])]:
        data[at + len(field) : at + len(field) + 4] = struct.pack("<I", chance.choice([2**32 - 1, 10**6, 0, 1, 4117]))
    return bytes(data)


def _jpk_bomb(chance: random.Random) -> bytes:
    """Samples without end, or as many as the header states."""
    made, zeros = BytesIO(), chance.choice([10**6, 2 * 10**8])
    with (
        zipfile.ZipFile(BytesIO(hostile_arrays.content("jpk", 1))) as archive,
        zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as new,
    ):
        for name in archive.namelist():
            part = archive.read(name).replace(b"num-points=400", b"num-points=%d" % chance.choice([400, 10**12]))
            new.writestr(name, bytes(zeros) if name.endswith("1/channels/vDeflection.dat") else part)
    return made.getvalue()


def _igor_bomb(chance: random.Random) -> bytes:
    """A wave with more samples than the file has bytes, and a checksum that fits."""
    count = chance.choice([10**6, 2**31 - 1, -5])
    data = bytearray(hostile_arrays.content("igor", 0))
    data[64 + 12 : 64 + 16] = data[64 + 68 : 64 + 72] = struct.pack("<i", count)
    data[2:4] = bytes(2)
    words = int(np.frombuffer(bytes(data[:384]), "<i2").astype(int).sum())
    data[2:4] = np.array(-words).astype("<i2").tobytes()
    return bytes(data)


def _nanosurf_bomb(chance: random.Random) -> bytes:
    what = chance.choice([b"Points", b"Lines", b"SaveBits", b"GroupCount"])
    number = b"%d" % chance.choice([10**5, 10**9, 10**30, -1])
    return re.sub(rb"\n" + what + rb"=\d+", b"\n" + what + b"=" + number, hostile_arrays.content("nanosurf", 0))


_BOMBS = {"jpk": [_jpk_bomb], "igor": [_igor_bomb], "nanosurf": [_nanosurf_bomb], "excel": [_excel_bomb], "xlsm": [_excel_bomb], "xls": [_xls_bomb], "lvm": [_lvm_bomb], "forms": [_forms_bomb], "npy": [_npy_of_a_huge_shape], "npz": [_npz_of_zeros, _npz_that_states_little], "matlab": [_matlab_bomb],
          "matlab73": [_matlab73_bomb], "hdf5": [_hdf5_bomb], "tdms": [_tdms_bomb], "records": [_records_bomb], "ros1": [_ros1_bomb]}  # fmt: skip
