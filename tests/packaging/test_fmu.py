# SPDX-License-Identifier: Apache-2.0
"""An exported FMU: FMPy's checker and simulator accept it, and its numbers are those of the engine in Python."""

import zipfile

import numpy as np
import pytest
from command_line import run
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu

import needleforce as nf
from needleforce.export import fmu

DT = 2e-3
# test_fmu_cases.py has every law
PRESETS = ("paper", "layered")
NUMBERS = ("force", "stiffness", "friction", "cutting", "force_by_depth", "force_by_velocity")
FORCE, DEPTH, VELOCITY, MEASURED = 20, 1, 2, 3


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The path of the FMU of a preset; the library in them is compiled once."""
    folder = tmp_path_factory.mktemp("fmu")

    def of(name: str):
        path = folder / f"{name}.fmu"
        if not path.exists():
            path.write_bytes(fmu(nf.preset(name)))
        return path

    return of


@pytest.fixture
def slave(made, tmp_path):
    """The paper's, initialized, and what it logs."""
    path, logged = made("paper"), []
    described = read_model_description(path)
    one = FMU3Slave(
        guid=described.guid, unzipDirectory=extract(path, tmp_path / "fmu"),
        modelIdentifier=described.coSimulation.modelIdentifier, instanceName="one",
    )  # fmt: skip
    one.instantiate(loggingOn=True, logMessage=lambda _, status, category, text: logged.append(text.decode()))
    yield one, logged
    one.freeInstance()


def begin(one):
    one.enterInitializationMode()
    one.exitInitializationMode()


def step(one, time, depth):
    one.setFloat64([DEPTH], [depth])
    one.doStep(currentCommunicationPoint=time, communicationStepSize=DT)
    return one.getFloat64([FORCE])[0]


def motion():
    """In, a hold, out and in again: depths at 0, DT, 2 DT…"""
    speeds = np.repeat([8e-3, 0.0, -5e-3, 9e-3], [1500, 300, 900, 600])
    return -1e-3 + np.cumsum(speeds) * DT


@pytest.mark.parametrize("name", PRESETS)
def test_checked_and_simulated_by_fmpy_it_is_the_engine(made, name):
    path, depths = made(name), motion()
    assert validate_fmu(str(path)) == []
    time = np.arange(len(depths)) * DT
    given = np.array(list(zip(time, depths)), dtype=[("time", float), ("depth", float)])
    wanted = [*NUMBERS, "phase", "status", "contact", "punctured", "exit"]
    found = simulate_fmu(
        str(path), stop_time=time[-1], step_size=DT, output_interval=DT, input=given, output=wanted,
        start_values={"max_speed": 0.5},
    )  # fmt: skip
    # FMPy sets the input at the beginning of a step, and that is where the tip is at its end
    engine = nf.Insertion(nf.preset(name), max_speed=0.5)
    samples = [engine.step(depth, None, DT) for depth in depths[: len(found) - 1]]
    assert len(samples) > len(depths) - 3 and any(sample.punctured for sample in samples)
    for column in NUMBERS:
        expected = np.array([getattr(sample, column) for sample in samples])
        np.testing.assert_allclose(
            found[column][1:], expected, rtol=0.0, atol=1e-9 * np.abs(expected).max(initial=1e-9)
        )
    for column, words in (("phase", list(nf.Phase)), ("status", list(nf.Status))):
        assert [words[k] for k in found[column][1:]] == [getattr(sample, column) for sample in samples]
    for column in ("contact", "punctured", "exit"):
        assert found[column][1:].tolist() == [getattr(sample, column) for sample in samples]


def test_a_state_takes_it_back_also_from_bytes_and_into_another(slave):
    one, logged = slave
    begin(one)
    depths = motion()
    for k in range(900):
        step(one, k * DT, depths[k])
    kept = one.getFMUState()
    stored = one.serializeFMUState(kept)
    forward = [step(one, k * DT, depths[k]) for k in range(900, 1400)]
    with pytest.raises(Exception, match="fmi3DoStep"):
        step(one, 900 * DT, depths[900])
    assert "before the time of this FMU" in logged[-1] and "fmi3SetFMUState" in logged[-1]
    one.setFMUState(kept)
    assert [step(one, k * DT, depths[k]) for k in range(900, 1400)] == forward
    one.reset()
    one.setFMUState(one.deserializeFMUState(stored))
    assert [step(one, k * DT, depths[k]) for k in range(900, 1400)] == forward
    altered = bytearray(stored)
    altered[400] ^= 1
    with pytest.raises(Exception, match="fmi3SetFMUState"):
        one.setFMUState(one.deserializeFMUState(bytes(altered)))
    assert "altered. Nothing was changed" in logged[-1]
    assert step(one, 1400 * DT, depths[1400]) != 0.0
    one.freeFMUState(kept)


def test_derivatives_are_those_of_the_step(slave):
    one, logged = slave
    begin(one)
    depths = motion()
    for k in range(2000):
        step(one, k * DT, depths[k])
    for k in (2000, 2600):
        before = one.getFMUState()
        forces = []
        for shift in (-1e-9, 1e-9, 0.0):
            one.setFMUState(before)
            forces.append(step(one, k * DT, depths[k] + shift))
        slope = one.getDirectionalDerivative([FORCE], [DEPTH], [1.0])[0]
        assert slope == pytest.approx((forces[1] - forces[0]) / 2e-9, rel=1e-5)
        back = one.getAdjointDerivative([FORCE], [DEPTH, VELOCITY], [2.0], nSensitivity=2)
        assert back == pytest.approx([2.0 * slope, 0.0])
        for more in range(k + 1, k + 600):
            step(one, more * DT, depths[more])
    with pytest.raises(Exception, match="DirectionalDerivative"):
        one.getDirectionalDerivative([22], [DEPTH], [1.0])
    assert "none. There are those of the force" in logged[-1]


def test_what_is_refused_is_named_and_changes_nothing(slave):
    one, logged = slave
    friction = next(
        v for v in read_model_description(one.unzipDirectory).modelVariables if v.name.endswith(".per_length")
    )
    one.setFloat64([friction.valueReference], [-1.0])
    one.enterInitializationMode()
    with pytest.raises(Exception, match="fmi3ExitInitializationMode"):
        one.exitInitializationMode()
    assert "coulomb per_length = -1" in logged[-1]
    one.setFloat64([friction.valueReference], [37.2])
    one.exitInitializationMode()
    for wrong, words in (
        (lambda: one.setFloat64([friction.valueReference], [1.0]), "Call fmi3Reset first"),
        (lambda: one.setFloat64([FORCE], [1.0]), "not one that is set"),
        (lambda: one.getFloat64([7777]), "none of this type"),
        (lambda: one.doStep(currentCommunicationPoint=0.0, communicationStepSize=0.0), "not above 0"),
        (lambda: one.doStep(currentCommunicationPoint=5.0, communicationStepSize=DT), "Step on from its time"),
        (one.enterEventMode, "nothing of that kind"),
    ):
        with pytest.raises(Exception, match="fmi3"):
            wrong()
        assert words in logged[-1]
    doubled = [step(one, k * DT, depth) for k, depth in enumerate(motion()[:1400])][-1]
    engine = nf.Insertion(nf.preset("paper").replace(friction=nf.laws.Coulomb(per_length=37.2, presliding=20e-6)))
    assert doubled == pytest.approx([engine.step(z, None, DT).force for z in motion()[:1400]][-1], rel=1e-9)
    assert step(one, 1400 * DT, np.nan) == 0.0 and one.getInt32([41]) == [3]  # not finite: no force, and it continues
    assert step(one, 1401 * DT, motion()[1400]) > 0.1


def test_the_command_and_a_machine_without_a_compiler(made, tmp_path, monkeypatch):
    code, _, warned = run("export", "paper", "--language", "fmu", "-o", tmp_path / "gel.fmu")
    assert code == 0, warned
    with zipfile.ZipFile(tmp_path / "gel.fmu") as archive:
        names = archive.namelist()
    assert {"modelDescription.xml", "sources/fmu.c", "sources/needleforce.cpp"} <= set(names)
    assert (tmp_path / "gel.fmu").read_bytes() == made("paper").read_bytes()
    code, _, warned = run("export", "paper", "--language", "fmu")
    assert code == 2 and "-o paper.fmu" in warned
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CXX", raising=False)
    with pytest.raises(nf.InputError, match=r"not found.*apt install g\+\+"):
        fmu(nf.preset("paper"))
