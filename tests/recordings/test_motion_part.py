# SPDX-License-Identifier: Apache-2.0
"""A motion with its own clock in another table of the same file; expected values by hand."""

import h5py
import numpy as np
import pytest
from nptdms import ChannelObject, TdmsWriter
from scipy.io import savemat
from typer.testing import CliRunner

import needleforce as nf
from needleforce.cli import app

FORCE_TIME, MOTION_TIME = np.arange(10000) / 1000.0, np.arange(501) / 50.0
SPEED_MM_S = 2.0


def force(time):
    return 0.05 * np.clip(SPEED_MM_S * time - 5.0, 0.0, None)


def check(run, first=0.0, last=9.999):
    assert run.time[0] == pytest.approx(first, abs=1e-6) and run.time[-1] == pytest.approx(last, abs=1e-6)
    np.testing.assert_allclose(run.depth, 1e-3 * SPEED_MM_S * run.time, atol=1e-6)
    np.testing.assert_allclose(run.force, force(run.time), atol=1e-5)


def hdf5(path):
    with h5py.File(path, "w") as target:
        target["daq/time"], target["daq/fz"] = FORCE_TIME, force(FORCE_TIME)
        target["stage/t"], target["stage/position"] = MOTION_TIME, SPEED_MM_S * MOTION_TIME
        target["daq/fz"].attrs["unit"], target["stage/position"].attrs["unit"] = "N", "mm"
    return "/stage"


def hdf5_rates(path):
    with h5py.File(path, "w") as target:
        target["daq/fz"], target["stage/position"] = force(FORCE_TIME), SPEED_MM_S * MOTION_TIME
        target["daq"].attrs["fs"], target["stage"].attrs["fs"] = 1000.0, 50.0
    return "stage"


def hdf5_flat(path):
    with h5py.File(path, "w") as target:
        target["force"], target["force_time"] = force(FORCE_TIME), FORCE_TIME
        target["pos"], target["pos_time"] = SPEED_MM_S * MOTION_TIME, MOTION_TIME
    return "/ (501 rows)"


def matlab(path):
    with open(path, "wb") as target:
        savemat(target, {"F": {"t": FORCE_TIME, "Fz": force(FORCE_TIME)},
                         "motion": {"t": MOTION_TIME, "z": SPEED_MM_S * MOTION_TIME}})  # fmt: skip
    return "motion"


def tables(path):
    with open(path, "w") as target:
        target.write("Force\nTime [s],Fz [N]\n")
        np.savetxt(target, np.column_stack([FORCE_TIME, force(FORCE_TIME)]), "%.5f", delimiter=",")
        target.write("\nStage\nTime [s],Position [mm]\n")
        np.savetxt(target, np.column_stack([MOTION_TIME, SPEED_MM_S * MOTION_TIME]), "%.5f", delimiter=",")
    return "table 2"


@pytest.mark.parametrize("write", [hdf5, hdf5_rates, hdf5_flat, matlab, tables])
def test_the_message_names_the_option_that_joins_both_clocks(tmp_path, write):
    path = tmp_path / "run.any"
    name = write(path)
    with pytest.raises(nf.InputError) as caught:
        nf.read(path)
    assert "--motion-part" in caught.value.next_step and name.strip("/") in caught.value.next_step
    run = nf.read(path, motion_part=name)
    check(run)
    assert any(f"table '{'/' * (name == 'stage')}{name}' of the file" in each for each in run.card.assumptions)


def test_the_starts_of_two_waveforms_are_kept(tmp_path):
    start = np.datetime64("2024-01-01T00:00:00.000")
    later = start + np.timedelta64(200, "ms")
    with TdmsWriter(tmp_path / "run.tdms") as writer:
        force_facts = {"wf_increment": 0.001, "unit_string": "N", "wf_start_time": start}
        stage_facts = {"wf_increment": 0.02, "unit_string": "mm", "wf_start_time": later}
        writer.write_segment([
            ChannelObject("DAQ", "Force", force(FORCE_TIME), force_facts),
            ChannelObject("Stage", "Position", SPEED_MM_S * MOTION_TIME[10:], stage_facts),
        ])  # fmt: skip
    run = nf.read(tmp_path / "run.tdms", motion_part="Stage")
    check(run, first=0.2)
    assert any("their starts are 0.2 s apart" in each for each in run.card.assumptions)


def test_options_of_the_motion_apply_to_its_table(tmp_path):
    with h5py.File(tmp_path / "run.h5", "w") as target:
        target["daq/time"], target["daq/fz"] = FORCE_TIME, force(FORCE_TIME)
        target["stage/a"], target["stage/b"] = 1e3 * MOTION_TIME, 1e3 * SPEED_MM_S * MOTION_TIME
    columns = {"motion.time": "a", "motion.depth": "b"}
    with pytest.raises(nf.InputError, match=r"--column motion.time=1 --column motion.depth=2"):
        nf.read(tmp_path / "run.h5", motion_part="stage")
    units = {"motion.time": "ms", "motion.depth": "um"}
    check(nf.read(tmp_path / "run.h5", motion_part="stage", columns=columns, units=units))


def test_a_table_of_a_motion_file(tmp_path):
    hdf5(tmp_path / "both.h5")
    np.savetxt(tmp_path / "force.csv", np.column_stack([FORCE_TIME, force(FORCE_TIME)]), "%.5f", delimiter=",",
               header="Time [s],Fz [N]", comments="")  # fmt: skip
    check(nf.read(tmp_path / "force.csv", motion=tmp_path / "both.h5", motion_part="stage"))


def test_inspect_shows_both_clocks_and_the_command(tmp_path):
    hdf5(tmp_path / "run.h5")
    done = CliRunner().invoke(app, ["inspect", str(tmp_path / "run.h5"), "--motion-part", "stage", "--no-plot"])
    assert done.exit_code == 0, done.output
    for text in ("10000 at 1000 Hz, 0 to 9.999 s", "501 at 50 Hz, 0 to 10 s", "10000 of 10000 samples",
                 "position", "--motion-part stage"):  # fmt: skip
        assert text in done.stdout, text


def test_inspect_of_a_motion_without_overlap_shows_both_clocks(tmp_path):
    np.savetxt(tmp_path / "f.csv", np.column_stack([FORCE_TIME, force(FORCE_TIME)]), "%.5f", delimiter=",",
               header="Time [s],Fz [N]", comments="")  # fmt: skip
    np.savetxt(tmp_path / "m.csv", np.column_stack([100.0 + MOTION_TIME, MOTION_TIME]), "%.5f", delimiter=",",
               header="Time [s],Position [mm]", comments="")  # fmt: skip
    found = nf.read(tmp_path / "f.csv", motion=tmp_path / "m.csv", dry_run=True)
    assert found.recording is None and "times of the motion" in found.problem
    assert dict(found.motion.clocks)["overlap"] == "none"
    assert dict(found.motion.clocks)["clock of the motion"] == "501 at 50 Hz, 100 to 110 s"


def test_an_unknown_table_is_named(tmp_path):
    hdf5(tmp_path / "run.h5")
    with pytest.raises(nf.InputError, match=r"motion part is 'nothing', the file has '/stage'"):
        nf.read(tmp_path / "run.h5", motion_part="nothing")
