"""The clients without a recorder: addresses, foreign packets, configuration, and invalid lines of an axis."""

import contextlib
import http.server
import socket
import sys
import threading
import time

import numpy as np
import pytest
from fake_rig import BIAS, CONFIGURATION, FakeAxis, FakeSensor, counts, until

from needleforce import InputError
from needleforce.acquisition.sources import net_ft_sensor
from needleforce.acquisition.sources.axis import AxisClient
from needleforce.acquisition.sources.net_ft_sensor import SensorClient, read_configuration
from needleforce.wire.net_ft import Packet, pack_record


def received(client, count):
    samples = []
    until(lambda: samples.extend(client.receive(0.1)) or len(samples) >= count)
    return samples


def test_counts_become_newtons_and_times_increase():
    with FakeSensor() as sensor:
        client = SensorClient("127.0.0.1", sensor.port, CONFIGURATION)
        client.start()
        samples = received(client, 50)
        client.stop()
    assert samples[0].wrench[:2] == pytest.approx(BIAS[:2], abs=5e-4)
    assert samples[0].wrench[3:] == pytest.approx(BIAS[3:], abs=5e-6)
    assert all(sample.read >= sample.arrival > 0 for sample in samples)
    assert [sample.device for sample in samples] == [2_000_000 * sample.sequence for sample in samples]


def test_waiting_packets_have_the_kernels_time_of_arrival():
    with FakeSensor() as sensor:
        client = SensorClient("127.0.0.1", sensor.port, CONFIGURATION)
        client.start()
        until(lambda: sensor.sent >= 20)
        time.sleep(0.1)
        samples = received(client, 20)
        client.stop()
    waits = [sample.read - sample.arrival for sample in samples]
    assert waits[0] > 50_000_000  # it waited in the buffer while this program slept
    assert samples[0].arrival < samples[-1].arrival


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux counts the packets that its kernel dropped")
def test_packets_dropped_by_the_kernel_are_counted(monkeypatch):
    def narrow(receiver):
        receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 20_000)
        return receiver.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)

    monkeypatch.setattr(net_ft_sensor, "_enlarged_buffer", narrow)
    with FakeSensor(packets=lambda sensor, k: 20 * [sensor.packet(k)] if k < 30 else [sensor.packet(k)]) as sensor:
        client = SensorClient("127.0.0.1", sensor.port, CONFIGURATION)
        client.start()
        until(lambda: sensor.sent > 30)  # 600 packets came meanwhile
        first = received(client, 1)
        samples = first + received(client, 100)
        client.stop()
    came = sum(sample.sequence < 30 for sample in samples)
    assert client.dropped >= 570 - came > 0 and client.buffer < 0.1


def test_packets_from_other_addresses_are_counted_and_left_out():
    with FakeSensor(ends=5) as sensor, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        client = SensorClient("127.0.0.1", sensor.port, CONFIGURATION)
        client.start()
        received(client, 5)
        port = client._socket.getsockname()
        assert port[0] == "127.0.0.1"
        for _ in range(3):
            other.sendto(pack_record(Packet(1, 1, 0, counts(BIAS))), port)
        assert received_nothing(client)
        client.stop()
    assert (client.foreign, client.wrong_size) == (3, 0)


def test_corrupted_packets_are_counted_and_do_not_end_the_stream():
    random = np.random.default_rng(1)
    sent = []

    def packets(sensor, k):
        data = bytearray(pack_record(sensor.packet(k)))
        for place in random.integers(0, len(data), 3):
            data[place] = random.integers(0, 256)
        data = bytes(data[: random.integers(0, 37)] if k % 3 else data * random.integers(1, 4))
        sent.append(len(data))
        return [data]

    with FakeSensor(packets=packets, ends=400) as sensor:
        client = SensorClient("127.0.0.1", sensor.port, CONFIGURATION)
        client.start()
        flat, came = [], [None]
        while len(sent) < 400 or came:
            came = client.receive(0.2)
            flat += came
        client.stop()
    assert client.wrong_size == sum(size == 0 or size % 36 != 0 for size in sent)
    assert len(flat) == sum(size // 36 for size in sent if size % 36 == 0)
    assert all(np.isfinite(sample.wrench).all() and sample.device >= 0 for sample in flat)


def received_nothing(client):
    samples = []
    until(lambda: samples.extend(client.receive(0.1)) or client.foreign == 3)
    return not samples


def test_a_client_can_be_restarted():
    with FakeSensor() as sensor:
        client = SensorClient("127.0.0.1", sensor.port, CONFIGURATION)
        for _ in range(2):
            client.start()
            assert received(client, 3)
            client.stop()
        client.stop()
    assert client.restart <= 1


@pytest.mark.parametrize("host, port", [("no such host", 1), ("127.0.0.1", 70000), ("a..b", 5)])
def test_invalid_addresses_are_refused(host, port):
    with pytest.raises(InputError, match="not reached"):
        SensorClient(host, port, CONFIGURATION)
    with pytest.raises(InputError, match="not reached"):
        AxisClient(host, port)


def test_the_configuration_is_read_from_a_file_and_from_a_server(tmp_path):
    file = tmp_path / "page.xml"
    file.write_bytes(CONFIGURATION.xml())
    assert read_configuration("", str(file)) == CONFIGURATION

    class Page(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200 if self.path.endswith("netftapi2.xml") else 404)
            self.end_headers()
            self.wfile.write(CONFIGURATION.xml() if self.path == "/netftapi2.xml" else b"<" * 300_000)

        def log_message(self, *_):
            pass

    with http.server.HTTPServer(("127.0.0.1", 0), Page) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        host = f"127.0.0.1:{server.server_port}"
        try:
            assert read_configuration(host) == CONFIGURATION
            for wrong in ("/elsewhere", "/long/netftapi2.xml"):
                with pytest.raises(InputError):
                    read_configuration("", f"http://{host}{wrong}")
        finally:
            server.shutdown()
            thread.join()
    for nowhere in (f"http://{host}/netftapi2.xml", str(tmp_path), "http://[", "http://127.0.0.1:99999/"):
        with pytest.raises(InputError, match=r"not read|is a folder"):
            read_configuration("", nowhere)


def test_a_page_that_arrives_too_slowly_is_refused(monkeypatch):
    monkeypatch.setattr(net_ft_sensor, "_PAGE_TIMEOUT_S", 0.3)
    dripping = [b"HTTP/1.0 200 OK\r\n\r\n", b"HTTP/1.0 200 OK\r\nX"]
    for head in dripping:
        with socket.create_server(("127.0.0.1", 0)) as server:
            thread = threading.Thread(target=drips, args=(server, head))
            thread.start()
            with pytest.raises(InputError, match=r"not complete after 0\.3 s"):
                read_configuration(f"127.0.0.1:{server.getsockname()[1]}")
            thread.join()


def drips(server, head):
    with server.accept()[0] as connection, contextlib.suppress(OSError):
        connection.sendall(head)
        for _ in range(600):
            connection.sendall(b" ")
            time.sleep(0.05)


def test_a_redirection_is_not_followed():
    with socket.create_server(("127.0.0.1", 0)) as server:
        thread = threading.Thread(target=redirects, args=(server,))
        thread.start()
        with pytest.raises(InputError, match="not read, the server answers 302"):
            read_configuration(f"127.0.0.1:{server.getsockname()[1]}")
        thread.join()


def redirects(server):
    with server.accept()[0] as connection:
        connection.recv(4096)
        connection.sendall(b"HTTP/1.0 302 Found\r\nLocation: http://127.0.0.1:9/x\r\n\r\n")


def test_the_error_of_a_second_client_has_the_reason():
    with FakeAxis(greets=False) as fake:
        fake.garbage = b"refused connection another client\n"
        with pytest.raises(InputError, match="refused, another client"):
            AxisClient("127.0.0.1", fake.port)


def test_a_refused_command_has_the_reason_of_the_axis():
    with FakeAxis(reply=lambda line: "refused site no table" if line.startswith("site") else None) as fake:
        axis = AxisClient("127.0.0.1", fake.port)
        try:
            assert axis.limits == fake.limits
            with pytest.raises(InputError, match="no table"):
                axis.site(2)
            axis.send_move(0.001, 0.01)
            until(lambda: axis.answer("move"))
            axis.send_stop()
            until(lambda: axis.answer("stop"))
            with pytest.raises(InputError, match="moves at up to"):
                axis.send_move(0.001, 1.0)
        finally:
            axis.close()
    assert fake.received == ["site 2", "move 0.00100000 0.0100000", "stop"]


@pytest.mark.parametrize("garbage", [b"\xff\xfe\n", b"state 1 2 3\n", b"x" * 5000, b"axis 0 inf 1 1\n"])
def test_invalid_lines_of_an_axis_are_refused(garbage):
    with FakeAxis() as fake:
        axis = AxisClient("127.0.0.1", fake.port)
        fake.garbage = garbage
        try:
            with pytest.raises(InputError, match="line of the axis"):
                until(lambda: axis.receive() is None)
            with pytest.raises(InputError, match="line of the axis"):
                axis.site(1)
        finally:
            axis.close()


def test_an_axis_that_does_not_send_its_range_is_refused():
    with FakeAxis(greets=False, state=lambda s: s) as fake:
        with pytest.raises(InputError, match="greeting"):
            AxisClient("127.0.0.1", fake.port, timeout=0.1)
