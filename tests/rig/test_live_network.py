# SPDX-License-Identifier: Apache-2.0
"""The rig on the network, tested with raw sockets and without the recorder."""

import http.client
import socket
import struct
import threading
import time
from contextlib import ExitStack, contextmanager

import pytest

from needleforce import InputError
from needleforce.rig.live import VirtualRig

START, BUFFERED, STOP, BIAS = (struct.pack(">HHI", 0x1234, command, 0) for command in (2, 3, 0, 0x42))
PATIENCE = 10.0  # [s] before a test gives up


@pytest.fixture(autouse=True)
def no_thread_is_left():
    before = set(threading.enumerate())
    yield
    assert set(threading.enumerate()) <= before


@contextmanager
def sensor(rig, *requests):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as made:
        made.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        made.bind(("127.0.0.1", 0))
        made.settimeout(PATIENCE)
        for request in requests:
            made.sendto(request, ("127.0.0.1", rig.sensor_port))
        yield made


@contextmanager
def axis(rig):
    with socket.create_connection(("127.0.0.1", rig.axis_port), PATIENCE) as made, made.makefile("r") as lines:
        yield made, lines


def records(made, count):
    """Datagrams with their addresses."""
    return [made.recvfrom(4096) for _ in range(count)]


def answer(lines, word=("ok", "refused")):
    return next(line.strip() for line in lines if line.startswith(word))


def until(condition):
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "timeout"
        time.sleep(5e-3)


def test_a_stream_has_the_published_bytes():
    with VirtualRig() as rig, sensor(rig, START) as made:
        got = records(made, 300)
        assert {address for _, address in got} == {("127.0.0.1", rig.sensor_port)} and {len(d) for d, _ in got} == {36}
        rows = [struct.unpack(">IIIiiiiii", data) for data, _ in got]
        assert [row[0] for row in rows] == list(range(1, 301))
        assert {b[1] - a[1] for a, b in zip(rows, rows[1:])} == {7} and {row[2] for row in rows} == {0}  # noqa: RUF007
        assert all(abs(count) < 400_000 for row in rows for count in row[3:])  # 0.3 N of bias, noise, 1e6 a newton
        made.sendto(STOP, ("127.0.0.1", rig.sensor_port))
        until(lambda: not rig.simulated.transfer.streaming)


def test_a_buffered_stream_has_the_requested_number_of_records():
    with VirtualRig() as rig, sensor(rig, struct.pack(">HHI", 0x1234, 3, 50)) as made:
        assert [len(data) for data, _ in records(made, 2)] == [40 * 36, 10 * 36]
        until(lambda: not rig.simulated.transfer.streaming)


def test_the_last_client_gets_the_stream_and_no_other_client_ends_it():
    with VirtualRig() as rig, sensor(rig, START) as first:
        records(first, 20)
        with sensor(rig, START) as second:
            assert struct.unpack(">I", records(second, 1)[0][0][:4]) == (1,)
            first.sendto(STOP, ("127.0.0.1", rig.sensor_port))
            first.sendto(b"garbage", ("127.0.0.1", rig.sensor_port))
            until(lambda: rig.truth().garbage == 1)
            assert len(records(second, 50)) == 50
        assert len(rig.truth().streams) == 2


def test_a_client_receives_what_the_ground_truth_states():
    faults = dict.fromkeys(("lost", "duplicated", "reordered", "late", "foreign", "wrong_size"), 0.1)
    with VirtualRig(faults=faults) as rig, sensor(rig, struct.pack(">HHI", 0x1234, 2, 1000)) as made:
        until(lambda: not rig.simulated.transfer.streaming)
        made.settimeout(0.3)
        got, foreign, wrong_size = [], 0, 0
        while True:
            try:
                data, address = made.recvfrom(4096)
            except TimeoutError:
                break
            foreign += address[1] != rig.sensor_port
            wrong_size += len(data) % 36 != 0 or not data
            if address[1] == rig.sensor_port and len(data) == 36:
                got.append(struct.unpack(">I", data[:4])[0])
        truth = rig.truth().streams[0]
    assert set(range(1, 1001)) - set(got) == set(truth.lost) and truth.lost
    assert sorted(got) == sorted([*set(got), *truth.duplicated]) and truth.duplicated
    assert (foreign, wrong_size) == (truth.foreign, truth.wrong_size) and foreign and wrong_size


def test_only_the_configuration_page_is_served():
    with VirtualRig() as rig:
        for path, status in (("/netftapi2.xml", 200), ("/../../etc/passwd", 404), ("/", 404)):
            connection = http.client.HTTPConnection("127.0.0.1", rig.page_port, timeout=PATIENCE)
            connection.request("GET", path)
            response = connection.getresponse()
            page = response.read()
            assert response.status == status and (b"<cfgcpf>1000000</cfgcpf>" in page) == (status == 200)
            connection.close()


@pytest.mark.parametrize("text", [b"", b"GET /netft", b"GET " + 9000 * b"x", b"\r\n\r\n", b"\xff\xfe\r\n\r\n"])
def test_invalid_clients_of_the_page_do_not_block_the_rig(text):
    with VirtualRig() as rig, ExitStack() as stack:
        for _ in range(12):
            stack.enter_context(socket.create_connection(("127.0.0.1", rig.page_port), PATIENCE)).sendall(text)
        with socket.create_connection(("127.0.0.1", rig.page_port), PATIENCE) as made, sensor(rig, START) as other:
            for part in (b"GET /netft", b"api2.xml HTTP/1.1\r\nHost: x\r\n", b"\r\n"):
                made.sendall(part)
                records(other, 5)
            assert made.makefile("rb").read().startswith(b"HTTP/1.1 200 OK\r\n")


def test_commands_to_the_axis_are_answered():
    with VirtualRig() as rig, axis(rig) as (made, lines):
        assert lines.readline() == "axis -0.03 0.07 0.05 0.01 1\n"
        made.sendall(b"move 0.0 0.003\nmove 1 1\nhello\nalive\r\nstop\n\xff\xfe\n")
        text = [answer(lines) for _ in range(6)]
        assert text[0] == "ok move" and text[1].startswith("refused move depth") and text[2].startswith("refused line")
        assert text[3:5] == ["ok alive", "ok stop"] and text[5].startswith("refused line")
        numbers = [int(answer(lines, "state").split()[1]) for _ in range(5)]
        assert numbers == list(range(numbers[0], numbers[0] + 5))


def test_a_second_client_is_refused_with_the_reason():
    with VirtualRig() as rig, axis(rig) as (made, lines), axis(rig) as (_, others):
        assert others.read() == "refused connection another client has the axis\n"
        made.sendall(b"alive\n")
        assert answer(lines) == "ok alive"


def test_a_line_too_long_ends_the_connection_and_the_next_client_is_served():
    with VirtualRig() as rig:
        with axis(rig) as (made, lines):
            made.sendall(b"x" * 5000)
            assert "refused line too long\n" in lines.read()
        with axis(rig) as (_, lines):
            assert answer(lines, "axis")


def test_an_axis_without_its_client_stops():
    with VirtualRig() as rig:
        with axis(rig) as (made, lines):
            made.sendall(b"move 0.06 0.05\n")
            answer(lines)
            until(lambda: rig.simulated.axis.condition == "moving")
        until(lambda: rig.simulated.axis.condition == "idle")
        assert rig.simulated.axis.motor < 0.05


def test_a_client_that_does_not_read_does_not_block_the_rig():
    with VirtualRig() as rig, axis(rig) as (made, _), sensor(rig, START) as other:
        made.sendall(b"alive\n" * 2000)
        records(other, 200)


@pytest.mark.parametrize("cut", ["power_cut_s", "axis_silent_at_s"])
def test_a_silent_axis_sends_nothing_more(cut):
    with VirtualRig(faults={cut: 0.3}) as rig, axis(rig) as (made, lines), sensor(rig, START) as other:
        if cut == "power_cut_s":
            with pytest.raises(OSError):  # reset, no goodbye
                lines.read()
            assert rig.ended.wait(PATIENCE)
            with pytest.raises(OSError):
                socket.create_connection(("127.0.0.1", rig.axis_port), 1.0)
        else:
            made.settimeout(0.5)
            with pytest.raises(TimeoutError):
                while True:
                    lines.readline()
            assert len(records(other, 400)) == 400


@pytest.mark.parametrize("option", ["sensor", "axis", "page"])
def test_a_port_in_use_is_named_with_its_option(option):
    kind = socket.SOCK_DGRAM if option == "sensor" else socket.SOCK_STREAM
    with socket.socket(socket.AF_INET, kind) as taken:
        taken.bind(("127.0.0.1", 0))
        if option != "sensor":
            taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(InputError, match=f"--{option}-port is {port}, in use"):
            with VirtualRig(**{f"{option}_port": port}):
                pass
    with VirtualRig(**{f"{option}_port": port}):  # nothing was left open
        pass


@pytest.mark.parametrize(
    "wrong", [{"axis_port": -1}, {"page_port": 70_000}, {"sensor_port": 65_536}, {"listen": "256.0.0.1"}]
)
def test_an_invalid_address_is_refused(wrong):
    with pytest.raises(InputError):
        VirtualRig(**wrong).__enter__()


def test_listening_beyond_this_computer_is_warned_of():
    text = []
    with VirtualRig(listen="0.0.0.0", say=text.append):
        assert text[0].startswith("warning: listening at 0.0.0.0")
    with VirtualRig(say=(quiet := []).append):
        assert not quiet
