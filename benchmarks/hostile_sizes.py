# SPDX-License-Identifier: Apache-2.0
"""Large files: 2 GB of each format in a program that may have 1 GB of memory, and ten million rows.

    python benchmarks/hostile_sizes.py [--only text xlsx] [--write]

The files are sparse where the format allows it. Each is read by a program of its own, which must read it or refuse it
with an InputError. With ``--write`` the table is written into docs/evidence/hostile_files.md. It takes some minutes,
and 3 GB of the disk for a while.
"""

import argparse
import json
import re
import resource
import struct
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

PAGE = Path(__file__).parents[1] / "docs" / "evidence" / "hostile_files.md"
MARKS = "<!-- table: python benchmarks/hostile_sizes.py --write -->", "<!-- end of sizes -->"
GB = 1 << 30
LARGE = 2_100_000_000  # bytes, less than the largest recording
ROWS, MANY_ROWS = 33_000_000, 10_000_000  # samples: nearly as many as a recording has, and ten million
OPTIONS = {"columns": {"time": 1, "depth": 2, "force": 3}, "units": {"time": "s", "depth": "mm", "force": "N"}}


def _sparse(path: Path, start: bytes, end: bytes = b"", size: int = LARGE) -> Path:
    with path.open("wb") as file:
        file.write(start)
        file.truncate(size - len(end))
        file.seek(0, 2)
        file.write(end)
    return path


def _npy_head(rows: int, columns: int, fortran: bool) -> bytes:
    text = str({"descr": "<f8", "fortran_order": fortran, "shape": (rows, columns)}).encode().ljust(117) + b"\n"
    return b"\x93NUMPY\1\0" + struct.pack("<H", len(text)) + text


def large_npy(folder: Path, fortran: bool = False) -> Path:
    """Eight columns of zeros."""
    head = _npy_head(ROWS, 8, fortran)
    return _sparse(folder / "x.npy", head, size=len(head) + 64 * ROWS)


def large_hdf5(folder: Path) -> Path:
    """Eight vectors, of which the ends are written."""
    import h5py

    with h5py.File(folder / "x.h5", "w") as file:
        for name in ("time_s", "depth_mm", "force_N", "a", "b", "c", "d", "e"):
            file.create_dataset(name, shape=(ROWS,), dtype="f8")[ROWS - 1] = 1.0
    return folder / "x.h5"


def large_text(folder: Path) -> Path:
    """Rows of long numbers."""
    with (folder / "x.csv").open("w") as file:
        file.write("time_s,depth_mm,force_N\n")
        row = "{:012.3f},{:030.25f},{:030.25f}\n"
        for first in range(0, 27_000_000, 100_000):
            file.writelines(
                row.format(1e-3 * k, k % 1000 * 1e-3, k % 777 * 1e-3) for k in range(first, first + 100_000)
            )
    return folder / "x.csv"


def large_workbook(folder: Path) -> Path:
    """A workbook behind 2 GB of nothing."""
    with zipfile.ZipFile(folder / "small.xlsx", "w") as archive:
        archive.writestr("xl/workbook.xml", "<workbook/>")
    content = (folder / "small.xlsx").read_bytes()
    return _sparse(folder / "x.xlsx", content, content)


def large_matlab(folder: Path) -> Path:
    """Seven vectors of zeros in a MATLAB 5 file."""

    def element(kind: int, data: bytes) -> bytes:
        return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)

    with (folder / "x.mat").open("wb") as file:
        file.write(b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM")
        for name in (b"time", b"depth", b"force", b"a", b"b", b"c", b"d"):
            shape = element(6, struct.pack("<II", 6, 0)) + element(5, struct.pack("<2i", ROWS, 1)) + element(1, name)
            file.write(struct.pack("<II", 14, len(shape) + 8 + 8 * ROWS) + shape + struct.pack("<II", 9, 8 * ROWS))
            file.seek(8 * ROWS - 1, 1)
            file.write(b"\0")
    return folder / "x.mat"


def columns() -> dict[str, np.ndarray]:
    """An insertion of ten million samples, with noise."""
    time_s = 1e-3 * np.arange(MANY_ROWS)
    depth = np.interp(time_s, time_s[-1] * np.array([0.0, 0.2, 0.5, 0.8, 1.0]), [-5.0, -5.0, 20.0, -5.0, -5.0])
    force = 0.04 * depth.clip(0.0) + 1e-3 * np.random.default_rng(1).standard_normal(MANY_ROWS)
    return {"time_s": time_s.round(3), "depth_mm": depth.round(4), "force_N": force.round(5)}


def many_rows_csv(folder: Path) -> Path:
    """Ten million rows of text."""
    import pyarrow
    import pyarrow.csv

    pyarrow.csv.write_csv(pyarrow.table(columns()), folder / "x.csv")
    return folder / "x.csv"


def many_rows_parquet(folder: Path) -> Path:
    """Ten million rows of Parquet."""
    import pyarrow
    import pyarrow.parquet

    pyarrow.parquet.write_table(pyarrow.table(columns()), folder / "x.parquet")
    return folder / "x.parquet"


def many_rows_hdf5(folder: Path) -> Path:
    """Ten million rows of compressed HDF5."""
    import h5py

    with h5py.File(folder / "x.h5", "w") as file:
        for name, values in columns().items():
            file.create_dataset(name, data=values, compression="gzip", compression_opts=1, chunks=(100_000,))
    return folder / "x.h5"


def many_rows_npy(folder: Path) -> Path:
    """Ten million rows of a matrix."""
    np.save(folder / "x.npy", np.stack(list(columns().values()), axis=1))
    return folder / "x.npy"


# name on the page, what writes it, memory beyond that of the program, options of read
CASES: dict[str, tuple[str, Callable[[Path], Path], int, dict]] = {
    "text": ("2 GB of text, 27 million rows", large_text, GB, {}),
    "npy": ("2 GB of NumPy npy, 8 columns", large_npy, GB, OPTIONS),
    "fortran": ("2 GB of npy, column by column", lambda folder: large_npy(folder, True), GB, OPTIONS),
    "hdf5": ("2 GB of HDF5, 8 vectors", large_hdf5, GB, {}),
    "matlab": ("2 GB of MATLAB 5, 7 vectors", large_matlab, GB, {}),
    "xlsx": ("2 GB of xlsx", large_workbook, GB, {}),
    "xls": ("2 GB of xls", lambda f: _sparse(f / "x.xls", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"), GB, {}),
    "parquet": ("2 GB of Parquet", lambda f: _sparse(f / "x.parquet", b"PAR1", b"\x10\0\0\0PAR1"), GB, {}),
    "tdms": ("2 GB of TDMS", lambda f: _sparse(f / "x.tdms", b"TDSm"), GB, {}),
    "lines": ("2 GB of JSON lines", lambda f: _sparse(f / "x.jsonl", b'{"time": 1, "force": 2}\n' * 3), GB, {}),
    "lvm": ("2 GB of LabVIEW text", lambda f: _sparse(f / "x.lvm", b"LabVIEW Measurement\n"), GB, {}),
    "mcap": ("2 GB of MCAP", lambda f: _sparse(f / "x.mcap", b"\x89MCAP0\r\n"), GB, {}),
    "csv_rows": ("10 million rows of CSV", many_rows_csv, 8 * GB, {}),
    "npy_rows": ("10 million rows of npy", many_rows_npy, 8 * GB, OPTIONS),
    "hdf5_rows": ("10 million rows of HDF5, gzip", many_rows_hdf5, 8 * GB, {}),
    "parquet_rows": ("10 million rows of Parquet", many_rows_parquet, 8 * GB, {}),
}


def child(path: str, memory: str, options: str) -> int:
    """Read a file within a limit of memory, and print the outcome, the seconds, and the peak of memory in bytes."""
    import pandas  # noqa: F401 - what a program has imported before
    import pyarrow.parquet  # noqa: F401

    import needleforce as nf

    own = 1024 * int(re.search(r"VmSize:\s*(\d+)", Path("/proc/self/status").read_text())[1])
    resource.setrlimit(resource.RLIMIT_AS, (own + int(memory), own + int(memory)))
    before, begun = _peak(), time.process_time()
    try:
        found = f"{len(nf.read(path, **json.loads(options)))} samples"
    except nf.InputError as error:
        assert error.next_step
        found = f"refused: {error.quantity} is {error.value}" if error.value else f"refused: {error.quantity}"
    print(json.dumps([found, time.process_time() - begun, _peak() - before]))
    return 0


def _peak() -> int:
    return 1024 * int(re.search(r"VmHWM:\s*(\d+)", Path("/proc/self/status").read_text())[1])


def study(name: str) -> str:
    """The row of a case on the page. Raises AssertionError for another outcome than read or refused."""
    what, make, memory, options = CASES[name]
    with tempfile.TemporaryDirectory() as folder:
        path = make(Path(folder))
        command = [sys.executable, __file__, "--child", str(path), str(memory), json.dumps(options)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=600)
        assert done.returncode == 0, f"{name}: {done.stderr[-1000:]}"
        found, seconds, peak = json.loads(done.stdout)
    return f"| {what} | {memory >> 30} GiB | {found} | {seconds:.1f} s | {peak >> 20} MiB |"


HEAD = ["| file | memory allowed | outcome | processor time | most memory |", "|---" * 5 + "|"]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", choices=CASES, nargs="+", help="some cases")
    parser.add_argument("--write", action="store_true", help="write the table into the page")
    parser.add_argument("--child", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        return child(*options.child)
    rows = []
    for name in options.only or CASES:
        rows.append(study(name))
        print(rows[-1], flush=True)
    if options.write:
        text = PAGE.read_text(encoding="utf-8")
        begin, end = text.index(MARKS[0]) + len(MARKS[0]), text.index(MARKS[1])
        PAGE.write_text(text[:begin] + "\n" + "\n".join([*HEAD, *rows]) + "\n" + text[end:], encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
