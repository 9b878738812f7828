# SPDX-License-Identifier: Apache-2.0
"""Folders as other laboratories leave them: other starts, names without a pattern, files of any kind, mixed needles."""

import dataclasses
import json
import re
import zipfile

import numpy as np
import pytest
import simulated_runs as runs

import needleforce as nf
from needleforce.campaign import campaign
from needleforce.campaign.field_inference import infer_fields
from needleforce.identification.repeats import groups

PATTERN = "{specimen}_{repeat}"


def moved(recording: nf.Recording, zero: float) -> nf.Recording:
    """The same recording in another zero of the depth [m]."""
    return runs.changed(recording, depth=recording.depth - zero)


def started(seed: int, start: float, depth: float = 15e-3) -> nf.Recording:
    """An insertion that begins at ``start`` [m] and ends at ``depth`` [m], with the forces of ``runs.run``."""
    made = nf.simulate(nf.preset("paper"), nf.Motion.insert(start, 5e-3, depth, 1.0, True), runs.RATE)
    force = made.force + np.random.default_rng(seed).normal(0.0, runs.NOISE, len(made))
    return nf.Recording(made.time, made.depth, made.velocity, force)


def one_condition(folder, recordings, **options):
    for k, recording in enumerate(recordings, 1):
        nf.write(recording, folder / f"gel_{k}.csv")
    (condition,) = campaign(folder, **({"pattern": PATTERN} | options)).conditions
    return condition


@pytest.mark.parametrize("zero", ["of the machine", "at the start"])
def test_repeats_that_start_at_other_heights_are_pooled(tmp_path, zero):
    starts = (-4e-3, -4e-3, -9e-3, -2.5e-3, -13e-3)
    recordings = [started(k, start) for k, start in enumerate(starts)]
    if zero == "at the start":  # then only the contact shows that the strokes agree
        recordings = [moved(one, one.depth[0]) for one in recordings]
    condition = one_condition(tmp_path, recordings)
    assert len(condition.pooled) == 5 and condition.model is not None
    assert not any(one.anomalies for one in condition.recordings)
    assert condition.parameters["friction_per_length"].value == pytest.approx(18.6, rel=0.03)


def test_a_deeper_stroke_is_another_motion_from_wherever_it_starts(tmp_path):
    recordings = [started(k, -4e-3) for k in range(3)] + [started(4, -9e-3, 18e-3)]
    condition = one_condition(tmp_path, recordings)
    (anomaly,) = condition.recordings[3].anomalies
    assert anomaly.kind == "motion" and anomaly.left_out
    # 18 + 9 mm against 15 + 4 mm; the contact is at 0
    assert anomaly.value == pytest.approx(27e-3, abs=0.1e-3) and anomaly.usual == pytest.approx(19e-3, abs=0.1e-3)
    found = re.search(r"([\d.]+) mm beyond the contact, that of its repeats .* ([\d.]+) mm beyond", anomaly.sentence)
    assert [float(each) for each in found.groups()] == pytest.approx([18.0, 15.0], abs=0.15)


def test_strokes_without_a_most_frequent_depth_are_kept_with_a_reason(tmp_path):
    recordings = [started(k, -4e-3 - 1e-3 * k, 12e-3 + 2e-3 * k) for k in range(4)]
    condition = one_condition(tmp_path, recordings)
    assert condition.model is not None and len(condition.pooled) == 4
    sentences = [one.why for one in condition.recordings]
    assert all("end at different depths" in text and "beyond the contact" in text for text in sentences)


NAMES = [f"{where}_{rate}_{angle}_{k}" for where in ("gel", "pig_liver") for rate in (2, 5) for angle in (0, 15)
         for k in (1, 2, 3)]  # fmt: skip
SPEEDS = {name: 1e-3 * float(name.split("_")[-3]) * (1.0 + 0.01 * k) for k, name in enumerate(NAMES[:3])} | {
    name: 1e-3 * float(name.split("_")[-3]) for name in NAMES[3:]
}


def test_fields_are_decided_by_their_values():
    fields, note = infer_fields(NAMES, SPEEDS)
    assert fields["pig_liver_5_15_3"] == {"field_1": "pig_liver", "speed_mm_s": "5", "field_3": "15", "repeat": "3"}
    assert "field_1 (gel, pig_liver), field_3 (0, 15)" in note
    assert "--pattern '{field_1}_{speed_mm_s}_{field_3}_{repeat}'" in note


@pytest.mark.parametrize("factor", [1.2, 3.0])
def test_a_number_that_is_not_the_speed_is_not_named_so(factor):
    fields, _ = infer_fields(NAMES, {name: factor * speed for name, speed in SPEEDS.items()})
    assert not any("speed" in field for field in fields[NAMES[0]])


def test_a_speed_per_minute_is_found_in_its_unit():
    fields, _ = infer_fields([f"gel_{v}_{k}" for v in (60, 300) for k in (1, 2)],
                             {f"gel_{v}_{k}": v * 1e-3 / 60.0 for v in (60, 300) for k in (1, 2)})  # fmt: skip
    assert fields["gel_60_2"] == {"field_1": "gel", "speed_mm_min": "60", "repeat": "2"}


def test_one_speed_in_all_files_decides_nothing():
    fields, _ = infer_fields([f"gel_2_{k}" for k in (1, 2, 3)], {f"gel_2_{k}": 2e-3 for k in (1, 2, 3)})
    assert list(fields["gel_2_1"]) == ["field_1", "field_2", "repeat"]


def test_two_fields_that_count_are_both_undecided():
    names = [f"gel_{needle}_{k}" for needle in (1, 2, 3) for k in (1, 2, 3)]
    fields, note = infer_fields(names, {})
    assert list(fields["gel_1_1"]) == ["field_1", "field_2", "field_3"] and "none" in note


@pytest.mark.parametrize("date", ["2024-06-19-12-40-54", "20240619", "2024-06-19", "20240619T124054"])
def test_a_date_is_a_date(date):
    fields, _ = infer_fields([f"gel_{date}_1.csv", f"gel_{date}_2.csv"], {})
    assert fields[f"gel_{date}_1.csv"] == {"field_1": "gel", "date": date, "repeat": "1"}


@pytest.mark.parametrize("number", ["20241399", "19991"])
def test_a_number_that_is_no_day_is_no_date(number):
    fields, _ = infer_fields([f"gel_{number}_1", f"gel_{number}_2"], {})
    assert fields[f"gel_{number}_1"]["field_2"] == number


def test_unrelated_numbers_are_rarely_a_speed():
    # the stated rate: two values spread evenly over a decade, on a logarithmic scale
    random, found = np.random.default_rng(3), 0
    for _ in range(4000):
        values, speeds = 10.0 ** random.uniform(0.0, 1.0, (2, 2))
        named = {f"gel_{value:.3f}_{k}": 1e-3 * speed for value, speed in zip(values, speeds) for k in (1, 2)}
        found += any("speed" in field for field in next(iter(infer_fields(list(named), named)[0].values())))
    assert found < 0.006 * 4000


def test_a_folder_without_a_pattern_is_grouped_by_evidence(tmp_path):
    for speed in (4, 8):
        for k in (1, 2):
            nf.write(runs.run(10 * speed + k, speed=1e-3 * speed, hold=0.3), tmp_path / f"gel {speed} {k}.csv")
    done = campaign(tmp_path)
    assert [each.fields for each in done.conditions] == [{"field_1": "gel", "speed_mm_s": s} for s in ("4", "8")]
    assert all(len(each.pooled) == 2 for each in done.conditions) and "--pattern" in done.notes[0]


def test_a_field_with_a_unit_takes_only_numbers(tmp_path):
    for name in ("gel_5_1.csv", "gel_skin_1.csv"):
        nf.write(runs.run(1), tmp_path / name)
    done = campaign(tmp_path, pattern="{specimen}_{speed_mm_s}_{repeat}")
    (other,) = done.others
    assert other.file == "gel_skin_1.csv" and "{speed_mm_s} would be 'skin', which is not a number" in other.why


def test_every_file_of_the_folder_is_accounted_for(tmp_path):
    nf.write(runs.run(1), tmp_path / "gel_1.csv")
    nf.write(runs.run(2), tmp_path / "gel_2.csv")
    (tmp_path / "gel_2.csv").rename(tmp_path / "gel_2.asc")  # readable, with an ending of its own
    with zipfile.ZipFile(tmp_path / "runs.xlsx", "w") as book:
        book.writestr("xl/workbook.xml", "<workbook/>")
    (tmp_path / "notes.md").write_text("# What we did\n")
    (tmp_path / "photo.png").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(range(256)))
    done = campaign(tmp_path, pattern=PATTERN)
    assert {one.file for one in done.conditions[0].recordings} == {"gel_1.csv", "gel_2.asc"}
    (sheet,) = done.others
    assert sheet.file == "runs.xlsx" and sheet.status == "unreadable" and "Excel workbook" in sheet.why
    assert [file for file, _ in done.not_recordings] == ["notes.md", "photo.png"]
    assert all(why and str(tmp_path) not in why for _, why in done.not_recordings)
    assert len(json.loads(done.to_json())["not_recordings"]) == 2 and "photo.png is not a recording" in str(done)


def test_a_folder_of_sheets_only_is_listed(tmp_path):
    (tmp_path / "log.tdms").write_bytes(b"TDSm" + bytes(100))
    done = campaign(tmp_path)
    assert not done.conditions and "LabVIEW" in done.others[0].why
    (tmp_path / "log.tdms").rename(tmp_path / "log.rst")
    (tmp_path / "log.rst").write_text("nothing measured\n")
    with pytest.raises(nf.InputError, match=r"without recordings.*log\.rst"):
        campaign(tmp_path)


def test_repeats_of_two_needles_under_one_name_are_noticed(tmp_path):
    thick = {2, 3, 5}
    condition = one_condition(tmp_path, [runs.run(k, factor=1.5 if k in thick else 1.0) for k in range(1, 7)])
    (warning,) = (text for text in condition.warnings if "two groups" in text)
    assert "gel_2.csv, gel_3.csv, gel_5.csv is" in warning and "that of gel_1.csv, gel_4.csv, gel_6.csv" in warning
    size = float(warning.split(" % larger")[0].rsplit(" ", 1)[1])
    assert size == pytest.approx(50.0, abs=5.0)


def test_repeats_of_one_needle_form_no_groups(tmp_path):
    condition = one_condition(tmp_path, [runs.run(k) for k in range(1, 7)])
    assert not any("two groups" in text for text in condition.warnings)


@pytest.mark.parametrize("count", [4, 5, 6, 7, 9, 11, 16, 25])
def test_normal_scatter_forms_two_groups_in_one_of_two_hundred(count, many):
    # 0.5 % for each of the two parts of the curves; interpolated counts have a small error
    values = np.random.default_rng(count).normal(0.0, 1.0, (many(3000, 10_000), count))
    share = np.mean([groups(each, 0.0) is not None for each in values])
    assert share < 0.0075


def test_differences_within_the_noise_form_no_groups():
    apart = np.array([0.0, 1e-4, 1.0, 1.0001])
    assert groups(apart, 0.01) is not None and groups(apart, 0.25) is None


def test_every_row_has_its_residual_and_r2(done, by_specimen):
    made = done.table()
    pooled = made[(made.file == "") & made.specimen.eq("speed")]
    quality = by_specimen["speed"].quality
    assert set(pooled.residual_over_peak) == {quality.nrmse} and set(pooled.r2) == {quality.r2}
    for one in (each for each in done.recordings if each.quality is not None):
        own = made[made.file == one.file]
        assert set(own.residual_over_peak) == {one.quality.nrmse} and set(own.r2) == {one.quality.r2}
    assert f"{quality.r2:.3f}" in str(done) and f"{quality.r2:.3f}" in done._repr_html_()


def test_a_value_within_its_own_interval_of_zero_is_not_identified(tmp_path, capsys):
    # two repeats whose cutting forces differ by a factor: 12.7 standard errors of the mean are more than the mean
    condition = one_condition(tmp_path, [runs.run(1, cutting=0.02), runs.run(2, cutting=0.10)])
    cutting = condition.parameters["cutting_force"]
    assert cutting.high - cutting.value > cutting.value and not cutting.identifiable
    assert "interval is wider than the value" in cutting.source
    made = campaign(tmp_path, pattern=PATTERN).table()
    row = made[(made.file == "") & (made.quantity == "cutting_force")].iloc[0]
    assert not row.identifiable and "wider than the value" in row.why


def test_the_commands_table_shows_what_is_not_identified():
    from needleforce.commands.campaign import _row
    from needleforce.identification.estimates import Quality

    wide = nf.identification.Estimate("cutting_force", 0.9, "N", -3.4, 5.2, identifiable=False)
    condition = dataclasses.replace(_empty(), parameters={"cutting_force": wide}, quality=Quality(0.1, 0.19, 0.75))
    shown = [cell.replace("\N{NO-BREAK SPACE}", " ") for cell in _row(condition, ["cutting_force"])]
    assert shown[2:] == ["19 %", "0.750", "not identified: 0.9 ± 4.3 N"]


def _empty():
    from needleforce.campaign import Condition

    return Condition(fields={"specimen": "liver"}, recordings=())
