# SPDX-License-Identifier: Apache-2.0
"""The table of ``tip_contact`` is as exact as its page says."""

import math
import re
import runpy

import numpy as np
import pytest

import needleforce as nf

TIPS = {
    "truncated cone": [nf.tips.TruncatedCone(math.radians(15), flat) for flat in (1e-6, 20e-6, 0.1e-3, 0.3e-3)],
    "blunted cone": [nf.tips.BluntedCone(math.radians(30), 20e-6, 0.0)],
    "sphere, ogive": [nf.tips.Sphere(0.5e-3), nf.tips.TangentOgive(0.35e-3, 1.3e-3)],
    # the second would be 1e50 m deep where its shank is reached
    "powers 1.1 to 30": [nf.tips.PowerProfile(5.0, 0.35e-3, 1e-3), nf.tips.PowerProfile(30.0, 5e-6, 10e-6)],
}


@pytest.mark.parametrize("name", TIPS)
def test_the_page_states_the_largest_error(root, name):
    page = (root / "docs" / "evidence" / "tips.md").read_text(encoding="utf-8")
    stated = re.search(rf"^\| {re.escape(name)} \|(.*)\|$", page, re.MULTILINE)[1].split("|")
    errors = runpy.run_path(str(root / "benchmarks" / "tip_table.py"))["errors"]
    for tip in TIPS[name]:
        assert np.all(np.array(errors(tip, 0.35e-3)) <= np.array(stated, float)), tip
