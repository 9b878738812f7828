# SPDX-License-Identifier: Apache-2.0
import os
import random
import signal
import subprocess
import sys
import textwrap
import time

import plain_log
import pytest
from mcap.reader import make_reader
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

import needleforce as nf
from needleforce.recording.log import LogWriter, read_log


def test_another_reader_sees_every_message_as_written(tmp_path):
    path = tmp_path / "run.mcap"
    plain_log.write(path, count=300, first=2**32 - 5)
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True)
        assert reader.get_header().profile == "ros2"
        metadata = {each.name: each.metadata for each in reader.iter_metadata()}
        run = metadata["needleforce.part"]["run"]
        assert metadata == {
            "needleforce": plain_log.CARD,
            "needleforce.part": {"run": run, "part": "1", "start_s": "0.0"},
            "needleforce.end": {"why": "done"},
        }
        messages = [each for _, channel, each in reader.iter_messages() if channel.topic == "/needle/wrench"]
        summary = reader.get_summary()
    assert summary.statistics.message_count == 300 + 19
    assert {each.encoding for each in summary.schemas.values()} == {"ros2msg"}
    assert {each.message_encoding for each in summary.channels.values()} == {"cdr"}
    assert len(messages) == 300
    for number, each in enumerate(messages):
        stamp = plain_log.START + number * 1_000_000
        assert each.sequence == (2**32 - 5 + number) % 2**32
        assert (each.log_time, each.publish_time) == (stamp + plain_log.DELAY, number * 1_000_000)


def test_rosbags_decodes_every_message_by_the_schemas_in_the_file(tmp_path):
    path = tmp_path / "run.mcap"
    log = plain_log.write(path, close=False)
    log.mark(plain_log.START, "phase", name="insertion é")
    log.close({})
    store = get_typestore(Stores.EMPTY)  # it contains only the messages of the file
    with Reader(path) as reader:
        for connection in reader.connections:
            store.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
        seen = {"/needle/wrench": [], "/needle/axis": [], "/needle/marks": []}
        for connection, _, data in reader.messages():
            seen[connection.topic].append(store.deserialize_cdr(data, connection.msgtype))
    assert len(seen["/needle/wrench"]) == 500
    for number, each in enumerate(seen["/needle/wrench"]):
        force, torque = each.wrench.force, each.wrench.torque
        assert (force.x, force.y, force.z, torque.x, torque.y, torque.z) == plain_log.wrench(number)
        assert each.header.stamp.sec * 10**9 + each.header.stamp.nanosec == plain_log.START + number * 1_000_000
        assert each.header.frame_id == "needle"
    for number, each in enumerate(seen["/needle/axis"]):
        assert (each.name, list(each.position), list(each.velocity)) == (["needle"], [16e-6 * number], [1e-3])
        assert len(each.effort) == 0
    assert [each.data for each in seen["/needle/marks"]] == ['{"kind": "phase", "name": "insertion \\u00e9"}']


def test_nothing_is_overwritten(tmp_path):
    path = tmp_path / "run.mcap"
    path.write_text("mine")
    with pytest.raises(nf.InputError, match="nothing is overwritten"):
        LogWriter(path, {})
    assert path.read_text() == "mine"


@pytest.mark.parametrize("name", ["nowhere/run.mcap", "", "a\0b"])
def test_a_file_that_cannot_be_created_is_refused(tmp_path, name):
    with pytest.raises(nf.InputError):
        LogWriter(tmp_path / name, {})


def test_a_closed_file_does_not_change(tmp_path):
    path = tmp_path / "run.mcap"
    log = plain_log.write(path)
    before = path.read_bytes()
    log.close({"why": "again"})
    with pytest.raises(nf.InputError, match="closed"):
        log.flush()
    assert path.read_bytes() == before


def run(code: str, *arguments, **options):
    head = f"import sys; sys.path.insert(0, {os.path.dirname(__file__)!r})\n"
    return subprocess.Popen([sys.executable, "-c", head + textwrap.dedent(code), *map(str, arguments)], **options)


def test_a_full_disk_keeps_complete_records(tmp_path):
    """A limit on the file's size acts like a full disk: a write fails."""
    path = tmp_path / "run.mcap"
    code = """
        import resource
        import needleforce as nf
        import plain_log
        resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))
        try:
            plain_log.write(sys.argv[1], count=20_000)
        except nf.InputError as error:
            print(error)
        """
    process = run(code, path, stdout=subprocess.PIPE, text=True)
    message = process.communicate(timeout=600)[0]
    kept = int(message.split("; ")[1].split()[0])
    log = read_log(path)
    assert "ended early" in message and str(path) in message
    assert not log.complete and path.stat().st_size <= 60_000
    assert len(log.wrench) + len(log.axis) >= kept > 500
    assert "cut_off" not in {note.kind for note in log.notes}  # the record that did not fit is removed
    assert [tuple(each) for each in log.wrench.values] == [plain_log.wrench(n) for n in range(len(log.wrench))]


def test_a_full_disk_at_the_start_leaves_no_file(tmp_path):
    path = tmp_path / "run.mcap"
    code = """
        import resource
        import plain_log
        resource.setrlimit(resource.RLIMIT_FSIZE, (4, 4))
        plain_log.write(sys.argv[1])
        """
    process = run(code, path, stderr=subprocess.PIPE, text=True)
    assert "not started" in process.communicate(timeout=600)[1]
    assert not path.exists()


@pytest.mark.parametrize("seed", range(4))
def test_flushed_data_survive_a_kill(tmp_path, seed):
    path = tmp_path / "run.mcap"
    code = """
        from needleforce.recording.log import LogWriter
        import plain_log
        log, number = LogWriter(sys.argv[1], {}), 0
        while True:
            log.wrench(number, number, number, number, plain_log.wrench(number))
            number += 1
            if number % 50 == 0:
                log.flush()
                print(number, flush=True)
        """
    process = run(code, path, stdout=subprocess.PIPE, text=True)
    process.stdout.readline()
    time.sleep(random.Random(seed).uniform(0.0, 0.2))
    process.send_signal(signal.SIGKILL)
    lines = [line for line in process.communicate(timeout=600)[0].splitlines(keepends=True) if line.endswith("\n")]
    flushed = int(lines[-1]) if lines else 50
    log = read_log(path)
    assert len(log.wrench) >= flushed and not log.complete
    assert log.wrench.values[:, 2].tolist() == [1e-3 * number for number in range(len(log.wrench))]
