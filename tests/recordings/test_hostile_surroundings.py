# SPDX-License-Identifier: Apache-2.0
"""What stands around a file: descriptions of bags that repeat themselves, links, files that are replaced while they
are read, and what a program left in the path of Python."""

import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

import needleforce as nf
from needleforce.acquisition.sources.gauge_calibration import read_calibration
from needleforce.bench_tests.reading import read_bending, read_stress
from needleforce.campaign import campaign
from needleforce.recording.formats import worker
from needleforce.recording.formats.detect import tables_of
from needleforce.steering import BaseMotion

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


def _workbook(path, force):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in [("time_s", "depth_mm", "force_N"), *((0.01 * k, 0.1 * k, force) for k in range(60))]:
        book.active.append(row)
    book.save(path)


def _text(path, force):
    rows = (f"{0.01 * k:.2f},{0.1 * k:.1f},{force}\n" for k in range(60))
    path.write_text("time_s,depth_mm,force_N\n" + "".join(rows))


def _renamed(path, write, force):
    """As spreadsheets and editors save a file."""
    write(path.with_name("new" + path.suffix), force)
    path.with_name("new" + path.suffix).replace(path)


def _written_anew(path, write, force):
    """As scripts write a file of the same name."""
    write(path, force)


@pytest.mark.parametrize("replaced", [_renamed, _written_anew])
@pytest.mark.parametrize("name, write", [("a.xlsx", _workbook), ("a.csv", _text)])
def test_a_file_that_is_replaced_while_it_is_read_is_not_mixed_with_the_other(tmp_path, name, write, replaced):
    path = tmp_path / name
    write(path, 1.5)
    (table,) = tables_of(path)
    replaced(path, write, 2.25)
    with pytest.raises(nf.InputError, match=r"file is changed while it was read, .*Read it again") as refused:
        table.numbers(2)
    assert str(path) in str(refused.value)
    assert set(tables_of(path)[0].numbers(2)) == {2.25}


def test_two_readers_of_a_growing_file_read_what_was_there(tmp_path):
    path = tmp_path / "a.csv"
    _text(path, 1.5)
    one, other = tables_of(path)[0], tables_of(path)[0]
    with path.open("a") as file:
        for k in range(60, 4000):
            file.write(f"{0.01 * k:.2f},{0.1 * k:.1f},1.5\n")
            if k % 500 == 0:
                file.flush()
                counts = [len(table.numbers(2)) for table in (one, other)]
                assert min(counts) >= 60 and len(nf.read(path)) >= 60


SECRET, PIN = "hunter2", "4711 0815"
PRIVATE = {
    "netrc": f"machine example.org login anna password {SECRET}4\n",
    "key": f"-----BEGIN OPENSSH PRIVATE KEY-----\nb3BlbnNzaC1r{SECRET}\nxyz\n",
    "settings": f"AWS_KEY={SECRET}\nPORT=8080\n",
    "markup": f"<a><b>{SECRET}</b></a>\n",
    "section": f"[{SECRET}]\nuser={SECRET}1\npass=3\n",
    "rows without header": f"{SECRET};1980;12.5\nOtto;1979;13.5\nEva;1971;14.5\n",
    "header": f"{SECRET} {SECRET}1\n" + "".join(f"{k} {k % 7}\n" for k in range(30)),
    "rows of numbers": "".join(f"{PIN}{k % 3}\n" for k in range(30)),
    "rows with text": "".join(f"{SECRET} {k} {k + 1} text{k}\n" for k in range(30)),
}


@pytest.mark.parametrize("content", PRIVATE.values(), ids=PRIVATE)
def test_no_text_of_a_file_that_is_no_recording_stands_in_its_message(tmp_path, content):
    (tmp_path / "a.txt").write_text(content)
    sought = {}, {"columns": {"force": "hunter"}}, {"columns": {"depth": 1, "time": 2}}, {"segment": {"pin": "1"}}
    reads = [lambda path, options=options: nf.read(path, **options) for options in sought]
    for read in (*reads, nf.steering.read, nf.steering.read_shapes, BaseMotion.read, read_stress, read_bending):
        with pytest.raises(nf.InputError) as refused:
            read(tmp_path / "a.txt")
        message = str(refused.value)
        assert SECRET not in message and not set(PIN.split()) & set(re.findall(r"\w+", message))


def test_options_that_are_a_link_out_of_the_folder_are_read_when_named(tmp_path):
    folder, elsewhere = tmp_path / "recordings", tmp_path / "mine.toml"
    folder.mkdir()
    _text(folder / "a.csv", 1.5)
    elsewhere.write_text('[units]\nforce = "-N"\n')
    (folder / "needleforce.toml").symlink_to(elsewhere)
    with pytest.raises(nf.InputError, match=r"needleforce.toml is a link, leads out of .*--as, or copy it") as refused:
        nf.read(folder / "a.csv")
    assert str(folder) in refused.value.place
    assert nf.read(folder / "a.csv", mapping=folder / "needleforce.toml", baseline=False).force[0] == -1.5
    (folder / "needleforce.toml").unlink()
    (folder / "b.toml").write_text(elsewhere.read_text())
    (folder / "needleforce.toml").symlink_to("b.toml")
    assert nf.read(folder / "a.csv", baseline=False).force[0] == -1.5


@pytest.fixture
def linked(tmp_path):
    """A folder with a recording, a link to it, and links to a recording and to a private file elsewhere."""
    folder, elsewhere = tmp_path / "recordings", tmp_path / "elsewhere"
    folder.mkdir(), elsewhere.mkdir()
    for path in (folder / "a.csv", elsewhere / "b.csv"):
        _text(path, 1.5)
    (elsewhere / "private").write_text(f"{SECRET} 1 2\n")
    (folder / "within.csv").symlink_to("a.csv")
    (folder / "outside.csv").symlink_to(elsewhere / "b.csv")
    (folder / "private.txt").symlink_to(elsewhere / "private")
    return folder


def test_links_out_of_a_folder_are_listed_and_not_opened(linked, monkeypatch):
    import needleforce.files as files

    opened, usual = [], files.os.open
    monkeypatch.setattr(files.os, "open", lambda path, *given: opened.append(str(path)) or usual(path, *given))
    done = campaign(linked, jobs=1)
    assert sorted(each.file for each in done.recordings) == ["a.csv", "within.csv"]
    why = dict(done.not_recordings)
    assert set(why) == {"outside.csv", "private.txt"} and all("a link that leads out" in each for each in why.values())
    assert SECRET not in done.to_json() and not [each for each in opened if "outside" in each or "private" in each]


def test_links_out_of_a_folder_are_read_when_asked(linked):
    found = [each.file for each in campaign(linked, jobs=1, follow_links=True).recordings]
    assert {"a.csv", "outside.csv", "within.csv"} <= set(found)
    assert [each.file for each in campaign([linked / "outside.csv"], jobs=1).recordings] == ["outside.csv"]


@pytest.mark.parametrize("number", ["1_0", "0_1", "1__0", "_1"])
def test_a_number_with_underscores_is_none(tmp_path, number):
    _text(tmp_path / "a.csv", 1.5)
    rows = (tmp_path / "a.csv").read_text()
    (tmp_path / "card.csv").write_text(f"# filter_length: {number}\n{rows}")
    (tmp_path / "cell.csv").write_text(rows.replace("0.30,3.0,1.5", f"0.30,3.0,{number}"))
    for name in ("card.csv", "cell.csv"):
        with pytest.raises(nf.InputError, match=f"{name}, line .* is '{number}', a number is needed"):
            nf.read(tmp_path / name)
    gauges = "axis,unit,g0,g1,g2,g3,g4,g5\n" + "".join(f"{axis},N,1,1,1,1,1,{number}\n" for axis in ("fx", "fy", "fz"))
    (tmp_path / "gauges.csv").write_text(gauges)
    with pytest.raises(nf.InputError, match=f"is '{number}', a number is needed"):
        read_calibration(tmp_path / "gauges.csv")
