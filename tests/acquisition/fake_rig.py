"""A sensor and an axis on loopback, controlled by a test; each is a context manager with a thread."""

import contextlib
import select
import socket
import threading
import time

from needleforce.acquisition.settings import Settings
from needleforce.wire.axis_lines import AxisRange, AxisState, parse_command, range_line, state_line
from needleforce.wire.net_ft import Command, Packet, SensorConfiguration, pack_record, unpack_request

CONFIGURATION = SensorConfiguration(1000.0, 1e5, 500.0, "FT00042", (12.0, 12.0, 17.0, 0.12, 0.12, 0.12))
BIAS = (0.5, -0.25, 2.0, 0.001, 0.0, 0.002)
TICK = 0.005
SPEED, FAR = 0.02, [(0.05, 0.02)]  # [m/s], and the moves at it
STIFFNESS = 500.0  # of the simulated tissue [N/m]
GAP = Settings(force_limit=1.0).max_force_gap  # [s]
LIMITS = AxisRange(-0.02, 0.06, 0.05, 10.0)
PATIENCE = 120.0  # [s] after which a test takes what it waits for to hang


def until(condition):
    """Wait for what comes soon, however busy the computer is."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, f"not after {PATIENCE:g} s"
        time.sleep(0.005)


def counts(wrench):
    return tuple(round(value * (1000.0 if k < 3 else 1e5)) for k, value in enumerate(wrench))


class Threaded:
    def __enter__(self):
        self.leave = threading.Event()
        self.thread = threading.Thread(target=self.run)
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.leave.set()
        self.thread.join()
        self.close()


class FakeSensor(Threaded):
    """Streams at its rate. ``force(seconds)`` is the axial force above its bias; ``packets(sensor, number)`` may
    replace what is sent for a number by a list of datagrams or Packets; ``status(number)`` is the status.
    """

    def __init__(self, force=lambda t: 0.0, packets=None, status=lambda k: 0, ends=10**9, stale_from=10**9):
        self.force, self.packets, self.status, self.ends, self.stale_from = force, packets, status, ends, stale_from
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.setblocking(False)
        self.port = self.socket.getsockname()[1]
        self.requests, self.sent = [], 0

    def close(self):
        self.socket.close()

    def packet(self, k):
        noise = 0.002 * ((k * 7919 % 13) - 6) / 6
        axial = BIAS[2] + noise + self.force(k / CONFIGURATION.rate)
        wrench = (*BIAS[:2], axial, *BIAS[3:])
        return Packet(k, min(k, self.stale_from) * 7, self.status(k), counts(wrench))

    def run(self):
        self.stream()
        with contextlib.suppress(BlockingIOError):  # requests at the very end
            while True:
                self.requests.append(unpack_request(self.socket.recv(100))[0])

    def stream(self):
        client, begun = None, 0.0
        while not self.leave.wait(TICK):
            with contextlib.suppress(BlockingIOError):
                data, sender = self.socket.recvfrom(100)
                command, _ = unpack_request(data)
                self.requests.append(command)
                client = sender if command == Command.START else None
                self.sent, begun = (0 if client else self.sent), time.monotonic()
            due = int((time.monotonic() - begun) * CONFIGURATION.rate) if client else 0
            while client and self.sent < min(due, self.ends):
                self.sent += 1
                for item in self.packets(self, self.sent) if self.packets else [self.packet(self.sent)]:
                    self.socket.sendto(item if isinstance(item, bytes) else pack_record(item), client)


class FakeAxis(Threaded):
    """Moves at the commanded speed without ramps. ``reply(line)`` may replace an answer; None keeps it."""

    def __init__(self, reply=lambda line: None, state=lambda s: s, limits=LIMITS, greets=True):
        self.reply, self.state, self.limits, self.greets = reply, state, limits, greets
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        self.received, self.silent, self.hangs_up = [], False, False
        self.depth, self.target, self.speed, self.velocity = -0.002, None, 0.0, 0.0
        self.garbage = b""

    def close(self):
        self.listener.close()

    def run(self):
        while not self.leave.is_set():
            if select.select([self.listener], [], [], TICK)[0]:
                with self.listener.accept()[0] as connection, contextlib.suppress(OSError):
                    self.serve(connection)

    def serve(self, connection):
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)  # a kernel waits by its own clock
        if self.greets:
            connection.sendall(range_line(self.limits).encode() + b"\n")
        rest, number, begun = b"", 0, time.monotonic()
        while not self.leave.is_set() and not self.hangs_up:
            if select.select([connection], [], [], TICK)[0]:
                data = connection.recv(4096)
                if not data:
                    return
                *lines, rest = (rest + data).split(b"\n")
                for line in lines:
                    self.obey(line.decode(), connection)
            self.advance()
            number += 1
            condition = "idle" if self.target is None else "moving"
            state = self.state(AxisState(number, time.monotonic() - begun, self.depth, self.velocity, condition))
            if not self.silent:
                connection.sendall(state_line(state).encode() + b"\n" + self.garbage)

    def obey(self, line, connection):
        command, numbers = parse_command(line)
        if command != "alive":
            self.received.append(line)
        answer = self.reply(line)
        if answer is None and command == "move":
            self.target, self.speed = numbers
        if command == "stop":
            self.target = None
        if command != "alive" and answer != "":
            connection.sendall((answer or f"ok {command}").encode() + b"\n")

    def advance(self):
        if self.target is None:
            self.velocity = 0.0
            return
        travel = self.target - self.depth
        step = min(abs(travel), self.speed * TICK)
        self.velocity = self.speed if travel > 0 else -self.speed
        self.depth += step if travel > 0 else -step
        if self.depth == self.target or abs(self.target - self.depth) < 1e-9:
            self.target = None


class Disobedient(FakeAxis):
    """Ignores every stop; ``answers`` it or not; stops by itself after half a second without a line if ``watched``."""

    def __init__(self, answers=True, watched=False, **more):
        super().__init__(**more)
        self.answers, self.watched, self.heard = answers, watched, time.monotonic()

    def obey(self, line, connection):
        self.heard = time.monotonic()
        if line != "stop":
            return super().obey(line, connection)
        self.received.append(line)
        if self.answers:
            connection.sendall(b"ok stop\n")

    def advance(self):
        if self.watched and time.monotonic() - self.heard > 0.5:
            self.target = None
        super().advance()


def tissue(axis):
    """A sensor whose force is that of an elastic tissue at the depth of the axis."""
    return FakeSensor(lambda t: max(0.0, STIFFNESS * axis.depth))
