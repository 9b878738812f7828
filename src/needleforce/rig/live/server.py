# SPDX-License-Identifier: Apache-2.0
"""The rig on the network: the simulated one driven by a clock, with its three servers."""

import select
import threading
import time
from collections.abc import Callable, Mapping

from ...errors import InputError
from ...models.model import Model
from ..sensor import Sensor
from .servers import AxisServer, PageServer, SensorServer
from .simulated import LiveTruth, SimulatedRig

# [s] between two looks at what is due: the sensor's period while it streams, else often enough for the axis' states
_STREAMING, _QUIET = 1e-3, 8e-3
_LOOPBACK = "127.0.0.1"


class VirtualRig:
    """A context: the rig runs while it is open. Ports 0 are any free ones; ``sensor_port``, ``axis_port`` and
    ``page_port`` tell which.

    ``model`` None is the paper's phantom; ``faults`` are numbers by name as in ``FAULTS``; ``say`` takes a line for
    each thing that happens, in the rig's own thread. Raises InputError for what cannot be, and for a port in use.
    """

    def __init__(
        self,
        model: Model | None = None,
        seed: int = 1,
        faults: Mapping[str, float] | None = None,
        *,
        sensor: Sensor | None = None,
        sensor_port: int = 0,
        axis_port: int = 0,
        page_port: int = 0,
        listen: str = _LOOPBACK,
        say: Callable[[str], None] = lambda line: None,
    ):
        self.simulated = SimulatedRig(seed, model, faults, sensor)
        self._asked, self._listen, self._say = (sensor_port, axis_port, page_port), listen, say
        self._ending = threading.Event()
        self.ended = threading.Event()  # the power was cut, or the context is left
        self._lock = threading.Lock()

    def __enter__(self) -> "VirtualRig":
        self._open()
        self.sensor_port, self.axis_port, self.page_port = self._sensor.port, self._axis.port, self._page.port
        if not self._listen.startswith("127."):
            self._say(f"warning: listening at {self._listen}; whoever reaches it can drive the axis")
        self._start = time.monotonic()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_) -> None:
        self._ending.set()
        self._thread.join()

    @property
    def time(self) -> float:
        """Rig seconds since it was opened."""
        return time.monotonic() - self._start

    def truth(self) -> LiveTruth:
        """What really happened so far."""
        with self._lock:
            return self.simulated.truth()

    def _open(self) -> None:
        sensor, axis, page = self._asked
        self._sensor = SensorServer(self.simulated, self._listen, sensor, self._say)
        try:
            self._axis = AxisServer(self.simulated, self._listen, axis, self._say)
            try:
                self._page = PageServer(self.simulated.sensor.configuration, self._listen, page)
            except InputError:
                self._axis.close()
                raise
        except InputError:
            self._sensor.close()
            raise

    def _run(self) -> None:
        cut = self.simulated.faults["power_cut_s"]
        try:
            while not self._ending.is_set() and self.time < cut:
                self._turn()
        finally:
            self._axis.close(abruptly=self.time >= cut)
            self._sensor.close()
            self._page.close()
            if self.time >= cut:
                self._say("rig: power cut")
            self.ended.set()

    def _turn(self) -> None:
        """Wait for whatever comes first, a word or what is due next, and bring the rig up to now."""
        period = _STREAMING if self.simulated.transfer.streaming else _QUIET
        watched = [self._sensor.socket, *self._axis.sockets, *self._page.sockets]
        ready, _, _ = select.select(watched, [], [], period - self.time % period)
        with self._lock:
            now = self.time
            self._axis.heard(ready, now)
            self.simulated.advance(now)
            self._axis.serve(ready, now)
            self._sensor.serve(ready, now)
            self._page.serve(ready)
