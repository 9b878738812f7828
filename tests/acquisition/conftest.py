import gc
import threading

import pytest
from fake_rig import CONFIGURATION
from simulated_time import SimulatedTime

from needleforce.acquisition.recorder import record_run
from needleforce.acquisition.settings import Settings
from needleforce.acquisition.sources.axis import AxisClient
from needleforce.acquisition.sources.net_ft_sensor import SensorClient
from needleforce.recording.log.reader import read_log


@pytest.fixture(autouse=True)
def nothing_left():
    """No thread, socket or file is left: one that is collected while open is a ResourceWarning, and so an error."""
    before = set(threading.enumerate())
    gc.freeze()  # only the test's own objects are collected
    yield
    gc.collect()
    gc.unfreeze()
    for thread in set(threading.enumerate()) - before:
        thread.join(2.0)  # the writer of a test may be about to end
    assert set(threading.enumerate()) <= before


@pytest.fixture
def simulated_time(nothing_left):
    with SimulatedTime() as clock:
        yield clock


@pytest.fixture
def recorded(tmp_path, simulated_time):
    """``recorded(sensor, axis, moves, ...)``: the result of a run and the log read from its file."""

    def run(sensor, axis=None, moves=(), stop=None, view=None, **settings):
        force = SensorClient("127.0.0.1", sensor.port, CONFIGURATION)
        moved = AxisClient("127.0.0.1", axis.port, timeout=0.3) if axis else None
        chosen = Settings(**{"force_limit": 5.0, "bias_time": 0.1, "silence": 0.3} | settings)
        path = tmp_path / "run.mcap"
        outcome = record_run(path, force, moved, moves, {"needle": "fake"}, chosen, stop=stop, view=view)
        return outcome, read_log(path)

    return run
