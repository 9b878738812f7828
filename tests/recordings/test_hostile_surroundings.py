# SPDX-License-Identifier: Apache-2.0
"""What stands around a file: descriptions of bags that repeat themselves, links, files that are replaced while they
are read, and what a program left in the path of Python."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

import needleforce as nf
from needleforce.recording.formats import worker

DOUBLED = "a: &a0 {x: 1}\n" + "".join(f"b{k}: &a{k + 1} {{!!merge x: *a{k}, !!merge y: *a{k}}}\n" for k in range(30))
DESCRIPTIONS = {
    "merge keys by their tag": DOUBLED,
    "merge keys": "a: &a {x: 1}\n<<: *a\n",
    "an anchor": "a: &a 1\n",
    "an alias": "a: &a [1]\nb: [*a, *a]\n",
    "a tag": "a: !!python/object:os.system x\n",
    "a merge key without alias": "<<: {a: 1}\n",
}


@pytest.fixture
def bag(tmp_path, root, monkeypatch):
    """A bag, by its description."""
    pytest.importorskip("rosbags")
    monkeypatch.syspath_prepend(root / "benchmarks")
    import log_files

    return lambda more: log_files.bag(
        tmp_path, "sqlite3", log_files.database(),
        (log_files.METADATA.format(storage="sqlite3", name="bag.db3") + more).encode(),
    )  # fmt: skip


@pytest.mark.parametrize("more", DESCRIPTIONS.values(), ids=DESCRIPTIONS)
def test_a_bag_whose_description_repeats_itself_is_refused_before_it_doubles(bag, more):
    begun = time.process_time()
    with pytest.raises(nf.InputError, match=r"bag is not readable, .* an anchor, an alias, a tag or a merge key"):
        nf.read(bag(more))
    assert time.process_time() - begun < 2.0


def test_a_bag_with_a_plain_description_is_read(bag):
    assert len(nf.read(bag("more: [1, {a: 'b << c'}]\n"))) > 1


def test_a_bag_holds_its_files_itself(bag, tmp_path):
    made = bag("")
    (made / "bag.db3").rename(tmp_path / "elsewhere.db3")
    (made / "bag.db3").symlink_to(tmp_path / "elsewhere.db3")
    with pytest.raises(nf.InputError, match=r"file of a bag is a link, leads out of .*Put the file itself"):
        nf.read(made)


@pytest.mark.parametrize("more", [Path("x"), None, 3, b"/x"])
def test_whatever_stands_in_the_path_of_python_a_file_is_read(tmp_path, monkeypatch, more):
    scipy = pytest.importorskip("scipy.io")
    time = [0.01 * k for k in range(60)]
    scipy.savemat(tmp_path / "a.mat", {"time_s": time, "depth_mm": time, "force_N": time})
    monkeypatch.setattr(sys, "path", [*sys.path, more])
    worker._worker.close()
    assert len(nf.read(tmp_path / "a.mat", test="indentation")) == 60


FAILING = """
import sys
from needleforce import cli
def app():
    raise OSError("the serial port was closed")
cli.app = app
cli.main()
"""


def test_an_error_of_the_system_without_a_file_is_not_blamed_on_standard_output(tmp_path):
    done = subprocess.run([sys.executable, "-c", FAILING], capture_output=True, text=True)
    assert done.returncode == 1 and done.stderr.strip() == "needleforce: the serial port was closed"


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="the system has no full device")
def test_a_full_standard_output_is_named():
    with open("/dev/full", "w") as full:
        command = [sys.executable, "-c", "from needleforce.cli import main; main()", "--version"]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 1 and done.stderr.strip() == "needleforce: No space left on device: standard output"
