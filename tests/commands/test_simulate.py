# SPDX-License-Identifier: Apache-2.0
"""``needleforce simulate`` in a condensed solid."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from command_line import run

import needleforce as nf
from needleforce import fe


def test_a_saved_solid_is_simulated_and_the_file_is_its_recording(tmp_path):
    apart = np.abs(np.subtract.outer(np.arange(31), np.arange(31)))
    solid = fe.CondensedTissue(1e-3, 2e-3 * np.exp(-0.25 * apart), summary="a table")
    solid.save(tmp_path / "cup.toml")
    command = [str(Path(sys.executable).with_name("needleforce")), "simulate", "--tissue", str(tmp_path / "cup.toml")]
    command += ["-o", str(tmp_path / "run.csv"), "--depth-mm", "20"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    motion = nf.Motion.insert(-5e-3, 3e-3, 20e-3)
    expected = nf.simulate(nf.preset("paper"), motion, tissue=solid)
    found = nf.read(tmp_path / "run.csv")
    np.testing.assert_allclose(found.force, expected.force, atol=1e-9)
    assert "largest force" in done.stderr + done.stdout
    missing = subprocess.run([*command[:3], "none.toml", *command[4:]], capture_output=True, text=True)
    assert missing.returncode == 2 and "none.toml" in missing.stderr and "Traceback" not in missing.stderr


def test_a_tip_that_stays_above_the_surface_is_said(tmp_path):
    done = run("simulate", "--depth-mm", "-3", "-o", tmp_path / "run.csv")
    assert done.returncode == 0 and "the tip stays above the surface" in done.stderr and "-3 mm" in done.stderr


def test_a_depth_in_the_place_of_a_motion_is_refused():
    with pytest.raises(nf.InputError, match=r"motion is 0.01, not a nf.Motion. Give for example nf.Motion.insert"):
        nf.simulate(nf.preset("paper"), 0.01)
