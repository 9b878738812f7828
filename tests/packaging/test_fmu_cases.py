# SPDX-License-Identifier: Apache-2.0
"""The conformance set through exported FMUs, as FMPy calls them, next to the engine in Python. An FMU shows neither the
depth nor the velocity that were accepted, and a step of no time, or of one that is no number, is refused and changes
nothing; the engine answers it with a status."""

from types import SimpleNamespace

import numpy as np
import pytest
from case_rows import rigid, steps, trace, units
from fmpy import extract, read_model_description
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Slave

import needleforce as nf
from needleforce.export import fmu

TIME, DEPTH, VELOCITY, MEASURED = 0, 1, 2, 3
OUTPUTS, WORDS, EVENTS = range(20, 27), (40, 41), (42, 43, 44)
NO_VELOCITY = float(np.finfo(float).max)  # as NF_NO_VELOCITY
PARTS, EVENT_NAMES = trace.PARTS[2:9], ("contact", "punctured", "exit")


class OfFmu:
    """An insertion of an FMU; a step that it refuses is None."""

    def __init__(self, folder, model, settings):
        path = folder / "model.fmu"
        path.write_bytes(fmu(model, "model"))
        described = read_model_description(path)
        number = {each.name: each.valueReference for each in described.modelVariables}
        self.settings = {number[name]: value for name, value in settings.items()}
        self.slave = FMU3Slave(
            guid=described.guid, unzipDirectory=extract(path, folder / "model"), modelIdentifier="model",
            instanceName="one",
        )  # fmt: skip
        self.slave.instantiate()
        self.begin()

    def begin(self):
        self.slave.setBoolean([MEASURED], [True])
        self.slave.setFloat64(list(self.settings), list(self.settings.values()))
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()

    def step(self, depth, velocity, dt):
        self.slave.setFloat64([DEPTH, VELOCITY], [depth, NO_VELOCITY if velocity is None else velocity])
        time = self.slave.getFloat64([TIME])[0]
        try:
            self.slave.doStep(currentCommunicationPoint=time, communicationStepSize=dt)
        except FMICallException:
            return None
        phase, status = self.slave.getInt32(WORDS)
        words = {"phase": list(nf.Phase)[phase], "status": list(nf.Status)[status], "depth": 0.0, "velocity": 0.0}
        events = dict(zip(EVENT_NAMES, self.slave.getBoolean(EVENTS), strict=True))
        return SimpleNamespace(**dict(zip(PARTS, self.slave.getFloat64(OUTPUTS), strict=True)), **words, **events)

    def reset(self):
        self.slave.reset()
        self.begin()

    def save(self) -> bytes:
        state = self.slave.getFMUState()
        kept = self.slave.serializeFMUState(state)
        self.slave.freeFMUState(state)
        return kept

    def restore(self, kept: bytes):
        try:
            self.slave.setFMUState(self.slave.deserializeFMUState(kept))
        except FMICallException as refused:
            raise nf.InputError("state", len(kept), str(refused)) from refused


@pytest.fixture
def case_in_fmu(tmp_path):
    class Case(trace.Case):
        def engine(self, model, limits, bevel):
            given = {f"bevel_{name}": value for name, value in bevel.parameters().items()}
            return OfFmu(tmp_path, model, limits | given)

        def print(self, sample):
            self.write("refused") if sample is None else super().print(sample)

    return Case


@pytest.mark.parametrize("path", [path for path in rigid() if "refused" not in path.stem], ids=lambda path: path.stem)
def test_an_fmu_gives_the_same_insertion(path, case_in_fmu):
    ours, theirs = trace.traced(path).lines, trace.traced(path, case_in_fmu).lines
    untimed = [k for k, line in enumerate(theirs) if line == "refused" != ours[k]]
    assert len(untimed) == {"bad_numbers": 4, "jumps": 5}.get(path.stem, 0)
    taken = np.delete(np.arange(len(ours)), untimed)
    numbers, words = steps([ours[k] for k in taken])
    others, other_words = steps([theirs[k] for k in taken])
    assert words == other_words
    error = np.abs(others - numbers)[:, 2:]
    assert len(numbers) > 300 and np.all(error <= 1e-12 * units(numbers)[2:]), error.max(axis=0)
