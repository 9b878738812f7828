# SPDX-License-Identifier: Apache-2.0
"""A state folder loses nothing that was kept, and belongs to one program at a time."""

import errno
import json
import logging
import os
import socket
import subprocess
import sys

import pytest

import needleforce as nf
from needleforce.state_folder import StateFolder, key_of

OPTIONS = {"model": "None"}


def opened(path, kind="study", **changes) -> StateFolder:
    return StateFolder(path, kind, OPTIONS | changes)


@pytest.fixture
def kept(tmp_path):
    """A folder with ten results."""
    with opened(tmp_path / "state") as state:
        for k in range(10):
            state.keep(key_of(k), bytes([k]) * 1000, task="square", name=str(k))
    return tmp_path / "state"


def whole(path) -> list[int]:
    with StateFolder(path, "study") as state:
        return [k for k in range(10) if state.result(key_of(k)) == bytes([k]) * 1000]


def test_what_is_kept_is_there(kept):
    assert whole(kept) == list(range(10))
    lines = [json.loads(line) for line in (kept / "tasks.jsonl").read_text().splitlines()]
    assert [line["name"] for line in lines] == list(map(str, range(10)))
    assert key_of({"a": 1, "b": 2}) == key_of({"b": 2, "a": 1}) != key_of({"a": 1, "b": 3})


@pytest.mark.parametrize("name", ["tasks.jsonl", "results"])
@pytest.mark.parametrize("cut", [1, 150, 700])
def test_a_program_killed_while_it_writes_loses_only_that(kept, name, cut):
    content = (kept / name).read_bytes()
    (kept / name).write_bytes(content[:-cut])
    before = whole(kept)
    assert before == list(range(len(before))) and len(before) >= 4
    with opened(kept) as state:  # which continues after it
        state.keep(key_of(9), bytes([9]) * 1000, task="square")
    assert whole(kept) == [*(k for k in before if k != 9), 9]


def test_changed_bytes_are_not_taken(kept):
    content = bytearray((kept / "results").read_bytes())
    content[3500] ^= 1
    (kept / "results").write_bytes(content)
    assert whole(kept) == [0, 1, 2, 4, 5, 6, 7, 8, 9]


def test_one_program_at_a_time(kept):
    with opened(kept):
        with pytest.raises(nf.InputError, match=rf"in use by process {os.getpid()}.*one program at a time"):
            opened(kept)
        assert whole(kept) == list(range(10))  # reading is possible
    opened(kept).close()


def test_the_lock_of_a_program_that_ended_is_taken(kept, caplog):
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    lock = {"pid": ended.pid, "host": socket.gethostname(), "token": "x"}
    (kept / "lock").write_text(json.dumps(lock))
    with opened(kept), caplog.at_level(logging.WARNING):
        pass
    assert f"process {ended.pid} ended" in caplog.text and not (kept / "lock").exists()
    (kept / "lock").write_text(json.dumps(lock | {"host": "elsewhere"}))
    with pytest.raises(nf.InputError, match=r"on elsewhere.*remove the file lock"):
        opened(kept)


def test_a_changed_option_is_reported(kept, caplog):
    with caplog.at_level(logging.WARNING):
        opened(kept).close()
        assert not caplog.records
        opened(kept, model="'maurin'").close()
    assert "model was None and is now 'maurin'" in caplog.text


def test_folders_of_something_else_are_refused(kept, tmp_path):
    with pytest.raises(nf.InputError, match=r"of a study.*to be of a campaign"):
        opened(kept, "campaign")
    (tmp_path / "photo.jpg").touch()
    with pytest.raises(nf.InputError, match="a folder with other files"):
        opened(tmp_path)
    with pytest.raises(nf.InputError, match="not usable"):
        opened(tmp_path / "photo.jpg")
    with pytest.raises(nf.InputError, match=r"not usable.*No such file"):
        opened(tmp_path / "gone" / "state")
    with pytest.raises(nf.InputError, match="nothing kept yet"):
        StateFolder(tmp_path / "gone", "study")
    (kept / "state.json").write_text("{")
    with pytest.raises(nf.InputError, match="damaged"):
        opened(kept)


def test_on_a_full_disk_the_work_continues(kept, caplog):
    class Full:
        def write(self, _):
            raise OSError(errno.ENOSPC, "No space left on device")

        seek = read = flush = close = lambda *_: 0

    state = opened(kept)
    state._results.close()
    state._results = Full()
    with caplog.at_level(logging.WARNING):
        for k in (10, 11):
            state.keep(key_of(k), b"x", task="square")
    state.close()
    assert caplog.text.count("No space left on device") == 1 and whole(kept) == list(range(10))
