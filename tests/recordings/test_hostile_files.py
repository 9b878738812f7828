# SPDX-License-Identifier: Apache-2.0
"""Hostile files of every format: read or refused with a message, within bounds of memory and time."""

import json
import os
import random
import subprocess
import sys

import numpy as np
import pytest

import needleforce as nf
from needleforce.files import decode_toml, open_regular, read_bytes, xml_root

BOUND_S = 20.0  # of a processor, the promise for any of these files; each takes about a second


@pytest.fixture(scope="module")
def hostile(root):
    """The benchmark's modules."""
    sys.path.insert(0, str(root / "benchmarks"))
    try:
        import hostile_changes
        import hostile_files
        import log_files

        yield hostile_files, log_files, hostile_changes
    finally:
        sys.path.remove(str(root / "benchmarks"))


@pytest.fixture(scope="module")
def reader(hostile):
    """The process that reads the files of every format, one after another."""
    process = hostile[0].Reader()
    yield process
    process.close()


def limited(code: str, *arguments) -> dict:
    """What ``code`` prints as JSON in a program with 1.5 GiB of memory beyond what its imports take."""
    head = "import sys, resource, re, json, pyarrow.parquet, pandas, needleforce as nf\n"
    limit = (
        "size = 1024 * int(re.search(r'VmSize:\\s*(\\d+)', open('/proc/self/status').read())[1]) + (1536 << 20)\n"
        "resource.setrlimit(resource.RLIMIT_AS, (size, size))\n"
    )
    command = [sys.executable, "-c", head + limit + code, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60 * BOUND_S)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


REFUSED = """
import time
found = []
for path in sys.argv[1:]:
    begun = time.process_time()
    try:
        {read}(path)
        words = "read"
    except nf.InputError as error:
        words = str(error)
    found.append([words, time.process_time() - begun])
print(json.dumps(found))
"""


def refusals(read: str, *paths) -> list[str]:
    """What a function answers to files, one after another in the same program."""
    found = limited(REFUSED.format(read=read), *paths)
    assert len(found) == len(paths) and all(seconds < BOUND_S for _, seconds in found)
    return [words for words, _ in found]


EXPANDING = ["csv", "mcap", "parquet", "bag", "toml", "json", "page", "calibration", "table"]
MESHES = ["msh", "vtk", "vtu", "medit", "abaqus"]
EXPANDING += ["npy", "npz", "matlab", "matlab73", "hdf5", "tdms", "records", "ros1", "excel", "forms"]


@pytest.mark.skipif(sys.platform != "linux", reason="the memory of a process is read from /proc")
@pytest.mark.parametrize("kind", [*EXPANDING, "jpk", "igor", "nanosurf", *MESHES])
def test_hostile_files_of_each_format_are_read_or_refused(hostile, reader, kind, many):
    count = 60 if kind in MESHES else many(15, 100)
    found = hostile[0].study(kind, count, first=1_000_000, reader=reader)
    assert found["failed"] == {} and found["refused"] > 0.1 * count and found["read"] + found["refused"] == count


def test_the_study_finds_a_reader_that_fails(hostile, tmp_path):
    def read(path):
        raise KeyError("a traceback")

    assert hostile[0]._outcome(read, tmp_path).startswith("KeyError")


@pytest.mark.parametrize("kind", EXPANDING)
def test_what_expands_is_refused(hostile, tmp_path, kind, many):
    sizes = set()
    for seed in range(many(1, 8)):
        folder = tmp_path / f"{seed}"
        folder.mkdir()
        path = hostile[2].bomb(kind, folder, random.Random(seed))
        size = path.stat().st_size
        if path.is_file() and size in sizes:
            continue  # the same kind of file again
        sizes.add(size)
        assert hostile[0]._outcome(hostile[0].FORMATS[kind][0], path) in ("read", "refused")


def test_parquet_that_expands_to_gigabytes_is_refused(tmp_path):
    pyarrow, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    zeros = pyarrow.array(np.zeros(30_000_000))  # of 240 MB, four times, from some kB
    path = tmp_path / "x.parquet"
    names = ("time_s", "depth_m", "force_N", "fx_N", "fy_N")
    parquet.write_table(pyarrow.table(dict.fromkeys(names, zeros)), path, compression="zstd", use_dictionary=False)
    assert path.stat().st_size < 1 << 22
    assert "unpacked size is" in refusals("nf.read", path)[0]


def test_a_page_that_states_gigabytes_is_refused_before_it_is_unpacked(tmp_path):
    pytest.importorskip("pyarrow")
    import pyarrow
    import pyarrow.parquet

    columns = {name: np.arange(40.0) for name in ("time_s", "depth_m", "force_N")}
    path = tmp_path / "x.parquet"
    pyarrow.parquet.write_table(pyarrow.table(columns), path, compression="none", use_dictionary=False)
    content = path.read_bytes()
    # a page header begins with type 0, then the unpacked size as an integer of field 2: make it longer by three bytes
    assert content[4:7] == b"\x15\x00\x15"
    at = 7
    while content[at] >= 0x80:
        at += 1
    huge = content[:7] + b"\xfe\xff\xff\xff\x0f" + content[at + 1 :]
    path.write_bytes(huge)
    with pytest.raises(nf.InputError):
        nf.read(path)


def test_a_million_columns_and_a_line_of_100_mb_are_refused(tmp_path):
    wide, long = tmp_path / "wide.csv", tmp_path / "long.csv"
    many = ",".join(f"c{k}" for k in range(1_000_000))
    wide.write_text(f"time_s,depth_m,force_N,{many}\n" + "0," * 1_000_002 + "0\n")
    long.write_text("time_s,depth_m,force_N\n0,0,0\n1,1," + "9" * 100_000_000 + "\n")
    assert all("characters in the line" in words for words in refusals("nf.read", wide, long))


def test_one_long_number_and_one_long_header_take_no_quadratic_time(tmp_path):
    number, header = tmp_path / "number.csv", tmp_path / "header.csv"
    number.write_text("time_s,depth_m,force_N\n0,0," + "1" * 60_000 + "x\n1,1,1\n")
    header.write_text("time_s,depth_m," + "_" * 60_000 + "\n0,0,0\n")
    assert "read" not in refusals("nf.read", number, header)


def test_toml_is_refused_before_it_takes_long(tmp_path):
    texts = (
        "a" + ".a" * 20_000 + " = 1",
        "a = " + "[" * 100_000,
        "a = " + "{a=" * 50_000,
        "a = " + "1" * 5001,
        "a = 0x" + "f" * 5001,
        'a={b="""x"""", ' + "a." * 20_000 + "a=1}",
        "a = {b='''x'''', " + "a." * 20_000 + "a=1}",
    )
    paths = [tmp_path / f"{number}.toml" for number in range(len(texts))]
    for path, text in zip(paths, texts):
        path.write_text(text)
    assert all("preset" in words for words in refusals("nf.preset", *paths))


def test_toml_that_is_valid_is_what_tomllib_reads(root):
    import tomllib

    for path in (root / "src/needleforce/presets").glob("*.toml"):
        assert decode_toml(path.read_bytes(), "preset") == tomllib.loads(path.read_text())
    deep = (
        b'"a.b.c.d.e.f.g.h.i.j.k.l.m.n.o.p.q.r.s" = """[[[[[[[[[[[[[[[[[[[[[["""\n# '
        + b"a." * 100
        + b"\nb = [1.5, -2.5]"
    )
    assert decode_toml(deep, "x")["b"] == [1.5, -2.5]


@pytest.mark.parametrize("unit", ["Pa", "GPa"])
def test_a_number_beyond_a_float_is_refused_as_beyond_its_range(tmp_path, unit, root):
    text = (root / "src/needleforce/presets/paper.toml").read_text()
    path = tmp_path / "x.toml"
    path.write_text(text + f"\n[tissue]\nyoung_modulus_{unit} = 1e308\npoisson_ratio = 0.3\n")
    with pytest.raises(nf.InputError, match="young_modulus"):
        nf.preset(path)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "utf-16-le", "utf-16-be", "latin-1"])
def test_a_document_type_is_refused_in_every_encoding(encoding):
    text = f'<?xml version="1.0" encoding="{encoding[:6]}"?><!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>'
    with pytest.raises(ValueError):
        xml_root(text.encode(encoding))
    assert xml_root(b"<a><![CDATA[b]]></a>").text == "b"


@pytest.mark.parametrize("rate", ["1e-6", "0", "-1", "nan", "1e6", "x"])
def test_an_impossible_rate_of_a_sensor_is_refused(rate):
    from needleforce.wire.net_ft import SensorConfiguration, parse_configuration

    page = SensorConfiguration(1e6, 1e6, 1000.0).xml()
    assert parse_configuration(page, "x").rate == 1000.0
    with pytest.raises(nf.InputError, match=r"<comrdtrate> of the sensor is .*, a number from 1 to 100000"):
        parse_configuration(page.replace(b"<comrdtrate>1000<", f"<comrdtrate>{rate}<".encode()), "x")


@pytest.mark.parametrize("time", [2**63, -1])
def test_a_time_that_no_message_holds_is_refused_and_the_file_is_complete(tmp_path, time):
    from needleforce.recording.log import read_log
    from needleforce.recording.log.writer import LogWriter

    writer = LogWriter(tmp_path / "run.mcap", {})
    writer.wrench(1, 10, 10, 10, (0.0,) * 6)
    with pytest.raises(nf.InputError, match="time of a sample is"):
        writer.wrench(4_000_000_000, 20, time, 20, (0.0,) * 6)
    log = read_log(tmp_path / "run.mcap")
    assert log.complete and len(log.wrench) == 1


def test_a_stamp_of_seconds_beyond_32_bits_is_refused(tmp_path):
    from needleforce.recording.log.writer import LogWriter

    writer = LogWriter(tmp_path / "run.mcap", {})
    with pytest.raises(nf.InputError, match="time of a sample is"):
        writer.state(1, 10, 10, 2**31 * 10**9, 0.0, 0.0)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no pipes in folders")
def test_what_is_no_regular_file_is_refused_before_it_is_opened(tmp_path, monkeypatch):
    import needleforce.files as files

    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    opened = []
    monkeypatch.setattr(files.os, "open", lambda *a, **k: opened.append(a) or (_ for _ in ()).throw(OSError))
    for path, kind in ((pipe, "a pipe"), ("/dev/zero", "a device"), (tmp_path, "a folder")):
        with pytest.raises(nf.InputError, match=kind):
            open_regular(path)
    assert not opened


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no pipes in folders")
def test_a_pipe_that_takes_the_name_after_the_check_is_refused(tmp_path, monkeypatch):
    import needleforce.files as files

    path, usual = tmp_path / "x", os.open

    def swapped(*arguments):
        path.unlink()
        os.mkfifo(path)
        return usual(*arguments)

    path.write_text("a file")
    monkeypatch.setattr(files.os, "open", swapped)
    with pytest.raises(nf.InputError, match="a pipe"):
        read_bytes(path, "file")


def test_a_bag_with_computed_messages_or_a_device_is_refused(hostile, tmp_path):
    pytest.importorskip("rosbags")
    logs = hostile[1]
    (tmp_path / "a").mkdir(), (tmp_path / "b").mkdir(), (tmp_path / "c").mkdir()
    assert len(nf.read(logs.bag(tmp_path / "a", "sqlite3", logs.database()))) == logs.ROWS
    with pytest.raises(nf.InputError, match="not a plain table"):
        nf.read(logs.bag(tmp_path / "b", "sqlite3", logs.database(views=True)))
    bag = logs.bag(tmp_path / "c", "sqlite3", logs.database())
    (bag / "bag.db3").unlink()
    (bag / "bag.db3").symlink_to("/dev/zero")
    with pytest.raises(nf.InputError, match="a device"):
        nf.read(bag)


def test_a_bag_without_index_is_refused_with_what_makes_one(hostile, tmp_path):
    """And a single mcap file of it is read, with or without its own index at the end."""
    pytest.importorskip("rosbags")
    logs = hostile[1]
    (tmp_path / "a").mkdir(), (tmp_path / "b").mkdir()
    bag = logs.bag(tmp_path / "a", "sqlite3", logs.database())
    (bag / "metadata.yaml").unlink()
    with pytest.raises(nf.InputError, match=r"ROS 2 bag is without an index, .*ros2 bag reindex .*bag"):
        nf.read(bag)
    with pytest.raises(nf.InputError, match=r"a database.*name the bag's folder; .*ros2 bag reindex"):
        nf.read(bag / "bag.db3")
    data = logs.mcap(0)
    bag = logs.bag(tmp_path / "b", "mcap", data)
    whole = nf.read(bag)
    (bag / "metadata.yaml").unlink()
    with pytest.raises(nf.InputError, match=r"without an index.*or name an mcap file in it"):
        nf.read(bag)
    assert len(nf.read(bag / "bag.mcap")) == len(whole)
    index = int.from_bytes(data[-28:-20], "little")  # where the footer says that it begins, https://mcap.dev/spec
    (bag / "bag.mcap").write_bytes(data[:index])
    cut = nf.read(bag / "bag.mcap")
    assert len(cut) == len(whole) and any("was not closed" in note.message for note in cut.notes)
