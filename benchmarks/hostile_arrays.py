# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: E501 - the content of hostile files has long lines
"""Files of arrays for ``hostile_files.py``: NumPy, MATLAB, HDF5, TDMS, JSON and ROS 1 bags, changed and as bombs."""

import json
import random
import struct
import tempfile
import warnings
import zipfile
import zlib
from functools import cache
from io import BytesIO
from pathlib import Path

import damaged_files
import numpy as np

from needleforce.errors import InputError
from needleforce.recording.formats.detect import tables_of

ENDINGS = {"npy": ".npy", "npz": ".npz", "matlab": ".mat", "matlab73": ".mat", "hdf5": ".h5", "tdms": ".tdms", "records": ".jsonl",
           "ros1": ".bag", "excel": ".xlsx", "forms": ".txt"}  # fmt: skip
ROWS = 60
_MAX_READ = 200  # columns of a file that are read
TIME = 0.01 * np.arange(ROWS)
DEPTH = np.linspace(-5e-3, 20e-3, ROWS)
FORCE = 40.0 * DEPTH.clip(0.0)


def read_tables(path: Path) -> None:
    """Open the tables of a file, and read their columns."""
    count = 0
    for table in tables_of(path):
        for index in range(len(table.headers)):
            count += 1
            if count > _MAX_READ:
                return
            try:
                table.read_column(index)
            except InputError:
                continue


def content(kind: str, chance: random.Random) -> bytes:
    """A valid content of a format."""
    return _MADE[kind](chance.randrange(_FORMS))


_FORMS = 6


@cache
def _npy(form: int) -> bytes:
    made = BytesIO()
    matrix = np.stack([TIME, DEPTH, FORCE], axis=1)
    fields = [("t", "<f8"), ("F", ">f4"), ("more", [("x", "<i2"), ("y", "<f8", (3,))])]
    arrays = [matrix, np.asfortranarray(matrix), matrix.T.astype(">f4"), np.zeros(ROWS, dtype=fields),
              np.array([{"a": 1}] * ROWS, dtype=object), (1e6 * TIME).astype("m8[us]")]  # fmt: skip
    np.save(made, arrays[form])
    return made.getvalue()


@cache
def _npz(form: int) -> bytes:
    made = BytesIO()
    save = np.savez_compressed if form % 2 else np.savez
    more = {"objects": np.array([None] * ROWS)} if form > 3 else {"matrix": np.zeros((ROWS, 3)), "single": 3.0}
    save(made, time=TIME, depth=DEPTH, force=FORCE.astype(np.float32), **more)
    return made.getvalue()


@cache
def _matlab(form: int) -> bytes:
    from scipy.io import savemat

    runs = np.array([(TIME, FORCE), (TIME[:9], FORCE[:9])], dtype=[("t", object), ("F", object)])
    names = {"units": {"time": "s", "F": "N"}, "time": TIME, "F": FORCE[:, None]}
    variables = {"time": TIME, "M": np.zeros((ROWS, 3)), "run": runs, "s": names, "text": "a", "fs": 100.0}
    if form == 5:
        variables = {"time": TIME, "force": FORCE.astype(np.int16), "M": np.zeros((ROWS, 3), np.float32)}
    made = BytesIO()
    savemat(made, variables, format="4" if form == 5 else "5", do_compression=form % 2 == 1 and form < 5)
    return made.getvalue()


def _h5_bytes(fill, **options) -> bytes:
    import h5py

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "x.h5"
        with h5py.File(path, "w", **options) as file:
            fill(file)
        return path.read_bytes()


@cache
def _hdf5(form: int) -> bytes:
    def fill(file):
        group = file.create_group("run")
        filters = [{}, {"compression": "gzip", "shuffle": True}, {"compression": "lzf"}, {"fletcher32": True, "chunks": (7,)},
                   {"scaleoffset": 6}, {"chunks": (16,), "maxshape": (None,)}][form]  # fmt: skip
        for name, values, unit in (("time", TIME, "s"), ("depth", DEPTH, "m"), ("force", FORCE.astype("<f4"), b"N")):
            group.create_dataset(name, data=values, **filters).attrs["units"] = unit
        matrix = file.create_dataset("matrix", data=np.zeros((ROWS, 3), ">i2"))
        matrix.attrs["columns"] = ["a", "b", "c"]
        file.create_dataset("rows", data=np.zeros(9, dtype=[("t", "f8"), ("text", "S3")]))
        file.attrs["rate"] = 100.0
        file["again"] = group

    return _h5_bytes(fill, libver=("earliest", "latest")[form % 2])


@cache
def _matlab73(form: int) -> bytes:
    import h5py

    def stored(group, name, values, kind="double"):
        made = group.create_dataset(name, data=values, **({"compression": "gzip"} if form % 2 else {}))
        made.attrs["MATLAB_class"] = np.bytes_(kind)
        return made

    def fill(file):
        stored(file, "time", TIME[None, :]), stored(file, "M", np.zeros((3, ROWS)))
        stored(file, "text", np.array([[97], [98]], "<u2"), "char")
        referred = file.create_group("#refs#")
        parts = [stored(referred, name, values[None, :]) for name, values in zip("abcd", (TIME, FORCE, TIME, DEPTH))]
        runs = file.create_group("run")
        runs.attrs["MATLAB_class"] = np.bytes_("struct")
        for name, pair in (("t", parts[:2]), ("F", parts[2:])):
            runs.create_dataset(name, data=np.array([[each.ref] for each in pair], dtype=h5py.ref_dtype))
        cells = np.array([[each.ref for each in parts]], dtype=h5py.ref_dtype)
        file.create_dataset("cells", data=cells).attrs["MATLAB_class"] = np.bytes_("cell")
        if form > 3:
            stored(file, "T", np.zeros(6, "<u4"), "table")

    return b"MATLAB 7.3 MAT-file".ljust(512, b" ") + _h5_bytes(fill, userblock_size=512)[512:]


@cache
def _tdms(form: int) -> bytes:
    from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter

    made = BytesIO()
    even = {"wf_increment": 0.01, "wf_start_offset": 0.0, "unit_string": "N"}
    scaled = {"NI_Number_Of_Scales": 1, "NI_Scale[0]_Scale_Type": "Linear", "NI_Scale[0]_Linear_Slope": 2.0,
              "NI_Scale[0]_Linear_Y_Intercept": 1.0, "NI_Scale[0]_Linear_Input_Source": 0xFFFFFFFF,
              "NI_Scaling_Status": "unscaled"}  # fmt: skip
    with TdmsWriter(made) as writer:
        for part in range(1 + form % 3):
            objects = [ChannelObject("run", "force", FORCE, even if form < 3 else scaled)]
            objects += [ChannelObject("run", "depth", (1e6 * DEPTH).astype(np.int16), {"unit_string": "um"})]
            objects += [ChannelObject("other", "text", ["a"] * 5)] if form > 3 else []
            if part == 0:
                objects = [RootObject({"title": "a"}), GroupObject("run", {"rate": 100.0}), *objects]
            writer.write_segment(objects)
    return made.getvalue()


@cache
def _records(form: int) -> bytes:
    rows = [
        {"t": t, "q": [d, 0.0], "w": {"fz": f, "name": "a"}}
        for t, d, f in zip(*map(np.ndarray.tolist, (TIME, DEPTH, FORCE)))
    ]
    lists = {
        "time": TIME.tolist(),
        "run": {"force": FORCE.tolist(), "M": np.zeros((9, 3)).tolist()},
        "units": {"time": "s"},
    }
    texts = ["\n".join(map(json.dumps, rows)), json.dumps(rows), json.dumps(lists), json.dumps(lists, indent=1),
             json.dumps({"columns": ["t"], "data": [[t] for t in TIME.tolist()]}), json.dumps({"t": dict(enumerate(TIME.tolist()))})]  # fmt: skip
    return texts[form].encode()


@cache
def _ros1(form: int) -> bytes:
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    types = store.types
    vector, wrench = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Wrench"]
    with tempfile.TemporaryDirectory() as folder:
        writer = Writer(Path(folder) / "x.bag")
        if form % 3:
            writer.set_compression((Writer.CompressionFormat.BZ2, Writer.CompressionFormat.LZ4)[form % 3 - 1])
        with writer:
            names = {"/w": "geometry_msgs/msg/WrenchStamped", "/j": "sensor_msgs/msg/JointState"}
            topics = {topic: writer.add_connection(topic, name, typestore=store) for topic, name in names.items()}
            for number in range(ROWS):
                at = damaged_files.START + number * 10_000_000
                head = types["std_msgs/msg/Header"](
                    number, types["builtin_interfaces/msg/Time"](at // 10**9, at % 10**9), "f"
                )
                force = types[names["/w"]](head, wrench(vector(0.0, 0.0, FORCE[number]), vector(0.0, 0.0, 0.0)))
                state = types[names["/j"]](head, ["z"], DEPTH[number : number + 1], np.empty(0), np.empty(0))
                for topic, message in (("/w", force), ("/j", state)):
                    writer.write(topics[topic], at, store.serialize_ros1(message, names[topic]))
        return (Path(folder) / "x.bag").read_bytes()


@cache
def _excel(form: int) -> bytes:
    import datetime

    import openpyxl

    book = openpyxl.Workbook()
    rows = [("Time [s]", "Depth [mm]", "Force [N]"), *zip(TIME.tolist(), (1e3 * DEPTH).tolist(), FORCE.tolist())]
    for sheet in [book.active, *(book.create_sheet(f"s{k}") for k in range(form % 3))]:
        if form == 3:
            sheet.append(("Specimen", "x", datetime.datetime(2026, 1, 2)))
        for k, row in enumerate(rows):
            sheet.append((row[0], row[1], f"=B{k}*2") if form == 4 and k else row)
    if form == 5:
        book.active.merge_cells("A1:C1")
        book.create_chartsheet("c")
    made = BytesIO()
    book.save(made)
    return made.getvalue()


@cache
def _forms(form: int) -> bytes:
    """Text as instruments write it."""
    rows = "\n".join(f"{t:.3f}\t{1e3 * d:.4f}\t{f:.5f}" for t, d, f in zip(TIME, DEPTH, FORCE)) + "\n"
    block = "<INFO>\nDate:\t1.2.2026\n<DATA>\nTime, s\tPosition (z), mm\tFz, gf\n" + rows
    forms = [
        block + "<END DATA>\n" + block,
        'Test : 1,"10.0",mm/min\n\nTime,Extension,Load\n(s),(mm),(N)\n'
        + '"'
        + rows.replace("\t", '","').replace("\n", '"\n"')[:-1],
        rows,
        ("Zeit;Weg;Kraft\ns;mm;N\n" + rows.replace("\t", ";").replace(".", ",")),
        "Time\tPd\tFn\n" + "\n".join(f"12:00:{row}" for row in rows.splitlines()),
        "\n".join("\t".join([line] * 3) for line in ("Time (s)\tz (mm)\tF (N)\n" + rows).splitlines()),
    ]
    return forms[form].encode("utf-16" if form == 3 else "utf-8")


_MADE = {"excel": _excel, "forms": _forms, "npy": _npy, "npz": _npz, "matlab": _matlab, "matlab73": _matlab73, "hdf5": _hdf5, "tdms": _tdms, "records": _records,
         "ros1": _ros1}  # fmt: skip
_CELLS = [b"\n", b"\r", b"\t", b";", b",", b"|", b"  ", b'"', b"#", b"# ", b"#N/A", b"--", b"OVER", b"12:30:01", b"1.234,5", b"1,234.5", b"(N)",
          b"Time", b"Force", b"Zeit;Weg", b"\n\n\n", b"nan", b"1e999", b"-1e308", b"9" * 400, b"a" * 300, b"\0", b"\xff\xfe", b"\xef\xbb\xbf",
          b"\n<DATA>\n", b"2026-01-02T03:04:05", b"99:99:99", b"1:1:1:1", b"0:0", b"=1+1", b"-", b"mm", b"\t" * 2000]  # fmt: skip
_WORDS = [b"null", b"NaN", b"[", b"]", b"{", b"}", b'"', b"1e999", b"9" * 400, b"-", b"\0", b"[" * 5000, b'{"a":' * 3000, b"true", b",",
          b"\n", b"\\ud800", b'"x"', b"[[1,2],[3]]"]  # fmt: skip


def changed(kind: str, chance: random.Random) -> bytes:
    """A valid content with changes, also of what is compressed in it."""
    data = content(kind, chance)
    if kind == "forms" and chance.random() < 0.7:
        return _with_cells(data, chance)
    if kind in ("npz", "excel") and chance.random() < 0.5:
        return _changed_members(data, chance, 0.6 if kind == "npz" else 0.02)
    if kind == "matlab" and chance.random() < 0.5:
        return _changed_elements(data, chance)
    if kind == "records" and chance.random() < 0.7:
        for _ in range(chance.choice([1, 1, 2, 4])):
            at = chance.randrange(len(data))
            data = data[:at] + chance.choice(_WORDS) + data[at + chance.choice([0, 1, 5]) :]
        return data
    keep = (
        {"matlab73": 512, "tdms": 4, "npy": 8, "npz": 4, "ros1": 13, "matlab": 4}.get(kind, 8)
        if chance.random() < 0.9
        else 0
    )
    changed = _overwritten(data, chance) if chance.random() < 0.6 else damaged_files.damaged(data, chance)
    return data[:keep] + changed[keep:]


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
            part = part[:8] + damaged_files.damaged(part, chance)[8:] if chance.random() < 0.5 else part
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
    with zipfile.ZipFile(BytesIO(_excel(0))) as archive, zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as new:
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
    return _matlab(0)[:128] + struct.pack("<II", 15, len(packed)) + packed * chance.choice([1, 1, 3])


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

    return _h5_bytes(chance.choice([zeros, unwritten, chunk, twice, groups, deep, virtual, external, texts]))


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

    return b"MATLAB 7.3 MAT-file".ljust(512, b" ") + _h5_bytes(fill, userblock_size=512)[512:]


def _tdms_bomb(chance: random.Random) -> bytes:
    data = bytearray(_tdms(chance.randrange(_FORMS)))
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
    data = bytearray(_ros1(chance.randrange(3)))
    field = chance.choice([b"conn_count=", b"chunk_count=", b"index_pos=", b"count=", b"chunk_pos=", b"conn="])
    places = [at for at in range(len(data)) if data.startswith(field, at)]
    for at in places[: chance.choice([1, 100])]:
        data[at + len(field) : at + len(field) + 4] = struct.pack("<I", chance.choice([2**32 - 1, 10**6, 0, 1, 4117]))
    return bytes(data)


_BOMBS = {"excel": [_excel_bomb], "forms": [_forms_bomb], "npy": [_npy_of_a_huge_shape], "npz": [_npz_of_zeros, _npz_that_states_little], "matlab": [_matlab_bomb],
          "matlab73": [_matlab73_bomb], "hdf5": [_hdf5_bomb], "tdms": [_tdms_bomb], "records": [_records_bomb], "ros1": [_ros1_bomb]}  # fmt: skip
