# SPDX-License-Identifier: Apache-2.0
"""MATLAB 4, 5 and 7.3 files as tables: written by scipy, and as MATLAB lays out what scipy does not write."""

import struct
import sys
import zlib

import numpy as np
import pytest
from scipy.io import loadmat, savemat

from needleforce.errors import InputError
from needleforce.recording.formats.detect import format_of, tables_of

TIME = np.arange(50) * 0.02
FORCE = np.sin(TIME)


def by_name(path):
    return {table.name: table for table in tables_of(path)}


def columns(table):
    return {header: table.read_column(index) for index, header in enumerate(table.headers)}


@pytest.mark.parametrize("compressed", [True, False])
def test_vectors_matrices_and_structs(tmp_path, compressed):
    runs = np.array([(TIME, FORCE), (TIME[:20], 2 * FORCE[:20])], dtype=[("t", object), ("F", object)])
    units = {"Weg": "mm", "Kraft": "mN"}
    struct_ = {
        "Weg": TIME[None, :],
        "Kraft": (1e3 * FORCE).astype(np.int16)[:, None],
        "units": units,
        "deep": {"a": TIME[:5]},
    }
    parts = np.array([TIME[:7], FORCE[:7], None], dtype=object)[:2]
    variables = {"time": TIME, "force": FORCE.astype(np.float32)[:, None], "fs": 50.0, "who": "A. N.", "s": struct_,
                 "M": np.arange(30.0).reshape(10, 3), "run": runs, "parts": parts}  # fmt: skip
    savemat(tmp_path / "x.mat", variables, do_compression=compressed)
    assert format_of(tmp_path / "x.mat").name == "MATLAB 5"
    found = by_name(tmp_path / "x.mat")
    assert list(found) == ["(50 rows)", "(7 rows)", "M", "s", "s.deep", "run(1)", "run(2)"]
    alone = loadmat(tmp_path / "x.mat")
    main = columns(found["(50 rows)"])
    assert (main["time"] == alone["time"].ravel()).all() and (main["force"] == FORCE.astype("f4")).all()
    assert (0, "fs: 50.0") in found["(50 rows)"].comments and (0, "who: A. N.") in found["s"].comments
    assert list(columns(found["M"])) == ["M(:,1)", "M(:,2)", "M(:,3)"]
    assert (columns(found["M"])["M(:,2)"] == np.arange(1.0, 30.0, 3.0)).all()
    assert dict(zip(found["s"].headers, found["s"].units)) == units
    assert (columns(found["s"])["Kraft"] == (1e3 * FORCE).astype(np.int16)).all()
    assert (columns(found["run(2)"])["F"] == 2 * FORCE[:20]).all()
    assert list(columns(found["(7 rows)"])) == ["parts{1}", "parts{2}"]


def test_a_matrix_of_rows_and_a_matrix_next_to_its_time(tmp_path):
    savemat(tmp_path / "x.mat", {"t": TIME, "data": np.stack([TIME, FORCE])})
    (table,) = tables_of(tmp_path / "x.mat")
    assert table.headers == ["t", "data(:,1)", "data(:,2)"] and (table.read_column(2) == FORCE).all()


def test_signals_with_labels_belong_to_the_time_next_to_them(tmp_path):
    """Simulink's structure with time; without labels the signals have numbers."""
    signals = np.zeros((1, 3), [(name, object) for name in ("values", "dimensions", "label")])
    for k, (values, label) in enumerate([(FORCE, "Fz [N]"), (2 * FORCE, "x [m]"), (np.stack([FORCE, TIME], 1), "")]):
        signals[0, k] = (values.reshape(len(TIME), -1), 1.0, label)
    savemat(tmp_path / "x.mat", {"out": {"time": TIME[:, None], "signals": signals, "blockName": "rig/Scope"}})
    (table,) = tables_of(tmp_path / "x.mat")
    assert table.headers == ["time", "Fz [N]", "x [m]", "signals(3)(:,1)", "signals(3)(:,2)"]
    for index, values in enumerate([TIME, FORCE, 2 * FORCE, FORCE, TIME]):
        np.testing.assert_array_equal(table.read_column(index), values)


@pytest.mark.parametrize("kind", ["f8", "f4", "i4", "i2", "u2", "u1", ">f8"])
def test_version_4(tmp_path, kind):
    values = np.arange(50, dtype=kind)
    savemat(tmp_path / "x.mat", {"time": values, "force": 2 * values[:, None]}, format="4")
    assert format_of(tmp_path / "x.mat").name == "MATLAB 4"
    (table,) = tables_of(tmp_path / "x.mat")
    assert table.headers == ["time", "force"] and (table.read_column(1) == 2.0 * np.arange(50)).all()


def test_version_4_of_a_big_endian_computer(tmp_path):
    def array(name, values):
        head = struct.pack(">5I", 1000, len(values), 1, 0, len(name) + 1)  # type 1000: big endian, doubles, full
        return head + name + b"\0" + np.asarray(values, ">f8").tobytes()

    (tmp_path / "x.mat").write_bytes(array(b"time", TIME) + array(b"force", FORCE))
    (table,) = tables_of(tmp_path / "x.mat")
    assert (table.read_column(1) == FORCE).all()


def element(kind, data):
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def matrix(matlab_class, *parts):
    return element(14, element(6, struct.pack("<II", matlab_class, 0)) + b"".join(parts))


def mat(*elements, compressed=False):
    head = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H2s", 0x100, b"IM")
    if compressed:
        elements = [struct.pack("<II", 15, len(packed)) + packed for packed in map(zlib.compress, elements)]
    return head + b"".join(elements)


def doubles(name, values):
    return matrix(6, element(5, struct.pack("<2i", len(values), 1)), element(1, name), element(9, values.tobytes()))


def opaque(name, kind):
    """A MATLAB object, as version 7 writes it: class 17, its name, the system that made it, its class, its content."""
    content = matrix(13, element(5, struct.pack("<2i", 1, 1)), element(1, b""), element(6, struct.pack("<I", 1)))
    return matrix(17, element(1, name), element(1, b"MCOS"), element(1, kind), content)


@pytest.mark.parametrize("compressed", [True, False])
@pytest.mark.parametrize(
    "kind, step", [("table", "table2struct"), ("timetable", "timetable2table"), ("timeseries", r"ts\.Time")]
)
def test_objects_are_named_with_the_way_to_export_them(tmp_path, kind, step, compressed):
    (tmp_path / "x.mat").write_bytes(mat(opaque(b"T", kind.encode()), compressed=compressed))
    with pytest.raises(InputError, match=rf"T \(of the MATLAB class {kind}\).*{step}"):
        tables_of(tmp_path / "x.mat")
    parts = doubles(b"time", TIME), opaque(b"T", kind.encode())
    (tmp_path / "x.mat").write_bytes(mat(*parts, compressed=compressed))
    (table,) = tables_of(tmp_path / "x.mat")
    assert table.headers == ["time"] and f"class {kind}" in table.notes[0].message


# made by the test: several are hundreds of megabytes
@pytest.mark.parametrize("content", [
    lambda: matrix(6, element(5, struct.pack("<2i", 20_000_000, 2)), element(1, b"x"), element(9, bytes(320_000_000))),
    lambda: matrix(1, element(5, struct.pack("<2i", 10**6, 1)), element(1, b"x"), element(14, b"") * 10**6),
    lambda: matrix(1, element(5, struct.pack("<2i", 2**30, 2**30)), element(1, b"x")),
    lambda: matrix(2, element(5, struct.pack("<2i", 2**30, 1)), element(1, b"x"), element(5, struct.pack("<i", 8)),
                   element(1, b"a" * 8)),
    lambda: matrix(6, element(5, struct.pack("<2i", 9, 1)), element(1, b"x"), element(250, bytes(72))),
    lambda: matrix(99, element(5, struct.pack("<2i", 9, 1)), element(1, b"x"), element(9, bytes(72))),
    lambda: doubles(b"time", TIME).replace(struct.pack("<2I", 6, 8), struct.pack("<2I", 7, 8), 1),
    lambda: doubles(b"time", TIME).replace(struct.pack("<2I", 6, 8), struct.pack("<2I", 6 | 9 << 16, 8), 1),
    lambda: doubles(b"time", TIME) + matrix(6, element(5, b""), element(1, b"F"), element(9, FORCE.tobytes())),
    lambda: struct.pack("<2I", 14, 1 << 24) + doubles(b"time", TIME)[8:] + doubles(b"force", FORCE),
], ids=["zeros", "empty cells", "cells that are not there", "structs that are not there", "type", "class", "no flags",
        "long short element", "no shape", "longer than the file"])  # fmt: skip
def test_what_expands_ends_the_process_or_contradicts_itself_is_refused(tmp_path, content):
    (tmp_path / "x.mat").write_bytes(mat(content(), compressed=True))
    assert (tmp_path / "x.mat").stat().st_size < 1 << 20
    with pytest.raises(InputError, match=r"unpacked size|without a table|not readable as MATLAB|memory is not enough"):
        tables_of(tmp_path / "x.mat")


def test_cells_within_cells_without_end_are_refused(tmp_path):
    content = element(14, b"")
    for _ in range(5000):
        content = matrix(1, element(5, struct.pack("<2i", 1, 1)), element(1, b"x"), content)
    (tmp_path / "x.mat").write_bytes(mat(content, compressed=True))
    with pytest.raises(InputError, match="not readable as MATLAB"):
        tables_of(tmp_path / "x.mat")


@pytest.mark.parametrize("version", ["4", "5", "compressed"])
def test_a_truncated_file_is_refused_or_read_up_to_its_end(tmp_path, version):
    path = tmp_path / "x.mat"
    savemat(path, {"time": TIME, "force": FORCE}, format=version[0] if version != "compressed" else "5",
            do_compression=version == "compressed")  # fmt: skip
    whole = path.read_bytes()
    for size in range(24, len(whole), 53):
        path.write_bytes(whole[:size])
        try:
            found = columns(tables_of(path)[0])
        except InputError:
            continue
        assert set(found) <= {"time", "force"} and all(len(values) == 50 for values in found.values())


h5py = pytest.importorskip("h5py")


class Matlab73:
    """Writes variables as MATLAB 7.3 does: transposed, with their class, and cells as references."""

    def __init__(self, path):
        self.path, self.file, self.count = path, h5py.File(path, "w", userblock_size=512), 0
        self.referred = self.file.create_group("#refs#")

    def array(self, where, name, values, kind="double", **options):
        made = where.create_dataset(name, data=np.atleast_2d(values).T, **options)
        made.attrs["MATLAB_class"] = np.bytes_(kind)
        return made

    def text(self, where, name, text):
        return self.array(where, name, [ord(each) for each in text], "char", dtype="<u2")

    def reference(self, values):
        self.count += 1
        return self.array(self.referred, f"a{self.count}", values).ref

    def cells(self, where, name, references, kind="cell"):
        made = where.create_dataset(name, data=np.array([references], dtype=h5py.ref_dtype))
        if kind:
            made.attrs["MATLAB_class"] = np.bytes_(kind)
        return made

    def group(self, name, kind="struct"):
        made = self.file.create_group(name)
        made.attrs["MATLAB_class"] = np.bytes_(kind)
        return made

    def close(self):
        self.file.close()
        with open(self.path, "r+b") as file:
            file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\0\2IM")


@pytest.fixture
def matlab73(tmp_path):
    return Matlab73(tmp_path / "x.mat")


def test_version_73(matlab73):
    made = matlab73
    made.array(made.file, "time", TIME[:, None].T, compression="gzip")
    made.array(made.file, "M", np.arange(30.0).reshape(10, 3))
    made.text(made.file, "who", "A. N.")
    made.array(made.group("s"), "F", FORCE[:, None])
    made.array(made.file["s"], "x", np.float32(TIME)[:, None])
    run = made.group("run")
    made.cells(run, "t", [made.reference(TIME[:k][:, None]) for k in (20, 30)], kind="")
    made.cells(run, "F", [made.reference(FORCE[:k][:, None]) for k in (20, 30)], kind="")
    made.cells(made.file, "parts", [made.reference(np.ones((9, 2))), made.reference(FORCE[None, :8])])
    made.array(made.file, "none", [[0, 0]], dtype="u8").attrs["MATLAB_empty"] = 1
    made.close()
    assert format_of(made.path).name == "MATLAB 7.3"
    found = by_name(made.path)
    assert set(found) == {"(50 rows)", "M", "s", "run(1)", "run(2)", "parts", "parts.{1}"}
    assert (columns(found["M"])["M(:,2)"] == np.arange(1.0, 30.0, 3.0)).all()
    assert found["s"].headers == ["F", "x"] and (found["s"].read_column(0) == FORCE).all()
    assert (0, "who: A. N.") in found["s"].comments
    assert (columns(found["run(2)"])["F"] == FORCE[:30]).all() and (columns(found["run(1)"])["t"] == TIME[:20]).all()
    assert (columns(found["parts"])["{2}"] == FORCE[:8]).all()


def test_objects_of_version_73(matlab73):
    made = matlab73
    made.array(made.file, "T", np.arange(6), "table", dtype="<u4")
    made.close()
    with pytest.raises(InputError, match=r"T \(of the MATLAB class table\).*table2struct"):
        tables_of(made.path)


def test_cells_that_refer_to_themselves_end(matlab73):
    made = matlab73
    cells = made.cells(made.file, "loop", [made.reference(FORCE[:, None])] * 3)
    cells[0, 1] = cells.ref
    made.close()
    assert all((table.read_column(0) == FORCE).all() for table in tables_of(made.path))


def test_without_h5py_the_extra_is_named(matlab73, monkeypatch):
    matlab73.array(matlab73.file, "time", TIME)
    matlab73.close()
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(
        InputError, match=r'reading MATLAB 7\.3 needs the package h5py.*pip install "needleforce\[labs\]"'
    ):
        tables_of(matlab73.path)
