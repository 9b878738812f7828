# SPDX-License-Identifier: Apache-2.0
"""Hostile files of every format that is read: no traceback, no hang, no unbounded memory.

    python benchmarks/hostile_files.py [--files 10000] [--only csv xls] [--write]

Each file is a valid one with changed bytes, with cells, keys or records that lie about sizes, depths and widths, or
that expand when they are unpacked; or it is no file at all but a pipe, a device, a folder or a link to itself. A child
process reads it under a limit of memory and time: it must read it, or refuse it with an InputError. With ``--write``
the table of the bounds and of the worst that was seen is written into docs/evidence/hostile_files.md.
"""

import argparse
import hashlib
import json
import os
import random
import re
import resource
import select
import shutil
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
import hostile_changes as changes
import hostile_content as content

import needleforce as nf
from needleforce.errors import InputError
from needleforce.files import MAX_DEFINITION_BYTES, MAX_RECORDING_BYTES, MAX_RESULT_BYTES
from needleforce.recording.formats import worker
from needleforce.recording.formats.detect import tables_of

PAGE = Path(__file__).parents[1] / "docs" / "evidence" / "hostile_files.md"
MARKS = "<!-- table: python benchmarks/hostile_files.py --write -->", "<!-- end of table -->"
MEMORY_BYTES = 1536 << 20  # address space beyond that of the child at its start
TIME_S = 20.0  # for one file
# the bound on the page for files of any size; the other process has its own limit
MEMORY_PER_BYTE, MEMORY_BASE = 60, 600 << 20
FREED_BYTES = 16 << 20  # that the other process gives back when the next file comes, after its memory was looked at
SPECIAL_SHARE, BOMB_SHARE = 0.02, 0.002
_MAX_READ = 200  # columns of a file that are read


def _read(path: Path) -> list[nf.Recording]:
    return [nf.read(path)]


_BY_POSITION = ({"depth": 2, "force": 3}, {"time": 1, "depth": 2, "force": 3})


def _read_all(path: Path) -> list[nf.Recording]:
    """Every recording of a file, by position where it has no headers."""
    for columns in (None, *_BY_POSITION):
        try:
            return nf.read_all(path, test="indentation", columns=columns, units={"depth": "mm"} if columns else None)
        except nf.InputError as error:
            check_advice(error)
            refusal = error
    raise refusal


def _read_columns(path: Path) -> None:
    """Open the tables of a file, and read their columns."""
    count = 0
    for table in tables_of(path):
        for index in range(len(table.headers)):
            count += 1
            if count > _MAX_READ:
                return
            try:
                table.numbers(index)
            except InputError:
                continue


def _read_tables(path: Path) -> list[nf.Recording]:
    """Every column of a file, and its recordings if it has any."""
    _read_columns(path)
    try:
        return nf.read_all(path, test="indentation")
    except nf.InputError as error:
        check_advice(error)
    return []


def _mapping(path: Path) -> list[nf.Recording]:
    """A recording, read with a mapping file."""
    run = path.parent / "run.csv"
    run.write_bytes(content.csv_text().encode())
    return nf.read_all(run, mapping=path)


def check_advice(error: nf.InputError) -> None:
    assert error.next_step, f"an error without next step: {error}"


def check_values(found: object) -> None:
    """Of the recordings that were read, every sample is a finite number, and there are some."""
    for each in found if isinstance(found, list) else []:
        values = np.array([each.time, each.depth, each.velocity, each.force])
        assert values.shape[1] > 1, f"a recording of {values.shape[1]} samples"
        assert np.isfinite(values).all(), f"{np.count_nonzero(~np.isfinite(values))} values are no finite numbers"


def _page(path: Path) -> None:
    from needleforce.acquisition.sources.net_ft_sensor import read_configuration

    read_configuration("", str(path))


def _calibration(path: Path) -> None:
    from needleforce.acquisition.sources.gauge_calibration import read_calibration

    read_calibration(path)


def _mesh(path: Path) -> None:
    """A mesh whose depth is along the last of its axes."""
    from needleforce import fe

    try:
        mesh = fe.read_mesh(path, depth_axis="z", unit="mm")
    except nf.InputError as error:
        check_advice(error)
        if error.quantity != "depth_axis":
            raise
        mesh = fe.read_mesh(path, depth_axis="y", unit="mm")
    assert np.isfinite(mesh.points).all() and len(mesh.labels) == len(mesh.cells) > 0


def _any_of(path: Path, *readers: Callable) -> None:
    """A file as each of what it may be: most readers refuse it, and it is refused if all do."""
    refusals = []
    for read in readers:
        try:
            read(path)
        except nf.InputError as error:
            refusals.append(error)
    if len(refusals) == len(readers):
        raise refusals[0]


def _definition(path: Path) -> None:
    from needleforce.preset_files.build import read_needle, read_tissue
    from needleforce.protocol.reading import read_protocol

    _any_of(path, nf.preset, read_needle, read_tissue, read_protocol)


def _table(path: Path) -> None:
    from needleforce.bench_tests import tissue_estimate
    from needleforce.campaign.labels import read_mapping

    _any_of(path, read_mapping, tissue_estimate)


# format -> its reader, the largest file in bytes, what is read
FORMATS: dict[str, tuple[Callable, int, str]] = {
    "csv": (_read, MAX_RECORDING_BYTES, "recording, CSV"),
    "parquet": (_read, MAX_RECORDING_BYTES, "recording, Parquet"),
    "mcap": (_read, MAX_RECORDING_BYTES, "recording, MCAP"),
    "bag": (_read, MAX_RECORDING_BYTES, "recording, folder of a ROS 2 bag"),
    "ros1": (_read, MAX_RECORDING_BYTES, "recording, ROS 1 bag"),
    "forms": (_read_all, MAX_RECORDING_BYTES, "recording, text of instruments"),
    "excel": (_read_all, MAX_RECORDING_BYTES, "recording, Excel (xlsx)"),
    "xlsm": (_read_all, MAX_RECORDING_BYTES, "recording, Excel with macros (xlsm)"),
    "xls": (_read_all, MAX_RECORDING_BYTES, "recording, Excel (xls)"),
    "lvm": (_read_all, 1 << 28, "recording, LabVIEW text (lvm)"),
    "npy": (_read_tables, MAX_RECORDING_BYTES, "recording, NumPy npy"),
    "npz": (_read_tables, MAX_RECORDING_BYTES, "recording, NumPy npz"),
    "matlab": (_read_tables, MAX_RECORDING_BYTES, "recording, MATLAB 4 and 5"),
    "matlab73": (_read_tables, MAX_RECORDING_BYTES, "recording, MATLAB 7.3"),
    "hdf5": (_read_tables, MAX_RECORDING_BYTES, "recording, HDF5"),
    "tdms": (_read_tables, MAX_RECORDING_BYTES, "recording, TDMS"),
    "records": (_read_tables, MAX_RECORDING_BYTES, "recording, JSON and JSON lines"),
    "jpk": (_read_tables, MAX_RECORDING_BYTES, "force curve, JPK"),
    "igor": (_read_tables, MAX_RECORDING_BYTES, "wave of Igor (ibw)"),
    "nanosurf": (_read_tables, MAX_RECORDING_BYTES, "force curves, Nanosurf (nid)"),
    "toml": (_definition, MAX_DEFINITION_BYTES, "preset, needle, tissue, protocol, TOML"),
    "json": (nf.preset, MAX_RESULT_BYTES, "fit, JSON"),
    "mapping": (_mapping, MAX_DEFINITION_BYTES, "mapping of an instrument, TOML"),
    "page": (_page, 1 << 18, "sensor page, XML"),
    "calibration": (_calibration, MAX_DEFINITION_BYTES, "gauge calibration, TOML, CSV, XML"),
    "table": (_table, 1 << 23, "mapping and bench tests, CSV"),
    "msh": (_mesh, 1 << 28, "mesh, gmsh (msh)"),
    "vtk": (_mesh, 1 << 28, "mesh, VTK (vtk)"),
    "vtu": (_mesh, 1 << 28, "mesh, VTK (vtu)"),
    "medit": (_mesh, 1 << 28, "mesh, MEDIT (mesh)"),
    "abaqus": (_mesh, 1 << 28, "mesh, Abaqus (inp)"),
}


def hostile(kind: str, folder: Path, seed: int) -> Path:
    """The hostile file number ``seed`` of a format."""
    chance = random.Random(f"{kind} {seed}")
    which = chance.random()
    if which < SPECIAL_SHARE:
        return changes.special(folder / f"x{changes.ending_of(kind)}", chance)
    if which < SPECIAL_SHARE + BOMB_SHARE:
        return changes.bomb(kind, folder, chance)
    return changes.changed(kind, folder, chance)


def child() -> int:
    """Read the files that are named on standard input, and print the outcome of each."""
    warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory() as folder:
        for number, (kind, (read, *_)) in enumerate(FORMATS.items()):  # what is loaded late counts for nobody
            _outcome(read, changes.valid(kind, _made(folder, f"valid{number}")))
        _limit_memory()
        print("ready", flush=True)
        for number, line in enumerate(sys.stdin):
            kind, seed = line.split()
            path = hostile(kind, _made(folder, f"{number}"), int(seed))
            processes = ["self", *_other_process()]
            before = [_memory("VmRSS", each) for each in processes]
            for each in processes:
                Path(f"/proc/{each}/clear_refs").write_text("5")
            begun = _processor_time()
            found = _outcome(FORMATS[kind][0], path)
            seconds = _processor_time() - begun
            peaks = [max(0, _memory("VmHWM", each) - rest) for each, rest in zip(processes, before)]
            size = path.stat().st_size if path.is_file() else 0
            print(json.dumps([found, seconds, peaks, size, _digest(path)]), flush=True)
            shutil.rmtree(Path(folder) / f"{number}")
    return 0


def _made(folder: str, name: str) -> Path:
    made = Path(folder) / name
    made.mkdir()
    return made


def _limit_memory() -> None:
    limit = _memory("VmSize") + MEMORY_BYTES
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def _memory(field: str, process: str = "self") -> int:
    """Memory of a process, 0 for one that has ended."""
    try:
        return 1024 * int(re.search(rf"{field}:\s*(\d+)", Path(f"/proc/{process}/status").read_text())[1])
    except (OSError, TypeError):
        return 0


def _other_process() -> list[str]:
    """The process that reads the files of some formats, if it runs."""
    process = worker._worker._process
    return [str(process.pid)] if process is not None and process.poll() is None else []


def _processor_time() -> float:
    """Processor time of this process, of those that it started and that have ended, and of the one that runs."""
    ended = os.times()
    ticks = [Path(f"/proc/{each}/stat").read_text().rsplit(")", 1)[1].split()[11:13] for each in _other_process()]
    running = sum(int(each) for pair in ticks for each in pair) / os.sysconf("SC_CLK_TCK")
    return time.process_time() + ended.children_user + ended.children_system + running


def _digest(path: Path) -> str:
    """What tells one file from another."""
    files = [path] if path.is_file() and path.stat().st_size < 1 << 30 else []
    files += sorted(each for each in path.iterdir() if each.is_file()) if path.is_dir() else []
    return hashlib.sha256(b"".join(each.read_bytes() for each in files)).hexdigest()


def _outcome(read: Callable, path: Path) -> str:
    try:
        try:
            check_values(read(path))
        except nf.InputError as error:
            check_advice(error)
            return "refused"
    except BaseException as error:
        place = error.__traceback__
        while place.tb_next and "needleforce" in place.tb_next.tb_frame.f_code.co_filename:
            place = place.tb_next
        where = f"{Path(place.tb_frame.f_code.co_filename).name}:{place.tb_lineno}"
        return f"{type(error).__name__} at {where}: {error}"[:300]
    return "read"


class Reader:
    """A child process that reads files, restarted after one that it does not survive."""

    def __init__(self):
        self._process = None

    def read(self, kind: str, seed: int) -> tuple[str, float, list[int], int, str]:
        """Outcome, processor time [s], peak memory of each process [bytes], size [bytes] and SHA-256 of a file."""
        if self._process is None or self._process.poll() is not None:
            command = [sys.executable, __file__, "--child"]
            self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
            assert self._process.stdout.readline() == b"ready\n"
        self._process.stdin.write(f"{kind} {seed}\n".encode())
        self._process.stdin.flush()
        if not select.select([self._process.stdout], [], [], 6.0 * TIME_S)[0]:
            self.close()
            return "hangs", 6.0 * TIME_S, [0], 0, ""
        line = self._process.stdout.readline()
        if not line:
            return f"dies with {self._process.wait()}", 0.0, [0], 0, ""
        return tuple(json.loads(line))

    def close(self) -> None:
        """End the child."""
        if self._process:
            self._process.kill()
            self._process.communicate()
            self._process = None


def study(kind: str, files: int, first: int = 0, reader: Reader | None = None) -> dict:
    """Counts of outcomes of hostile files of a format, and the worst time [s] and memory [bytes]."""
    own, digests = None if reader else Reader(), set()
    found = {"read": 0, "refused": 0, "failed": {}, "time": (0.0, 0), "memory": (0, 0, 0)}
    for seed in range(first, first + files):
        outcome, seconds, peaks, size, digest = (reader or own).read(kind, seed)
        digests.add(digest)
        if outcome not in ("read", "refused"):
            found["failed"][seed] = outcome
        else:
            found[outcome] += 1
        if seconds > TIME_S:
            found["failed"][seed] = f"takes {seconds:.1f} s"
        bounds = [base + MEMORY_PER_BYTE * size for base in (MEMORY_BASE, MEMORY_BYTES + FREED_BYTES)]
        if any(peak > bound for peak, bound in zip(peaks, bounds)):
            found["failed"][seed] = f"takes {sum(peaks) >> 20} MiB"
        found["time"] = max(found["time"], (seconds, seed))
        found["memory"] = max(found["memory"], (sum(peaks), size, seed))
    if own:
        own.close()
    return found | {"different": len(digests)}


def row(kind: str, found: dict) -> str:
    """The row of a format on the page."""
    _, limit, what = FORMATS[kind]
    size = f"{limit >> 30} GiB" if limit >> 30 else f"{limit >> 20} MiB" if limit >> 20 else f"{limit >> 10} KiB"
    counts = f"{found['different']} | {found['read']} | {found['refused']} | {len(found['failed'])}"
    return f"| {what} | {size} | {counts} | {found['time'][0]:.1f} s | {found['memory'][0] >> 20} MiB |"


HEAD = [
    "| file | largest | different files | read | refused | other outcome | longest processor time | most memory |",
    "|---" * 8 + "|",
]


def write(rows: list[str]) -> None:
    """Replace the rows of the page's table, those of formats that were not studied excepted."""
    text = PAGE.read_text(encoding="utf-8")
    begin, end = text.index(MARKS[0]) + len(MARKS[0]), text.index(MARKS[1])
    old = {line.split("|")[1]: line for line in text[begin:end].strip().splitlines()[len(HEAD) :]}
    merged = old | {line.split("|")[1]: line for line in rows}
    PAGE.write_text(text[:begin] + "\n" + "\n".join([*HEAD, *merged.values()]) + "\n" + text[end:], encoding="utf-8")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--files", type=int, default=10_000, help="of each format")
    parser.add_argument("--only", choices=FORMATS, nargs="+", help="some formats")
    parser.add_argument("--write", action="store_true", help="write the table into the page")
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        return child()
    rows, failures = [], 0
    for kind in options.only or FORMATS:
        begun = time.monotonic()
        found = study(kind, options.files)
        rows.append(row(kind, found))
        print(rows[-1], f"{time.monotonic() - begun:.0f} s; worst files: {found['time'][1]}, {found['memory'][2]}")
        for seed, outcome in list(found["failed"].items())[:20]:
            print(f"    {kind} {seed}: {outcome}", flush=True)
        failures += len(found["failed"])
        if options.write:
            write(rows)
    return int(failures > 0)


if __name__ == "__main__":
    sys.exit(main())
