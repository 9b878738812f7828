# SPDX-License-Identifier: Apache-2.0
"""One insertion whose depth and force are known at every time, as texts, and what is the same however it is written."""

import numpy as np
import pytest

import needleforce as nf

CONTACT, PUNCTURE, PEAK = 3.0, 7.0, 0.8  # mm, mm, N


def depth_of(time):
    """4 mm/s from 0.5 s on to 12 mm, a rest of 1 s, and back [mm]."""
    return np.clip(np.minimum(4.0 * (time - 0.5), 12.0 - 4.0 * (time - 4.5)), 0.0, 12.0)


def force_of(time):
    """A parabola up to the puncture, cutting and friction after it, friction alone on the way back [N]."""
    depth, back = depth_of(time), time > 4.5
    inside = np.where(depth > PUNCTURE, 0.3 + 0.03 * (depth - CONTACT), 0.05 * (depth - CONTACT) ** 2)
    return np.where(depth < CONTACT, 0.0, np.where(back, -0.03 * (depth - CONTACT), inside))


TIME = np.arange(0.0, 8.0, 0.01)
DEPTH = depth_of(TIME)
FORCE = force_of(TIME) + 0.003 * np.random.default_rng(11).normal(size=len(TIME))
ROWS = np.column_stack([TIME, DEPTH, FORCE])
DEFLECTION = 0.004 * np.arange(301)  # mm, of a bench test
HEAD = "time_s,depth_mm,force_N\n"


def rows(table=ROWS, sep=",", decimal=".", places=5, end="\n"):
    return "".join(sep.join(f"{v:.{places}f}".replace(".", decimal) for v in row) + end for row in table)


def written(tmp_path, text, name="run.csv"):
    path = tmp_path / name
    path.write_bytes(text.encode())
    return path


def check(run, time=TIME, *, force=FORCE, atol=2e-5):
    """All readings are there, each in its place."""
    assert len(run) == len(time)
    assert run.time - run.time[0] == pytest.approx(time - time[0], abs=1e-6)
    assert 1e3 * run.depth == pytest.approx(depth_of(time), abs=1e3 * atol)
    assert run.force == pytest.approx(force, abs=atol)


def case(recordings, name):
    found = recordings / "public-cases" / name
    if not found.exists():
        pytest.skip(f"no {found}")
    return found


def contact_mm(run):
    return 1e3 * nf.segment(run).contact.depth
