# SPDX-License-Identifier: Apache-2.0
"""Penetration tests that were measured elsewhere: peaks that were read by eye, and the summary of the sheet."""

import csv

import pandas as pd
import pytest

import needleforce as nf
from needleforce.bench_tests import penetration_test, penetration_tests

# ---- stalks punctured by a needle, measured elsewhere, read by eye before


def test_stalks_have_the_peaks_that_were_read(recordings, root):
    """Both walls of 21 stalks; waves below 2 N between the walls are not in the readings."""
    rows = (root / "tests" / "segmentation" / "eye_readings_stalks.csv").read_text().splitlines()
    readings = {row["recording"]: row for row in csv.DictReader(line for line in rows if line[0] != "#")}
    assert len(readings) == 21
    for name, row in readings.items():
        table = pd.read_csv(recordings / "other-labs" / "stalk-puncture-instron" / f"{name}.csv")
        _, depth, force = table.iloc[1:].astype(float).to_numpy().T
        test = penetration_test(1e-3 * depth, force, min_fall=2.0, baseline=False)
        eye = [tuple(map(float, each.split(">")[0].split(":"))) for each in row["punctures"].split()]
        zero = 1e3 * (test["contact_travel"].value if test["contact_travel"].value is not None else 1e-3 * depth[0])
        doubtful = [float(each.split(":")[0]) for each in row["doubtful"].split()]
        peaks = [each for each in test.features if each.kind == "peak"]
        peaks = [each for each in peaks if all(abs(1e3 * each.travel + zero - place) > 0.1 for place in doubtful)]
        assert [1e3 * each.travel + zero for each in peaks] == pytest.approx([place for place, _ in eye], abs=0.1), name
        assert [each.force for each in peaks] == pytest.approx([force for _, force in eye], abs=0.5), name


# ---- microneedles in a film, measured elsewhere


@pytest.fixture(scope="module")
def sheet(recordings):
    """(name, summary, forces or text) of every named column, by openpyxl alone."""
    openpyxl = pytest.importorskip("openpyxl")
    path = recordings / "other-labs" / "microneedle-penetration" / "microneedle-data-2.xlsx"
    rows = list(openpyxl.load_workbook(path, data_only=True)["RAW DATA"].iter_rows(min_row=2, values_only=True))
    head = next(k for k, row in enumerate(rows) if row[0] is not None)
    columns = list(zip(*rows[head:]))
    return [
        (name, summary, [x for x in cells if isinstance(x, float | int)], next((x for x in cells if x), ""))
        for name, summary, *cells in columns
        if name
    ]


@pytest.fixture(scope="module")
def microneedles(sheet):
    """The recorded zero of the force is kept, as in the summary of the sheet."""
    many = {name: (5e-6, force) if force else nf.InputError("force", text) for name, _, force, text in sheet}
    return penetration_tests(many, baseline=False)


def test_microneedles_are_all_there(sheet, microneedles):
    assert len(sheet) == len(microneedles) == 250 and len(microneedles.groups) == 50
    assert sum(bool(force) for _, _, force, _ in sheet) == 228
    broken = [name for name, _, force, text in sheet if text == "Broken"]
    assert broken == ["WT1.1-3", "WT1.2-2", "WT1.3-2", "WT1.4-3", "WT1.5-2", "OD2.2-2"]
    for name in broken:
        assert "Broken" in microneedles[name]["entry_force"].reason


def test_maximum_of_every_microneedle(sheet, microneedles):
    for name, _, force, _ in sheet:
        if force:
            figure = microneedles[name]["max_force"]
            slack = 4.0 * microneedles[name].noise
            assert figure.low - slack <= max(force) <= figure.high + slack, name


def test_the_summary_row_is_the_peak_at_tip_entry(sheet, microneedles):
    """226 of 228 columns are summarised by the reading of a peak; the other two by the last one and by ``DNP``."""
    read, differ = [], []
    for name, summary, force, _ in sheet:
        if not force:
            assert summary == "#N/A", name
            continue
        features = microneedles[name].features
        if features and isinstance(summary, float | int):
            read.append(name)
            if abs(features[0].reading - summary) > 1e-9:
                differ.append(name)
    assert len(read) >= 226
    # a smaller fall before the peak; one of 0.2 N that the noise explains; a needle whose summary is its last reading
    assert set(differ) <= {"WT1.1-2", "WT1.2-1", "OD2.2-1"}


def test_microneedles_show_no_drag(sheet, microneedles):
    """They are pressed in until the base touches the film: no curve ends in a plateau."""
    for name, _, force, _ in sheet:
        if force:
            assert microneedles[name]["drag"].value is None and microneedles[name]["drag"].reason, name
