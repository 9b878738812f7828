# SPDX-License-Identifier: Apache-2.0
"""Recordings of others against what the eye read from their plots before there was a detector (eye_readings.csv).

Thresholds were set on the odd repeats; the bounds below are the reading's own uncertainty, not the detector's output.
"""

import csv
import re
from pathlib import Path

import numpy as np
import pytest

from needleforce.errors import InputError
from needleforce.recording import read
from needleforce.segmentation import segment

TABLE = Path(__file__).with_name("eye_readings.csv")
READING = 0.15  # [mm] half a grid step plus the width of the line


def rows():
    with TABLE.open() as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def repeat(name):
    """The number before the date, after specimen, speed, angle and needle; 2, even, where a name has none."""
    found = re.search(r"_\d+_\d+_\d+_(\d+)_\d{4}-", name)
    return int(found[1]) if found else 2


def depths(text):
    return [float(each.split(":")[0]) for each in text.split()]


def near(depth, readings):
    """A peak may be up to 0.4 mm before the edge that was read by eye, and hardly after it."""
    return any(-0.4 <= depth - each <= READING for each in readings)


@pytest.fixture(scope="module", params=[1, 0], ids=["odd", "even"])
def half(request, recordings):
    """Eye reading, recording and events of every readable file of one half."""
    found = []
    for row in rows():
        if repeat(row["recording"]) % 2 != request.param:
            continue
        try:
            run = read(
                recordings / "needle-insertion-rig" / f"{row['recording']}.csv",
                columns={"force": "fz", "depth": "pz", "time": "time"},
                units={"time": "us", "depth": "mm", "force": "N"},
            )
        except InputError:
            assert row["remarks"].startswith("no motion")
            continue
        found.append((row, run, segment(run)))
    return found


def test_the_table_has_every_file(recordings):
    files = {path.stem for path in (recordings / "needle-insertion-rig").glob("*.csv")}
    assert {row["recording"] for row in rows()} == files


def test_contact_agrees_with_the_eye_reading(half):
    errors = []
    for row, run, events in half:
        assert (events.contact is None) == (not row["contact"]), row["recording"]
        if events.contact is None:
            assert events.status == "no_contact"
            continue
        seen = float(row["contact"])
        low, high = 1e3 * run.depth[[events.contact.low, events.contact.high]]
        assert low - READING <= seen <= high + READING, row["recording"]
        errors.append(abs(1e3 * events.contact.depth - seen))
    assert np.median(errors) < READING
    assert np.mean(np.array(errors) < 4 * READING) > 0.9


def test_punctures_agree_with_the_eye_readings(half):
    missed, false, wanted = [], [], 0
    for row, _, events in half:
        sharp, soft = depths(row["punctures"]), depths(row["doubtful"])
        found = [1e3 * each.depth for each in events.punctures]
        wanted += len(sharp)
        missed += [(row["recording"], z) for z in sharp if not any(near(x, [z]) for x in found)]
        false += [(row["recording"], x) for x in found if not near(x, sharp + [z + READING for z in soft])]
    assert wanted > 50
    assert len(missed) <= 0.03 * wanted, missed
    assert len(false) <= 0.03 * wanted, false


def test_exit_is_between_the_last_step_and_the_return_to_the_baseline(half):
    outside = []
    for row, run, events in half:
        if not row["contact"]:
            continue
        assert events.exit is not None, row["recording"]
        last, back = 1e3 * run.depth[[events.exit.low, events.exit.high]]
        seen = sorted((float(row["exit"]), float(row["last_step"])))
        assert back - 2 * READING <= seen[1] and seen[0] <= last + 2 * READING, row["recording"]
        outside.append(max(0.0, seen[0] - 1e3 * events.exit.depth, 1e3 * events.exit.depth - seen[1]))
    assert np.median(outside) < READING
    assert np.mean(np.array(outside) < 4 * READING) > 0.9


def test_status_and_phases(half):
    for row, run, events in half:
        if not row["contact"]:
            continue
        assert events.status == ("ok" if events.punctures else "no_puncture"), row["recording"]
        spans = {span.phase: span for span in events.phases}
        hold = spans["hold"]
        assert hold.end - hold.start == pytest.approx(5.3, abs=0.2)
        assert np.ptp(run.depth[hold.first : hold.last]) < 0.05e-3
