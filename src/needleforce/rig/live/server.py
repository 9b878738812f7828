# SPDX-License-Identifier: Apache-2.0
"""The rig on the network: the simulated rig in real time with its three servers."""

import select
import threading
import time
from collections.abc import Callable, Mapping

from ...errors import InputError
from ...models.model import Model
from ..sensor import Sensor
from .servers import AxisServer, PageServer, SensorServer
from .simulated import LiveTruth, SimulatedRig

# the sensor's period while it streams, otherwise often enough for the axis' states
_STREAMING_INTERVAL_S, _IDLE_INTERVAL_S = 1e-3, 8e-3
_LOOPBACK = "127.0.0.1"


class VirtualRig:
    """A virtual rig on the network, as a context manager: it runs while the context is open.

    Parameters
    ----------
    model : Model, optional
        The tissue; default: the source paper's phantom.
    seed : int
        Seed of all random numbers, at least 0.
    faults : mapping of str to float, optional
        Values of faults by name as in ``FAULTS``.
    sensor : Sensor, optional
        Filter and noise of the force sensor.
    sensor_port, axis_port, page_port : int
        Ports, 0 for any free one; inside the context the attributes of these names are the ports in use.
    listen : str
        Address to listen at.
    say : callable
        Called with a line for each event, in the rig's thread.

    Raises
    ------
    InputError
        If a value is invalid; on entering the context, if a port is in use.
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
        self._ports, self._listen, self._say = (sensor_port, axis_port, page_port), listen, say
        self._ending = threading.Event()
        self.ended = threading.Event()  # the power was cut, or the context has ended
        self._lock = threading.Lock()

    def __enter__(self) -> "VirtualRig":
        self._open()
        self.sensor_port, self.axis_port, self.page_port = self._sensor.port, self._axis.port, self._page.port
        if not self._listen.startswith("127."):
            self._say(f"warning: listening at {self._listen}; any computer that can connect can move the axis")
        self._start = time.monotonic()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_) -> None:
        self._ending.set()
        self._thread.join()

    @property
    def time(self) -> float:
        """Time since the context was entered [s]."""
        return time.monotonic() - self._start

    def truth(self) -> LiveTruth:
        """The ground truth so far."""
        with self._lock:
            return self.simulated.truth()

    def _open(self) -> None:
        sensor, axis, page = self._ports
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
                self._serve_once()
        finally:
            self._axis.close(abruptly=self.time >= cut)
            self._sensor.close()
            self._page.close()
            if self.time >= cut:
                self._say("rig: power cut")
            self.ended.set()

    def _serve_once(self) -> None:
        """Wait for input or for the next output, and advance the rig to the present time."""
        period = _STREAMING_INTERVAL_S if self.simulated.transfer.streaming else _IDLE_INTERVAL_S
        watched = [self._sensor.socket, *self._axis.sockets, *self._page.sockets]
        ready, _, _ = select.select(watched, [], [], period - self.time % period)
        with self._lock:
            now = self.time
            self._axis.note_activity(ready, now)
            self.simulated.advance(now)
            self._axis.serve(ready, now)
            self._sensor.serve(ready, now)
            self._page.serve(ready)
