# SPDX-License-Identifier: Apache-2.0
"""The tutorials run, and what their text claims of the numbers is so; the pages are built with the same cells."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

PAGES = Path(__file__).parents[2] / "docs" / "tutorials"
CELL = re.compile(r"^```\{code-cell\}\n(.*?)^```$", re.S | re.M)
# by tutorial, what holds after its last cell; the truths are those that its first cells state
CLAIMS = {
    "paper": """
for name in PAPER:
    assert fit.parameters[name].low <= experiment.truth[name].drawn <= fit.parameters[name].high, name
assert 0.7 < fit.parameters.cutting_force.value / experiment.truth["cutting_force"].drawn < 0.9
""",
    "first_recording": """
truths = {"stiffness_coefficient": 0.03e6, "friction_per_length": 20.0, "cutting_force": 0.09}
for name, truth in (truths | {"puncture_indentation": 2.8e-3}).items():
    assert fit.parameters[name].low <= truth <= fit.parameters[name].high, name
""",
    "repeats_and_layers": """
truths = {"contact_stiffness": 360.0, "friction_per_length": 140.0, "layer_2_top": 10e-3}
for name, truth in (truths | {"layer_2_friction_per_length": 70.0}).items():
    assert fit.parameters[name].low <= truth <= fit.parameters[name].high, name
""",
    "campaign": """
assert ((pooled["low"] <= friction) & (friction <= pooled["high"])).all()
assert [one.file for one in done.recordings if one.anomalies and one.pooled] == ["gel2_3.csv"]
""",
    "loop_and_guard": """
assert max(abs(output.force) for output in outputs) <= 0.4
assert not any(output.limited_by_energy for output in outputs)
""",
    "mujoco": "assert np.abs(again - force).max() < 1e-9",
    "steering": """
missed = [np.linalg.norm((path[-1] - target)[:2]) for path in (blind, looking)]
assert missed[0] > 1.5e-3 and missed[1] < 0.3e-3
""",
    "solid": """
assert abs(found.young_modulus["tissue"] / 12e3 - 1.0) < 0.02
assert factors[1] > 1.4 and abs(factors[-1] - 1.0) < 0.02
""",
}


def test_every_tutorial_has_claims():
    assert sorted(CLAIMS) == sorted(page.stem for page in PAGES.glob("*.md") if page.stem != "index")


@pytest.mark.long
@pytest.mark.parametrize("name", CLAIMS)
def test_the_numbers_of_a_tutorial_are_as_its_text_states(name, tmp_path):
    cells = CELL.findall((PAGES / f"{name}.md").read_text(encoding="utf-8"))
    program = [sys.executable, "-c", "\n".join([*cells, CLAIMS[name]])]
    environment = {"MPLBACKEND": "Agg", "OPENBLAS_NUM_THREADS": "1", "PATH": "/usr/bin:/bin"}
    done = subprocess.run(program, cwd=tmp_path, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
