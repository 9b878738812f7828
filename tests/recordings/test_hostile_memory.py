# SPDX-License-Identifier: Apache-2.0
"""Files larger than the memory that a program may have: an error that names it, in every format, soon."""

import json
import subprocess
import sys
import zipfile

import numpy as np
import pytest

import needleforce as nf

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the memory of a process is limited by RLIMIT_AS")

GB = 1 << 30
TWO_GB = 2_000_000_000
OPTIONS = {"columns": {"time": 1, "depth": 2, "force": 3}, "units": {"time": "s", "depth": "mm", "force": "N"}}
READ = """
import json, re, resource, sys
import pandas, pyarrow.parquet, needleforce as nf
path, memory, options = sys.argv[1], int(sys.argv[2]), json.loads(sys.argv[3])
size = 1024 * int(re.search(r"VmSize:\\s*(\\d+)", open("/proc/self/status").read())[1]) + memory
resource.setrlimit(resource.RLIMIT_AS, (size, size))
try:
    print(json.dumps(["read", len(nf.read(path, **options))]))
except nf.InputError as error:
    print(json.dumps([str(error), error.next_step]))
"""


def outcome(path, memory, options=None):
    """What reading a file prints in a program with so many bytes beyond those of its imports."""
    command = [sys.executable, "-c", READ, str(path), str(memory), json.dumps(options or {})]
    done = subprocess.run(command, capture_output=True, text=True, timeout=1200)
    assert done.returncode == 0, done.stderr[-2000:]
    return json.loads(done.stdout)


def sparse(path, start, end=b"", size=TWO_GB):
    """A file of ``size`` bytes that takes no space on the disk."""
    with path.open("wb") as file:
        file.write(start)
        file.truncate(size - len(end))
        file.seek(0, 2)
        file.write(end)
    return path


def workbook(tmp_path):
    with zipfile.ZipFile(tmp_path / "small.xlsx", "w") as archive:
        archive.writestr("xl/workbook.xml", "<workbook/>")
    content = (tmp_path / "small.xlsx").read_bytes()
    return sparse(tmp_path / "x.xlsx", content, content)


# a file of 2 GB -> what its error says with 1 GB of memory
LARGE = {
    "text": (lambda folder: sparse(folder / "x.csv", b"time_s,depth_mm,force_N\n0,0,0\n1,1,1\n"), "binary"),
    "xlsx": (workbook, "memory is not enough"),
    "xls": (lambda folder: sparse(folder / "x.xls", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"), "memory is not enough"),
    "parquet": (lambda folder: sparse(folder / "x.parquet", b"PAR1", b"\x10\0\0\0PAR1"), "memory is not enough"),
    "lvm": (lambda folder: sparse(folder / "x.lvm", b"LabVIEW Measurement\n"), "at most 268435456 bytes are read"),
    "mcap": (lambda folder: sparse(folder / "x.mcap", b"\x89MCAP0\r\n"), "number of wrenches is 0"),
}


@pytest.mark.parametrize("kind", LARGE)
def test_two_gigabytes_in_one(tmp_path, kind):
    make, expected = LARGE[kind]
    found, step = outcome(make(tmp_path), GB)
    assert expected in found and step


@pytest.mark.parametrize("fortran", [False, True])
def test_values_that_do_not_fit_are_refused_wherever_memory_ends(tmp_path, fortran):
    """The columns fit into memory, what is made of them does not."""
    rows = 4_000_000
    head = str({"descr": "<f8", "fortran_order": fortran, "shape": (rows, 3)}).encode().ljust(117) + b"\n"
    path = tmp_path / "x.npy"
    path.write_bytes(b"\x93NUMPY\1\0" + len(head).to_bytes(2, "little") + head)
    time_and_more = np.stack([1e-3 * np.arange(rows), np.sin(1e-5 * np.arange(rows)), np.zeros(rows)], axis=1)
    with path.open("ab") as file:
        file.write(time_and_more.tobytes("F" if fortran else "C"))
    found, step = outcome(path, 160 << 20, OPTIONS)
    assert "x.npy: memory is not enough" in found and "split the file" in step
    assert outcome(path, GB, OPTIONS) == ["read", rows]


def test_hdf5_and_text_that_do_not_fit(tmp_path):
    h5py = pytest.importorskip("h5py")
    rows = 2_000_000
    columns = {"time_s": 1e-3 * np.arange(rows), "depth_mm": np.sin(1e-5 * np.arange(rows)), "force_N": np.ones(rows)}
    with h5py.File(tmp_path / "x.h5", "w") as file:
        for name, values in columns.items():
            file[name] = values
    lines = (f"{1e-3 * k:.3f},{k % 997 / 1000},1.0\n" for k in range(rows))
    (tmp_path / "x.csv").write_text("time_s,depth_mm,force_N\n" + "".join(lines))
    for name in ("x.h5", "x.csv"):
        found, step = outcome(tmp_path / name, 70 << 20)
        assert f"{name}: memory is not enough" in found and "split the file" in step


def test_a_look_and_all_recordings_without_memory(tmp_path, monkeypatch):
    from needleforce.recording import reader

    def full(*_):
        raise MemoryError

    (tmp_path / "x.csv").write_text("time_s,depth_mm,force_N\n0,0,0\n1,1,1\n")
    monkeypatch.setattr(reader, "tables_of", full)
    for read in (nf.read, nf.read_all):
        with pytest.raises(nf.InputError, match=r"memory is not enough.*split the file"):
            read(tmp_path / "x.csv")


def test_more_samples_than_a_recording_has_are_refused_from_the_heading(tmp_path):
    pytest.importorskip("h5py")
    import h5py

    rows = 1 << 26
    head = str({"descr": "<f4", "fortran_order": False, "shape": (rows, 3)}).encode().ljust(117) + b"\n"
    sparse(
        tmp_path / "x.npy", b"\x93NUMPY\1\0" + len(head).to_bytes(2, "little") + head, size=10 + len(head) + 12 * rows
    )
    with h5py.File(tmp_path / "x.h5", "w") as file:
        for name in ("time_s", "depth_mm", "force_N"):
            file.create_dataset(name, shape=(rows,), dtype="f4")
    for name in ("x.npy", "x.h5"):
        with pytest.raises(
            nf.InputError, match=r"number of samples is 67108864, at most 33554432 can be read\. .*split"
        ):
            nf.read(tmp_path / name)
