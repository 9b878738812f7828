# SPDX-License-Identifier: Apache-2.0
"""Files that are written: complete or unchanged, whoever else writes; and text that no spreadsheet evaluates."""

import csv
import os
import stat
import subprocess
import sys
import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from plain_insertion import insertion

import needleforce as nf
from needleforce.errors import InputError, printable
from needleforce.files import atomic_write, csv_original, csv_text
from needleforce.recording import Card, Recording, read, write

posix = pytest.mark.skipif(os.name != "posix", reason="links and permissions of POSIX")


def left_over(folder, *kept) -> list[str]:
    return sorted({each.name for each in folder.iterdir()} - set(kept))


@posix
def test_a_link_of_any_name_in_the_folder_is_not_followed(tmp_path, monkeypatch):
    victim, target = tmp_path / "victim", tmp_path / "out.csv"
    victim.write_text("precious")
    (tmp_path / f".out.csv.{os.getpid()}.part").symlink_to(victim)
    monkeypatch.setattr("needleforce.files.secrets.token_hex", lambda _: "guessed")
    (tmp_path / ".guessed.part").symlink_to(victim)
    with pytest.raises(InputError, match="File exists"):
        with atomic_write(target) as file:
            file.write("new")
    assert victim.read_text() == "precious" and not target.exists()
    monkeypatch.undo()
    with atomic_write(target) as file:
        file.write("new")
    assert victim.read_text() == "precious" and target.read_text() == "new"


def test_threads_that_write_one_file_leave_one_complete_file(tmp_path):
    target, errors, seen = tmp_path / "out.txt", [], set()

    def writing(mark):
        for _ in range(60):
            try:
                with atomic_write(target) as file:
                    for _ in range(200):
                        file.write(mark * 500)
                seen.add(target.read_text())
            except Exception as error:
                errors.append(error)

    threads = [threading.Thread(target=writing, args=(mark,)) for mark in "abcd"]
    [each.start() for each in threads]
    [each.join() for each in threads]
    assert not errors and {(len(text), len(set(text))) for text in seen} == {(100_000, 1)}
    assert not left_over(tmp_path, "out.txt")


def test_programs_that_write_one_file_leave_one_complete_file(tmp_path):
    code = (
        "import sys\nfrom needleforce.files import atomic_write\n"
        "for _ in range(50):\n with atomic_write(sys.argv[1]) as file:\n"
        "  [file.write(sys.argv[2] * 500) for _ in range(200)]\n"
    )
    target = tmp_path / "out.txt"
    writers = [subprocess.Popen([sys.executable, "-c", code, target, mark]) for mark in "ab"]
    while any(each.poll() is None for each in writers):
        if target.exists():
            text = target.read_text()
            assert len(text) == 100_000 and len(set(text)) == 1
    assert [each.wait() for each in writers] == [0, 0] and not left_over(tmp_path, "out.txt")


@posix
@pytest.mark.parametrize("name", ["run.csv", "run.parquet", "run.mcap"])
def test_the_permissions_of_the_target_are_kept_while_and_after_writing(tmp_path, name, monkeypatch):
    if name.endswith("parquet"):
        pytest.importorskip("pyarrow")
    time, depth, force = insertion(rate=50.0)
    recording, target = Recording(time=time, depth=depth, force=force), tmp_path / name
    monkeypatch.setattr(
        os, "replace", lambda part, to, own=os.replace: (modes.append(os.stat(part).st_mode), own(part, to))
    )
    modes, usual = [], os.umask(0o027)
    try:
        write(recording, target)
        assert stat.S_IMODE(target.stat().st_mode) == 0o640
        target.chmod(0o600)
        write(recording, target)
        assert stat.S_IMODE(target.stat().st_mode) == 0o600 and stat.S_IMODE(modes[-1]) == 0o600
    finally:
        os.umask(usual)
    assert not left_over(tmp_path, name) and len(read(target)) == len(time)


@pytest.mark.parametrize("error", [OSError("full"), KeyError("x"), KeyboardInterrupt()])
def test_after_an_error_the_old_file_is_there_and_nothing_else(tmp_path, error):
    target = tmp_path / "out.txt"
    target.write_text("old")
    with pytest.raises((InputError, KeyError, KeyboardInterrupt)), atomic_write(target) as file:
        file.write("new")
        raise error
    assert target.read_text() == "old" and not left_over(tmp_path, "out.txt")


@posix
def test_a_link_as_target_is_written_through_and_a_loop_of_links_is_refused(tmp_path):
    real, link, loop = tmp_path / "real", tmp_path / "link", tmp_path / "loop"
    link.symlink_to(real)
    with atomic_write(link) as file:
        file.write("x")
    assert real.read_text() == "x" and link.is_symlink()
    loop.symlink_to(loop)
    with pytest.raises(InputError), atomic_write(loop):
        pass


@pytest.mark.parametrize(
    "text", ["=1+1", "+a", "-a", "@a", "\t=1", "\r=1", "\n=1", "＝1", "'=1", "''=1", '=HYPERLINK("http://x")']
)
def test_text_that_begins_a_formula_is_quoted_and_read_back(text):
    assert csv_text(text) == "'" + text and csv_original(csv_text(text)) == text


@pytest.mark.parametrize("text", ["", "gel", "-5", "+3.5e-2", "'a", "a=1", "5", "run_1.csv"])
def test_other_text_and_numbers_are_written_as_they_are(text):
    assert csv_text(text) == text and csv_original(text) == text


@given(st.text(alphabet="'=+-@\t\r\na1", max_size=6))
def test_every_text_is_read_back(text):
    assert csv_original(csv_text(text)) == text


def test_no_cell_of_a_recording_is_a_formula(tmp_path):
    time, depth, force = insertion(rate=50.0)
    card = Card(needle="18 G,=HYPERLINK(1);@x", tissue='a,"=1+1",-2', rig="plain, -5 N")
    back = read(write(Recording(time=time, depth=depth, force=force, card=card), tmp_path / "x.csv"))
    assert (back.card.needle, back.card.tissue, back.card.rig) == (card.needle, card.tissue, card.rig)
    head = [line for line in (tmp_path / "x.csv").read_text().splitlines() if line.startswith("#")]
    for delimiter in ",;\t":
        assert not [
            cell for row in csv.reader(head, delimiter=delimiter) for cell in row if cell[:1] in ("=", "+", "-", "@")
        ]


def test_a_mapping_with_quoted_text_gives_the_original(tmp_path):
    from needleforce.campaign.labels import read_mapping

    path = tmp_path / "map.csv"
    path.write_text("file,specimen\n'=a.csv,'@gel\n")
    assert read_mapping(path) == {"=a.csv": {"specimen": "@gel"}}


def test_what_a_terminal_obeys_is_written_out():
    assert printable("a\x1b[2J\x9b\x7f\u202eb\x00\udcff\n\tc\r\n") == "a\\x1b[2J\\x9b\\x7f\\u202eb\\x00\\xff\n\tc\n"
    error = InputError("x\x1b]0;t\x07", "a\nneedleforce: done", place="\u2066f")
    assert str(error) == "\\u2066f: x\\x1b]0;t\\x07 is a needleforce: done." and error.value == "a\nneedleforce: done"
    assert len(str(InputError("x" * 10**7))) < 3000 and isinstance(error, nf.InputError)


def test_a_large_array_in_an_error_is_cut():
    assert len(str(InputError("x", list(np.arange(10**5))))) < 3000
