# SPDX-License-Identifier: Apache-2.0
"""HDF5 and TDMS files as tables: written by their own libraries, in the ways in which laboratories differ."""

import os
import sys
import zlib
from datetime import datetime

import numpy as np
import pytest

from needleforce.errors import InputError
from needleforce.recording.formats import Format, worker
from needleforce.recording.formats.detect import format_of, tables_of

h5py = pytest.importorskip("h5py")
nptdms = pytest.importorskip("nptdms")

TIME = np.arange(50) * 0.02
FORCE = np.sin(TIME)


def by_name(path):
    return {table.name: table for table in tables_of(path)}


def columns(table):
    return {header: table.read_column(index) for index, header in enumerate(table.headers)}


@pytest.fixture
def written(tmp_path):
    def made(fill, **options):
        with h5py.File(tmp_path / "x.h5", "w", **options) as file:
            fill(file)
        return tmp_path / "x.h5"

    return made


@pytest.mark.parametrize(
    "options",
    [{}, {"compression": "gzip", "shuffle": True}, {"compression": "lzf"}, {"fletcher32": True}, {"chunks": (7,)}],
    ids=str,
)
@pytest.mark.parametrize("libver", ["earliest", "latest"])
def test_groups_with_units_as_attributes(written, options, libver):
    def fill(file):
        file.attrs["operator"] = "A. N."
        for number in (1, 2):
            group = file.create_group(f"trials/trial {number}")
            group.attrs["speed"] = 5.0 * number
            group.create_dataset("time", data=TIME, **options).attrs["units"] = "s"
            group.create_dataset("fz", data=(number * 1e3 * FORCE).astype(">i2"), **options).attrs["unit"] = b"mN"
            group.create_dataset("x", data=TIME[:, None].astype("<f4"))

    path = written(fill, libver=libver)
    assert format_of(path).name == "HDF5"
    found = by_name(path)
    assert list(found) == ["/trials/trial 1", "/trials/trial 2"]
    second = found["/trials/trial 2"]
    assert dict(zip(second.headers, second.units)) == {"fz": "mN", "time": "s", "x": ""}
    assert {(0, "speed: 10.0"), (0, "operator: A. N.")} <= set(second.comments)
    values = columns(second)
    assert (values["time"] == TIME).all() and (values["fz"] == (2e3 * FORCE).astype("i2")).all()
    assert (values["x"] == TIME.astype("f4")).all()


def test_matrices_compounds_and_lengths(written):
    def fill(file):
        made = file.create_dataset("matrix", data=np.arange(30, dtype="u1").reshape(10, 3))
        made.attrs["columns"], made.attrs["units"] = ["t", "d", "F"], "s, mm, N"
        file.create_dataset("plain", data=np.arange(30.0).reshape(3, 10))
        rows = np.zeros(9, dtype=[("t", "f8"), ("F", "f4"), ("text", "S3")])
        rows["F"] = np.arange(9)
        file.create_dataset("rows", data=rows)
        file["a"], file["b"], file["rate"] = TIME, TIME[:5], 50.0
        file.create_dataset("image", data=np.zeros((100, 100)))

    found = by_name(written(fill))
    assert set(found) == {"/rows", "/ (50 rows)", "/ (5 rows)", "/matrix", "/plain"}
    assert found["/matrix"].headers == ["t", "d", "F"] and found["/matrix"].units == ["s", "mm", "N"]
    assert found["/matrix"].read_column(2).tolist() == list(range(2, 30, 3))
    assert columns(found["/plain"])["plain[:,1]"].tolist() == list(range(10, 20))
    assert found["/rows"].read_column(1).tolist() == list(range(9))
    with pytest.raises(InputError, match=r"column 'text' is of type \|S3, a column of numbers is needed"):
        found["/rows"].read_column(2)
    assert "image" in found["/plain"].notes[0].message and (0, "rate: 50.0") in found["/plain"].comments


def test_links_are_followed_within_the_file_only(written, tmp_path):
    secret = tmp_path / "secret.h5"
    with h5py.File(secret, "w") as file:
        file["time"] = TIME

    def fill(file):
        file["run/force"] = FORCE
        file["run/again"] = file["run"]  # a circle
        file["soft"], file["out"] = h5py.SoftLink("/run/force"), h5py.ExternalLink(str(secret), "/time")

    (table,) = tables_of(written(fill))
    assert table.headers == ["force"] and (table.read_column(0) == FORCE).all()


def test_values_of_other_files_and_of_plugins_are_refused(written, tmp_path):
    (tmp_path / "secret").write_bytes(bytes(range(100)))
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["time"] = TIME
    refused = {}

    def external(file):
        file.create_dataset("time", shape=(100,), dtype="u1", external=[(str(tmp_path / "secret"), 0, 100)])

    def virtual(file):
        layout = h5py.VirtualLayout(shape=(50,), dtype="f8")
        layout[:] = h5py.VirtualSource(str(tmp_path / "other.h5"), "time", shape=(50,))
        file.create_virtual_dataset("time", layout)

    def twice(file):
        plan = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        plan.set_chunk((1000,)), plan.set_deflate(9), plan.set_deflate(9)
        h5py.h5d.create(file.id, b"time", h5py.h5t.NATIVE_DOUBLE, h5py.h5s.create_simple((1000,)), plan)

    for fill, reason in (
        (external, "in another file"),
        (virtual, "a virtual dataset"),
        (twice, "compressed more than once"),
    ):
        with pytest.raises(InputError, match=reason):
            refused[reason] = tables_of(written(fill))
    assert not refused


def test_a_filter_of_a_plugin_is_named_with_the_way_out(written):
    def fill(file):
        plan = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        plan.set_chunk((1000,))
        plan.set_filter(32015, h5py.h5z.FLAG_OPTIONAL, ())  # zstd
        h5py.h5d.create(file.id, b"time", h5py.h5t.NATIVE_DOUBLE, h5py.h5s.create_simple((1000,)), plan)

    with pytest.raises(InputError, match=r"needs a plugin; h5repack -f GZIP=4 OLD NEW"):
        tables_of(written(fill))


def test_what_expands_is_refused_before_it_is_read(written):
    def unwritten(file):
        file.create_dataset("time", shape=(30_000_000_000,), dtype="f8", chunks=(100_000,), compression="gzip")

    def zeros(file):
        file.create_dataset("time", shape=(33_000_000, 2), dtype="f8", chunks=(100_000, 1), compression="gzip")

    def chunk(file):
        made = file.create_dataset("time", shape=(1000,), dtype="f8", chunks=(1000,), compression="gzip")
        made.id.write_direct_chunk((0,), zlib.compress(bytes(200_000_000)))

    with pytest.raises(InputError, match="number of samples is 30000000000"):
        tables_of(written(unwritten))
    with pytest.raises(InputError, match="unpacked size is 503 MiB"):
        tables_of(written(zeros))[0].read_column(0)
    with pytest.raises(InputError, match="size of a chunk is larger than stated"):
        tables_of(written(chunk))[0].read_column(0)


def test_a_truncated_file_is_refused_at_any_place(written):
    path = written(lambda file: file.create_dataset("time", data=TIME, chunks=(10,)))
    whole = path.read_bytes()
    for size in range(9, len(whole), 211):
        path.write_bytes(whole[:size])
        with pytest.raises(InputError, match="not readable as HDF5"):
            tables_of(path)


def test_a_library_that_never_returns_or_dies_is_ended(tmp_path, monkeypatch):
    """A module in the place of a format, whose reading loops in C or ends the process."""
    (tmp_path / "stub.py").write_text(
        "import os\n"
        "def tables(path):\n"
        "    if 'loop' in path.name: sum(range(10**14))\n"
        "    if 'die' in path.name: os.abort()\n"
        "    return []\n"
    )
    monkeypatch.setattr(worker, "_TIME_S", 0.5)  # of a processor
    monkeypatch.setattr(worker, "_WALL_FACTOR", 1000.0)
    for name in ("loop", "die", "fine"):
        (tmp_path / name).touch()
    monkeypatch.setattr(sys, "path", [*sys.path, str(tmp_path)])
    form = Format(module="stub", name="STUB", limited=True)
    worker._worker.close()
    for name in ("loop", "die"):
        with pytest.raises(InputError, match="the library that reads it failed, or took more than"):
            worker.tables_by_worker(form, tmp_path / name)
    assert worker.tables_by_worker(form, tmp_path / "fine") == []
    worker._worker.close()


@pytest.mark.parametrize("kind, package", [("h5", "h5py"), ("tdms", "nptdms")])
def test_without_the_package_the_extra_is_named(tmp_path, monkeypatch, kind, package):
    path = tmp_path / "x"
    path.write_bytes({"h5": b"\x89HDF\r\n\x1a\n", "tdms": b"TDSm"}[kind] + bytes(100))
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(InputError, match=rf'reading .* needs the package {package}.*pip install "needleforce\[labs\]"'):
        tables_of(path)


EVEN = {"wf_increment": 0.02, "wf_start_offset": 1.0}


@pytest.fixture
def tdms(tmp_path):
    def made(*segments):
        with nptdms.TdmsWriter(tmp_path / "x.tdms") as writer:
            for segment in segments:
                writer.write_segment(segment)
        return tmp_path / "x.tdms"

    return made


def test_channels_with_their_units_and_an_even_time(tdms):
    group = nptdms.GroupObject("run", {"speed": 5.0})
    force = nptdms.ChannelObject("run", "Kraft", FORCE, EVEN | {"unit_string": "N"})
    depth = nptdms.ChannelObject("run", "Weg", TIME.astype("f4"), EVEN | {"NI_UnitDescription": "mm"})
    path = tdms([nptdms.RootObject({"title": "a"}), group, force, depth], [force, depth])
    assert format_of(path).name == "TDMS (LabVIEW)"
    (table,) = tables_of(path)
    assert table.headers == ["time", "Kraft", "Weg"] and table.units == ["s", "N", "mm"]
    assert {(0, "speed: 5.0"), (0, "title: a")} <= set(table.comments)
    np.testing.assert_allclose(table.read_column(0), 1.0 + 0.02 * np.arange(100), atol=1e-12)
    assert (table.read_column(1) == np.tile(FORCE, 2)).all()
    assert (table.read_column(2) == np.tile(TIME.astype("f4"), 2)).all()


def test_a_scaled_channel_a_time_of_its_own_and_other_lengths(tdms):
    scale = {"NI_Scaling_Status": "unscaled", "NI_Number_Of_Scales": 1, "NI_Scale[0]_Scale_Type": "Linear",
             "NI_Scale[0]_Linear_Slope": 0.5, "NI_Scale[0]_Linear_Y_Intercept": -3.0,
             "NI_Scale[0]_Linear_Input_Source": 0xFFFFFFFF}  # fmt: skip
    start = datetime(2024, 5, 6, 7, 8, 9)
    stamps = np.datetime64(start, "us") + (1e6 * TIME).astype("m8[us]")
    path = tdms([
        nptdms.ChannelObject("a", "Zeit", TIME, EVEN),
        nptdms.ChannelObject("a", "F", np.arange(50, dtype="i2"), EVEN | scale),
        nptdms.ChannelObject("a", "slow", FORCE[:10], EVEN | {"wf_increment": 0.1}),
        nptdms.ChannelObject("b", "stamp", stamps), nptdms.ChannelObject("b", "F", FORCE),
    ])  # fmt: skip
    found = by_name(path)
    assert list(found) == ["a (50 rows every 0.02 s)", "a (10 rows every 0.1 s)", "b"]
    first, slow, stamped = found.values()
    assert first.headers == ["Zeit", "F"] and (first.read_column(1) == 0.5 * np.arange(50) - 3.0).all()
    assert slow.headers == ["time", "slow"]
    np.testing.assert_allclose(slow.read_column(0), 1.0 + 0.1 * np.arange(10), atol=1e-12)
    np.testing.assert_allclose(stamped.read_column(0) - 1714979289.0, TIME, atol=1e-6)
    assert stamped.units[0] == "s"


def test_an_increment_that_is_no_time(tdms):
    more = EVEN | {"wf_xname": "Weg", "wf_xunit_string": "mm"}
    (table,) = tables_of(tdms([nptdms.ChannelObject("a", "F", FORCE, more)]))
    assert table.headers == ["Weg", "F"] and table.units == ["mm", ""]


def test_a_truncated_tdms_file_is_refused_or_shorter(tdms):
    path = tdms([nptdms.ChannelObject("a", "F", FORCE, EVEN), nptdms.ChannelObject("a", "d", TIME, EVEN)])
    whole = path.read_bytes()
    for size in range(4, len(whole), 61):
        path.write_bytes(whole[:size])
        try:
            tables = tables_of(path)
        except InputError:
            continue
        for table in tables:
            for header, values in columns(table).items():
                truth = {"F": FORCE, "d": TIME, "time": 1.0 + 0.02 * np.arange(50)}[header]
                np.testing.assert_allclose(values, truth[: len(values)], atol=1e-12)


def test_files_of_a_nanoindenter_as_their_own_library_reads_them(recordings):
    for name in ("piuma-x1-y1.tdms", "piuma-x2-y1.tdms"):
        path = recordings / "other-labs" / "nanoindentation-piuma" / name
        alone = nptdms.TdmsFile.read(path)
        (group,) = alone.groups()
        (table,) = tables_of(path)
        named = {channel.name: channel for channel in group.channels()}
        assert table.headers == ["time", *named] and table.units[1:] == ["Volts"] * len(named)
        for index, header in enumerate(table.headers[1:], 1):
            values, truth = table.read_column(index), named[header][:]
            assert len(values) == len(truth) and values[0] == truth[0] and values[-1] == truth[-1]
            assert (values == truth).all()
        np.testing.assert_allclose(table.read_column(0), next(iter(named.values())).time_track(), atol=1e-9)
    assert os.fspath(path).endswith("x2-y1.tdms") and len(values) == 50112
