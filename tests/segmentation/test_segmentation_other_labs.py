# SPDX-License-Identifier: Apache-2.0
"""Punctures of other laboratories: stalks, read by eye before the detector ran on them, and microneedles in a film."""

import csv
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from needleforce.recording.recording import Recording
from needleforce.segmentation import segment

TABLE = Path(__file__).with_name("eye_readings_stalks.csv")
READING = 0.3  # [mm] most of a grid step of the plots
STEP = 5e-6  # [m] travel between two samples of the microneedles
NOMINAL_SPEED = 1e-3  # [m/s] not stated in the sheet


def depths(text):
    return [float(each.split(":")[0]) for each in text.split()]


@pytest.fixture(scope="module")
def stalks(recordings):
    """Eye reading and events of every stalk."""
    with TABLE.open() as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    found = []
    for row in rows:
        path = recordings / "other-labs" / "stalk-puncture-instron" / f"{row['recording']}.csv"
        time, depth, force = pd.read_csv(path).iloc[1:].astype(float).to_numpy().T
        found.append((row, segment(Recording(time, 1e-3 * depth, np.gradient(1e-3 * depth, time), force))))
    return found


def test_both_walls_of_every_stalk_are_punctures(stalks):
    for row, events in stalks:
        found = [1e3 * each.depth for each in events.punctures]
        for seen in depths(row["punctures"]):
            assert any(abs(seen - each) <= READING for each in found), (row["recording"], seen, found)
        allowed = depths(row["punctures"]) + depths(row["doubtful"])
        assert all(any(abs(seen - each) <= READING for seen in allowed) for each in found), (row["recording"], found)
        assert all(each.gradual for each in events.punctures)


def test_contact_with_the_stalk(stalks):
    errors = [1e3 * events.contact.depth - float(row["contact"]) for row, events in stalks]
    assert np.median(np.abs(errors)) < READING and max(map(abs, errors)) < 2 * READING


def microneedles(path):
    """Names and forces [N] of the curves; the third row is a summary."""
    pytest.importorskip("openpyxl")
    sheet = pd.read_excel(path, header=None, sheet_name="RAW DATA", engine="openpyxl")
    for column in sheet.columns[sheet.iloc[1].notna()]:
        force = pd.to_numeric(sheet.iloc[3:, column], errors="coerce").dropna().to_numpy(float)
        if len(force) >= 50:
            yield sheet.iloc[1, column], force


def steep_falls(force):
    """Samples of local maxima after which the force falls by 30 % within 25 µm."""
    near = [(k, force[max(k - 5, 0) : k + 6]) for k in range(5, len(force) - 5)]
    tops = [k for k, part in near if force[k] > 0.3 and force[k] == part.max()]
    return [k for k in tops if force[k + 1 : k + 6].min() < 0.7 * force[k]]


def test_microneedles_that_begin_in_contact(recordings):
    """A steep fall in a recording without free travel; 270 of 450 such curves were found
    (420 with free travel put in front)."""
    total, missed = 0, []
    for name, force in microneedles(recordings / "other-labs" / "microneedle-penetration" / "microneedle-data-2.xlsx"):
        falls = steep_falls(force)
        depth = STEP * np.arange(len(force))
        events = segment(Recording(depth / NOMINAL_SPEED, depth, np.full(len(depth), NOMINAL_SPEED), force))
        assert events.contact is not None, name
        total += len(falls)
        bounds = [(each.low - 5, each.high + 5) for each in events.punctures]
        missed += [(name, k) for k in falls if not any(low <= k <= high for low, high in bounds)]
    assert total > 190
    assert len(missed) <= 0.05 * total, missed
