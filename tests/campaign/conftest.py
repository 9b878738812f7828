# SPDX-License-Identifier: Apache-2.0
"""A campaign with one file for every fault, identified once for all tests."""

from pathlib import Path

import pytest
import simulated_runs as runs

import needleforce as nf
from needleforce.campaign import Campaign, campaign

# specimen -> its faulty file; the others of each specimen are valid
FAULTS = {
    "sign": runs.wrong_sign,
    "pounds": lambda seed: runs.other_unit(seed, 1.0 / 4.4482),
    "millinewtons": lambda seed: runs.other_unit(seed, 1000.0),
    "millimetres": runs.millimetres,
    "saturated": runs.saturated,
    "dropped": runs.dropped,
    "drift": runs.drifting,
    "unpierced": runs.never_pierced,
    "speed": lambda seed: runs.run(seed, speed=6e-3),
    "travel": lambda seed: runs.run(seed, depth=16e-3),
    "hold": lambda seed: runs.run(seed, hold=2.0),
    "outlier": lambda seed: runs.run(seed, puncture=4.5e-3),
    "label": lambda seed: runs.run(seed, factor=2.0),
    "dies": runs.dying,
}
BAD = 4  # the faulty repeat
UNREADABLE = {"empty": "", "text": "these are\nno numbers\n", "depthless": "time_s,force_N\n0,0\n0.1,1\n0.2,2\n"}


@pytest.fixture(scope="session", autouse=True)
def one_processor():
    """In this process, unless a test asks for more: the tests themselves run side by side."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("needleforce.running.workers.processors", lambda: 1)
        yield


@pytest.fixture(scope="session")
def folder(tmp_path_factory) -> Path:
    """Two or three valid repeats and a faulty one of each specimen, and files that are not recordings."""
    made, seed = tmp_path_factory.mktemp("simulated"), 0
    for specimen, fault in FAULTS.items():
        for repeat in (1, 2, 3, BAD) if specimen == "outlier" else (1, 2, BAD):
            seed += 1
            nf.write(fault(seed) if repeat == BAD else runs.run(seed), made / f"{specimen}_{repeat}.csv")
    for repeat in (1, 2, 3):
        nf.write(runs.run(500 + repeat, factor=2.0), made / f"double_{repeat}.csv")
    for repeat in (1, 2, BAD):
        nf.write(runs.two_close_punctures(600 + repeat, 20 * (repeat == BAD)), made / f"close_{repeat}.csv")
    (made / "double_4.csv").write_bytes((made / "double_2.csv").read_bytes())
    for repeat, (name, text) in enumerate(UNREADABLE.items(), 5):
        (made / f"double_{repeat}-{name}.csv").write_text(text)
    nf.write(runs.run(700), made / "stray.csv")
    return made


@pytest.fixture(scope="session")
def done(folder) -> Campaign:
    return campaign(folder, pattern="{specimen}_{repeat}")


@pytest.fixture(scope="session")
def by_file(done) -> dict:
    return {one.file: one for one in done.recordings}


@pytest.fixture(scope="session")
def by_specimen(done) -> dict:
    return {condition.fields["specimen"]: condition for condition in done.conditions}
