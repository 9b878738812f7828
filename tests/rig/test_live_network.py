# SPDX-License-Identifier: Apache-2.0
"""The rig as a plain client on the network sees it: raw sockets, no part of the recorder."""

import http.client
import socket
import struct
import threading
import time
from contextlib import contextmanager

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
        assert time.monotonic() < end, "in vain"
        time.sleep(5e-3)


def test_the_bytes_of_a_stream():
    with VirtualRig() as rig, sensor(rig, START) as made:
        got = records(made, 300)
        assert {address for _, address in got} == {("127.0.0.1", rig.sensor_port)} and {len(d) for d, _ in got} == {36}
        rows = [struct.unpack(">IIIiiiiii", data) for data, _ in got]
        assert [row[0] for row in rows] == list(range(1, 301))
        assert {b[1] - a[1] for a, b in zip(rows, rows[1:])} == {7} and {row[2] for row in rows} == {0}  # noqa: RUF007
        assert all(abs(count) < 400_000 for row in rows for count in row[3:])  # 0.3 N of bias, noise, 1e6 a newton
        made.sendto(STOP, ("127.0.0.1", rig.sensor_port))
        until(lambda: not rig.simulated.transfer.streaming)


def test_so_many_as_asked_for_and_buffered():
    with VirtualRig() as rig, sensor(rig, struct.pack(">HHI", 0x1234, 3, 50)) as made:
        assert [len(data) for data, _ in records(made, 2)] == [40 * 36, 10 * 36]
        until(lambda: not rig.simulated.transfer.streaming)


def test_the_last_who_asks_gets_the_stream_and_nobody_else_ends_it():
    with VirtualRig() as rig, sensor(rig, START) as first:
        records(first, 20)
        with sensor(rig, START) as second:
            assert struct.unpack(">I", records(second, 1)[0][0][:4]) == (1,)
            first.sendto(STOP, ("127.0.0.1", rig.sensor_port))
            first.sendto(b"garbage", ("127.0.0.1", rig.sensor_port))
            until(lambda: rig.truth().garbage == 1)
            assert len(records(second, 50)) == 50
        assert len(rig.truth().streams) == 2


def test_what_a_client_sees_is_what_the_ledger_says():
    faults = dict.fromkeys(("lost", "doubled", "reordered", "late", "foreign", "wrong_size"), 0.1)
    with VirtualRig(faults=faults) as rig, sensor(rig, struct.pack(">HHI", 0x1234, 2, 1000)) as made:
        until(lambda: not rig.simulated.transfer.streaming)
        made.settimeout(0.3)
        got, foreign, odd = [], 0, 0
        while True:
            try:
                data, address = made.recvfrom(4096)
            except TimeoutError:
                break
            foreign += address[1] != rig.sensor_port
            odd += len(data) % 36 != 0 or not data
            if address[1] == rig.sensor_port and len(data) == 36:
                got.append(struct.unpack(">I", data[:4])[0])
        ledger = rig.truth().streams[0]
    assert set(range(1, 1001)) - set(got) == set(ledger.lost) and ledger.lost
    assert sorted(got) == sorted([*set(got), *ledger.doubled]) and ledger.doubled
    assert (foreign, odd) == (ledger.foreign, ledger.wrong_size) and foreign and odd


def test_the_page_and_nothing_else():
    with VirtualRig() as rig:
        connection = http.client.HTTPConnection("127.0.0.1", rig.page_port, timeout=PATIENCE)
        for path, status in (("/netftapi2.xml", 200), ("/../../etc/passwd", 404), ("/", 404)):
            connection.request("GET", path)
            response = connection.getresponse()
            page = response.read()
            assert response.status == status and (b"<cfgcpf>1000000</cfgcpf>" in page) == (status == 200)
        connection.close()


def test_a_client_that_says_nothing_to_the_page_holds_nothing_up():
    with VirtualRig() as rig, socket.create_connection(("127.0.0.1", rig.page_port)):
        with sensor(rig, START) as made:
            records(made, 20)


def test_lines_of_the_axis():
    with VirtualRig() as rig, axis(rig) as (made, lines):
        assert lines.readline() == "axis -0.03 0.07 0.05 0.01\n"
        made.sendall(b"move 0.0 0.003\nmove 1 1\nhello\nalive\r\nstop\n\xff\xfe\n")
        said = [answer(lines) for _ in range(6)]
        assert said[0] == "ok move" and said[1].startswith("refused move depth") and said[2].startswith("refused line")
        assert said[3:5] == ["ok alive", "ok stop"] and said[5].startswith("refused line")
        numbers = [int(answer(lines, "state").split()[1]) for _ in range(5)]
        assert numbers == list(range(numbers[0], numbers[0] + 5))


def test_a_second_client_is_told_and_let_go():
    with VirtualRig() as rig, axis(rig) as (made, lines), axis(rig) as (_, others):
        assert others.read() == "refused connection another client has the axis\n"
        made.sendall(b"alive\n")
        assert answer(lines) == "ok alive"


def test_a_line_without_end_ends_the_connection_and_the_next_client_is_served():
    with VirtualRig() as rig:
        with axis(rig) as (made, lines):
            made.sendall(b"x" * 5000)
            assert "refused line too long\n" in lines.read()
        with axis(rig) as (_, lines):
            assert answer(lines, "axis")


def test_an_axis_whose_client_is_gone_stops():
    with VirtualRig() as rig:
        with axis(rig) as (made, lines):
            made.sendall(b"move 0.06 0.05\n")
            answer(lines)
            until(lambda: rig.simulated.axis.condition == "moving")
        until(lambda: rig.simulated.axis.condition == "idle")
        assert rig.simulated.axis.motor < 0.05


def test_a_client_that_reads_nothing_holds_nothing_up():
    with VirtualRig() as rig, axis(rig) as (made, _), sensor(rig, START) as other:
        made.sendall(b"alive\n" * 2000)
        records(other, 200)


@pytest.mark.parametrize("cut", ["power_cut_s", "axis_silent_at_s"])
def test_what_falls_silent_says_nothing_more(cut):
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
def test_an_address_that_is_none_is_refused(wrong):
    with pytest.raises(InputError):
        VirtualRig(**wrong).__enter__()


def test_listening_beyond_this_computer_is_warned_of():
    said = []
    with VirtualRig(listen="0.0.0.0", say=said.append):
        assert said[0].startswith("warning: listening at 0.0.0.0")
    with VirtualRig(say=(quiet := []).append):
        assert not quiet
