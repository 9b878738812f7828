# SPDX-License-Identifier: Apache-2.0
"""A sensor and an axis that lie, in their own process or thread: a needle on an exact motion, random lies about it.

The rig owns the truth: where the needle is at every moment, and when it was ordered to stop. ``lies.py`` runs
recorders against it. Every lie is drawn from a seed; a lie begins when the needle is as deep as ``begins``.
"""

import bisect
import dataclasses
import math
import multiprocessing
import random
import select
import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path

from needleforce.wire.axis_lines import AxisRange, AxisState, parse_command, range_line, state_line
from needleforce.wire.net_ft import Command, Packet, SensorConfiguration, pack_record, unpack_request

LIMITS = AxisRange(-0.02, 0.06, 0.05, 2.0)
CONFIGURATION = SensorConfiguration(1e5, 1e6, 500.0, "LIAR", (12.0, 12.0, 17.0, 0.12, 0.12, 0.12))
START, STIFFNESS, NOISE = -2e-3, 300.0, 2e-3  # [m], [N/m], [N]
PULL, STRETCH = 0.25, 0.2e-3  # [N] of friction on a needle that slides back, [m] over which it reverses
BIAS = (0.1, 0.1, 0.3, 0.1, 0.1, 0.1)
TICK = 2e-3

# what the axis does: it obeys, or not
DEEDS = ["obeys"] * 6 + [
    "ignores the stop",
    "only silence stops it",
    "stops 0.4 s late",
    "too fast",
    "wrong way",
    "overshoots",
]
# what the axis reports
WORDS = [
    "honest", "honest", "idle always", "random condition", "velocity times 1000", "no answers", "answers all",
    "late states", "slow states", "flood of states", "flood of answers", "counter repeats", "counter falls",
    "depth times 3", "depth frozen", "depth jumps", "depth reversed", "garbage", "closes", "silent", "long line",
    "depth late",
]  # fmt: skip
# what the sensor sends
SENSOR = [
    "honest", "honest", "honest", "frozen counter", "random counters", "faulty", "doubled", "frozen values", "silent",
    "huge datagrams", "flood of records", "restart", "wrong sizes", "half lost", "late", "saturated", "constant fifth",
    "scale falls", "scale falls, noise stays", "zero falls", "any scale", "any scale, noise stays", "scale creeps",
    "zero creeps", "noise grows", "lateral frozen", "page changes",
]  # fmt: skip
UNUSABLE = {
    "frozen counter", "random counters", "faulty", "doubled", "frozen values", "silent", "restart", "saturated",
    "scale falls", "scale falls, noise stays", "zero falls",
}  # fmt: skip
CREEP_S = 0.5  # over which a scale or a zero creeps


class LyingRig:
    """One run: ``plan`` names the lies; ``truth`` is filled while it runs."""

    def __init__(self, seed: int, page: Path):
        draw = self.draw = random.Random(seed)
        self.plan = {
            "deed": draw.choice(DEEDS), "words": draw.choice(WORDS), "sensor": draw.choice(SENSOR),
            "begins": draw.uniform(-1e-3, 6e-3), "limit": draw.choice([1.0, 5.0]),
            "rate": draw.choice([20.0, 60.0, 60.0, 250.0, 1000.0]),
            "scale": draw.uniform(0.05, 1.0), "zero": draw.uniform(0.0, 3.0), "late": draw.uniform(0.05, 0.5),
        }  # fmt: skip
        if self.plan["sensor"].startswith(("scale falls", "zero falls")):
            self.plan |= {"scale": 0.1, "zero": 3.0}
        self.depth, self.speed, self.target = START, 0.0, None
        self.deepest, self.page = START, page
        self.velocity = 0.0
        self.stopping = math.inf
        self.heard = math.inf
        self.lying = False
        self.frozen: float | None = None
        self.numbers, self.sent, self.values = 0, 0, (0,) * 6
        self.last = None  # the last record
        self.truth = {"stops": [], "track": [], "lie": math.inf, "crossed": math.inf, "gap": 0.0, "moves": 0}

    def advance(self, now: float, step: float) -> None:
        """Move the needle over ``step`` [s]: exact for the present order."""
        plan, deed = self.plan, self.plan["deed"]
        if not self.lying and self.depth >= plan["begins"]:
            self.lying, self.truth["lie"] = True, now
        if now - self.heard > 0.5 and deed != "ignores the stop":
            self.target, self.heard = None, math.inf
        if now >= self.stopping:
            self.target, self.stopping = None, math.inf
        wanted = 0.0
        if self.target is not None:
            factor = {"too fast": 4.0, "wrong way": -1.0}.get(deed, 1.0) if self.lying else 1.0
            left = self.target - self.depth
            if deed == "overshoots" and self.lying and left > 0.0:
                left = math.inf
            reachable = math.sqrt(2.0 * LIMITS.max_acceleration * abs(left))
            wanted = factor * math.copysign(min(self.speed, reachable), left)
            if abs(left) < 2e-6 and factor > 0.0:
                self.target, wanted = None, 0.0
        change = LIMITS.max_acceleration * step
        self.velocity += max(-change, min(change, wanted - self.velocity))
        before, self.depth = self.force, self.depth + self.velocity * step
        self.deepest = max(self.deepest, self.depth)
        self.truth["track"].append((now, self.depth))
        if self.force > self.plan["limit"] >= before and self.truth["crossed"] == math.inf:
            self.truth["crossed"] = now

    @property
    def force(self) -> float:
        """The true force [N]: of a spring into the tissue, and of friction that reverses on the way back."""
        if self.depth <= 0.0:
            return 0.0
        back = min((self.deepest - self.depth) / STRETCH, 1.0)
        return STIFFNESS * self.deepest * (1.0 - back) - PULL * back

    def order(self, line: str, now: float) -> str:
        """Obey a line, or not; the answer."""
        self.heard, deed = now, self.plan["deed"]
        try:
            command, numbers = parse_command(line)
        except ValueError:
            return "refused line"
        if command == "move":
            self.target, self.speed = numbers
            self.truth["moves"] += 1
        elif command == "stop":
            self.truth["stops"].append(now)
            if deed == "stops 0.4 s late":
                self.stopping = min(self.stopping, now + 0.4)
            elif deed not in ("ignores the stop", "only silence stops it"):
                self.target = None
        elif command == "alive":
            return "ok alive" if self.lying and self.plan["words"] == "answers all" else ""
        return "" if self.lying and self.plan["words"] == "no answers" else f"ok {command}"

    def state_lines(self, now: float) -> bytes:
        """The state as the axis words it."""
        words, depth, velocity = self.plan["words"] if self.lying else "honest", self.depth, self.velocity
        condition = "moving" if self.target is not None or abs(velocity) > 1e-4 else "idle"
        self.numbers += 1
        number = self.numbers
        if words in ("idle always", "random condition"):
            condition = "idle" if words == "idle always" else self.draw.choice(["idle", "moving", "stopping"])
        elif words == "velocity times 1000":
            velocity *= 1000.0
        elif words == "counter repeats":
            number = self.numbers = self.numbers - 1
        elif words == "counter falls":
            number = self.draw.randrange(1000)
        elif words == "depth times 3":
            depth *= 3.0
        elif words == "depth reversed":
            depth = 2.0 * self.plan["begins"] - depth
        elif words == "depth late":
            depth, velocity, condition = self._earlier(now - self.plan["late"])
        elif words == "depth jumps":
            depth += self.draw.choice([0.0, 5e-3, -5e-3])
        elif words == "depth frozen":
            self.frozen = depth if self.frozen is None else self.frozen
            depth, velocity = self.frozen, 0.0
        elif words == "garbage":
            return bytes(self.draw.randrange(256) for _ in range(self.draw.randrange(1, 300))) + b"\n"
        elif words == "long line":
            return b"state " + b"1" * 100_000
        line = state_line(AxisState(number, now % 1000.0, depth, velocity, condition)).encode() + b"\n"
        if words == "flood of states":
            return b"".join(line.replace(b"state %d " % number, b"state %d " % (number + k)) for k in range(3000))
        return b"ok alive\n" * 5000 + line if words == "flood of answers" else line

    def _earlier(self, then: float) -> tuple[float, float, str]:
        """Depth, speed and condition as they were."""
        track = self.truth["track"]
        k = max(bisect.bisect(track, (then, math.inf)) - 1, 1)
        (first, start), (last, end) = track[k - 1], track[k]
        velocity = (end - start) / max(last - first, 1e-9)
        return end, velocity, "moving" if abs(velocity) > 1e-4 else "idle"

    def datagrams(self, k: int, now: float) -> list[bytes]:
        """What the sensor sends instead of its record ``k``."""
        lie = self.plan["sensor"] if self.lying else "honest"
        values = self._counts(lie, min((now - self.truth["lie"]) / CREEP_S, 1.0) if "creeps" in lie else 1.0)
        if lie == "page changes" and self.page:
            self.page.write_bytes(dataclasses.replace(CONFIGURATION, counts_per_force=1e4).xml())
            self.page = None
        honest = Packet(k, 7 * k & 0xFFFFFFFF, 0, values)
        before, self.last = self.last or honest, honest if lie == "honest" else self.last
        if lie == "frozen counter":
            return [pack_record(before)]
        if lie == "random counters":
            return [pack_record(honest._replace(sequence=self.draw.getrandbits(32), sample=self.draw.getrandbits(32)))]
        if lie in ("faulty", "saturated"):
            return [pack_record(honest._replace(status=1 << (20 if lie == "faulty" else 17) | 1 << 31))]
        if lie == "doubled":
            return [pack_record(before._replace(sequence=before.sequence + (k & 1)))]
        if lie == "frozen values":
            return [pack_record(honest._replace(counts=before.counts))]
        if lie == "silent" or (lie == "half lost" and self.draw.random() < 0.5):
            return []
        if lie == "huge datagrams":
            return [pack_record(honest), bytes(65_000) if k % 10 == 0 else b""]
        if lie == "flood of records":
            return [pack_record(honest)] * 20
        if lie == "restart":
            return [pack_record(honest._replace(sequence=k + 50_000_000))]
        if lie == "wrong sizes":
            return [pack_record(honest), self.draw.randbytes(self.draw.randrange(100))]
        if lie == "lateral frozen":
            return [pack_record(honest._replace(counts=(before.counts[0], *values[1:])))]
        if lie == "constant fifth":
            return [pack_record(honest._replace(counts=(*values[:4], 0, values[5])))]
        return [pack_record(honest)]

    def _counts(self, lie: str, share: float) -> tuple[int, ...]:
        """The six readings, by a scale or a zero of which a ``share`` has fallen."""
        scale, zero = self.plan["scale"], self.plan["zero"]
        fallen = 1.0 - share * (1.0 - scale) * ("scale" in lie)
        noisy = NOISE * {"scale falls, noise stays": 1.0, "any scale, noise stays": 1.0}.get(lie, fallen)
        noisy *= 5.0 if lie == "noise grows" else 1.0
        true = [fallen * (bias + self.force * (axis == 2)) for axis, bias in enumerate(BIAS)]
        true[2] -= share * zero * lie.startswith("zero")
        return tuple(round(1e5 * (each + self.draw.gauss(0.0, noisy))) for each in true)


class Server:
    """Sockets of one rig: it serves one recorder until that has ``left``."""

    def __init__(self, rig: LyingRig, left: Callable[[], bool]):
        self.rig, self.left = rig, left
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.sensor = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.sensor.bind(("127.0.0.1", 0))
        self.sensor.setblocking(False)
        self.axis, self.client, self.rest = None, None, b""
        self.begun = self.due_state = self.before = time.monotonic()
        self.waiting: list[tuple[float, bytes]] = []

    @property
    def ports(self) -> tuple[int, int]:
        """Those of sensor and axis."""
        return self.sensor.getsockname()[1], self.listener.getsockname()[1]

    def run(self) -> None:
        """Serve, every two milliseconds."""
        while not self.left():
            open_sockets = [each for each in (self.sensor, self.listener, self.axis) if each is not None]
            ready = select.select(open_sockets, [], [], TICK)[0]
            now = time.monotonic()
            self.advance(now)
            self.send_records(ready, now)
            try:
                self.speak(ready, now)
            except OSError:  # an axis stops when its client has left, if it obeys at all
                self.leave(now)
        self.rig.truth["moves_at_end"] = abs(self.rig.velocity) > 1e-4 and self.rig.depth > 0.0
        for each in (self.sensor, self.listener, self.axis):
            if each is not None:
                each.close()

    def advance(self, now: float) -> None:
        """Move the needle up to ``now`` in short steps."""
        span, self.rig.truth["gap"] = now - self.before, max(self.rig.truth["gap"], now - self.before)
        parts = max(1, math.ceil(span / TICK))
        for k in range(1, parts + 1):
            self.rig.advance(self.before + span * k / parts, span / parts)
        self.before = now

    def send_records(self, ready: list, now: float) -> None:
        """Answer a request of the recorder, and send the records that are due."""
        if self.sensor in ready:
            command, sender = self.sensor.recvfrom(100)
            self.client = sender if unpack_request(command)[0] == Command.START else None
            self.begun, self.rig.sent = now, 0
        while self.client and self.rig.sent < (now - self.begun) * CONFIGURATION.rate:
            self.rig.sent += 1
            delay = self.rig.draw.uniform(0.0, 0.1) if self.rig.lying and self.rig.plan["sensor"] == "late" else 0.0
            self.waiting += [(now + delay, data) for data in self.rig.datagrams(self.rig.sent, now) if data]
        for due, data in self.waiting:
            if due <= now and self.client:
                with suppress(OSError):
                    self.sensor.sendto(data, self.client)
        self.waiting = [each for each in self.waiting if each[0] > now]

    def speak(self, ready: list, now: float) -> None:
        """Answer the lines of the client, and report a state when it is due."""
        if self.axis is None and self.listener in ready:
            self.axis = self.listener.accept()[0]
            self.axis.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self.axis.setblocking(False)
            self.axis.send(range_line(LIMITS).encode() + b"\n")
        if self.axis is None:
            return
        if self.axis in ready:
            self.hear(now)
        words = self.rig.plan["words"] if self.rig.lying else "honest"
        if words == "closes":
            raise ConnectionError
        if now < self.due_state or words == "silent":
            return
        rate = 16.0 if words == "slow states" else self.rig.plan["rate"]
        self.due_state = max(self.due_state + 1.0 / rate, now - 0.2)
        if words != "late states" or int(now * 5.0) % 2:  # held back for 0.2 s, then as many as are due
            with suppress(BlockingIOError):
                self.axis.send(self.rig.state_lines(now))

    def hear(self, now: float) -> None:
        """Execute and answer the client's lines."""
        data = self.axis.recv(65536)
        if not data:
            raise ConnectionError
        *lines, self.rest = (self.rest + data).split(b"\n")
        answers = [self.rig.order(line.decode("ascii", "replace"), now) for line in lines]
        with suppress(BlockingIOError):
            self.axis.send("".join(f"{answer}\n" for answer in answers if answer).encode())

    def leave(self, now: float) -> None:
        """The connection is lost; nobody else may connect."""
        self.rig.truth["stops"].append(now)
        if self.rig.plan["deed"] != "ignores the stop":
            self.rig.target = None
        self.axis.close()
        self.listener.close()
        self.axis = self.listener = None


class RigInProcess:
    """Rigs one after the other in a process of their own, on the computer's clock."""

    def __init__(self):
        self._pipe, theirs = multiprocessing.Pipe()
        multiprocessing.Process(target=_serve, args=(theirs,), daemon=True).start()

    def begin(self, seed: int, page: Path) -> tuple[int, int]:
        """The ports of sensor and axis of the rig of a ``seed``, which may write a new ``page``."""
        self._pipe.send((seed, page))
        return self._pipe.recv()

    def end(self) -> tuple[dict, dict]:
        """Plan and truth of the rig, when its recorder has left."""
        self._pipe.send("left")
        return self._pipe.recv()


def _serve(pipe: Connection) -> None:
    while True:
        seed, page = pipe.recv()
        server = Server(LyingRig(seed, page), pipe.poll)
        pipe.send(server.ports)
        server.run()
        pipe.recv()
        pipe.send((server.rig.plan, server.rig.truth))


class RigInThread:
    """The same in a thread, for a clock of this program."""

    def begin(self, seed: int, page: Path) -> tuple[int, int]:
        """As ``RigInProcess.begin``."""
        self._left = threading.Event()
        self._server = Server(LyingRig(seed, page), self._left.is_set)
        self._thread = threading.Thread(target=self._server.run)
        self._thread.start()
        return self._server.ports

    def end(self) -> tuple[dict, dict]:
        """As ``RigInProcess.end``."""
        self._left.set()
        self._thread.join()
        return self._server.rig.plan, self._server.rig.truth
