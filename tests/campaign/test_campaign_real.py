# SPDX-License-Identifier: Apache-2.0
"""A real campaign: 94 insertions by a robot, with the names of its authors."""

import re
from collections import Counter

import numpy as np
import pytest
import simulated_runs as runs

import needleforce as nf
from needleforce.campaign import campaign

PATTERN = "{rig}__{specimen}_{speed_mm_s}_{angle_deg}_{needle}_{repeat}_{date}"


@pytest.fixture(scope="module")
def names(recordings) -> list[str]:
    return sorted(path.name for path in (recordings / "needle-insertion-rig").glob("*.csv"))


@pytest.fixture(scope="module")
def real(recordings, names):
    """By one law: what the tests of names, motions and labels look at does not depend on it."""
    return campaign(recordings / "needle-insertion-rig", pattern=PATTERN, model="paper")


def counted(names) -> Counter:
    """Repeats grouped by all but the last two fields, for names with six fields after the folders."""
    matches = (re.fullmatch(r"(.*__[^_]+_\d+_\d+_\d+)_\d+_[\d-]+\.csv", name) for name in names)
    return Counter(match[1] for match in matches if match)


@pytest.mark.long
def test_every_file_has_a_result(real, names):
    assert sorted(one.file for one in real.recordings) == names and len(names) == 94
    assert len(real.others) == len(names) - sum(counted(names).values())
    assert set(real.table().file) == {*names, ""}


@pytest.mark.long
def test_the_conditions_are_those_of_the_names(real, names):
    expected = counted(names)
    got = {
        "{rig}__{specimen}_{speed_mm_s}_{angle_deg}_{needle}".format(**each.fields): len(each.recordings)
        for each in real.conditions
    }
    assert got == dict(expected)
    assert sum(count >= 3 for count in got.values()) == sum(count >= 3 for count in expected.values()) == 14


@pytest.mark.long
def test_without_a_pattern_the_names_give_the_same_conditions(recordings, names, real):
    from needleforce.campaign.field_inference import infer_fields

    speeds = {one.file: one.measured["speed"].value for one in real.recordings if "speed" in one.measured}
    fields, note = infer_fields(names, speeds)
    groups = Counter(tuple(v for k, v in own.items() if k not in ("repeat", "date")) for own in fields.values())
    by_name = Counter(name.rsplit("_", 2)[0] for name in fields)
    assert sorted(groups.values()) == sorted(by_name.values()) and set(counted(names)) <= set(by_name)
    assert "speed_mm_s, repeat, date" in note


@pytest.mark.long
@pytest.mark.parametrize("place", range(14))
def test_a_condition_with_repeats_is_identified_and_rarely_has_anomalies(recordings, names, place):
    repeated = sorted(name for name, count in counted(names).items() if count >= 3)
    assert len(repeated) == 14
    (found,) = campaign(f"{recordings}/needle-insertion-rig/{repeated[place]}_*.csv", pattern=PATTERN).conditions
    assert found.model is not None and len(found.recordings) == counted(names)[repeated[place]]
    # strokes of another length and falls without a sharp drop; no other fault is visible in these
    assert {anomaly.kind for one in found.recordings for anomaly in one.anomalies} <= {"motion", "no_puncture"}


@pytest.mark.long
def test_strokes_of_another_length_are_reported(real):
    # nine insertions at 15 degrees: the stage moved by 25 mm in four of them, by 30 mm in five
    moved = [one for one in real.recordings if any(anomaly.kind == "motion" for anomaly in one.anomalies)]
    assert len(moved) == 4
    assert all(one.fields["angle_deg"] == "15" and one.left_out for one in moved)
    assert {round(1e3 * one.measured["travel"].value) for one in moved} == {25}


@pytest.mark.long
def test_few_punctures_of_valid_recordings_are_not_sharp(real):
    kinds = Counter(anomaly.kind for each in real.conditions for one in each.recordings for anomaly in one.anomalies)
    assert kinds["no_puncture"] <= 4


@pytest.mark.long
def test_what_could_not_be_read_is_in_the_table(real):
    made = real.table()
    unreadable = made[(made.quantity == "anomalies") & (made.status == "unreadable")]
    assert len(unreadable) == 1 and "the needle must move" in unreadable.iloc[0].why


@pytest.mark.long
@pytest.mark.parametrize(
    "kind, spoil",
    [
        ("sign", lambda force: -force),
        ("force_unit", lambda force: force / 4.4482216152605),
        ("saturated", lambda force: np.minimum(force, 0.75 * force.max())),
        ("drift", lambda force: force + np.linspace(0.0, 0.1 * force.max(), len(force))),
    ],
)
def test_a_fault_added_to_a_real_recording_is_named(recordings, tmp_path, kind, spoil):
    files = sorted((recordings / "needle-insertion-rig").glob("dev__control-needle__skin_2_0_2_*.csv"))
    bad = files[1]
    one = nf.read(bad)
    nf.write(runs.changed(one, force=spoil(one.force)), tmp_path / bad.name)
    (condition,) = campaign([tmp_path / bad.name, *(each for each in files if each != bad)], pattern=PATTERN).conditions
    named = {one.file.rsplit("/", 1)[-1]: [anomaly.kind for anomaly in one.anomalies] for one in condition.recordings}
    assert len(named) == 5 and condition.model is not None
    assert kind in named.pop(bad.name) and not any(named.values())


def moved(real):
    """Every even repeat labelled as every condition of another specimen: curves and files of each."""
    from needleforce.campaign.checks import wrong_labels

    curves = {each.name: {one.file: one.curve for one in each.recordings} for each in real.conditions}
    pooled = {each.name: [one.file for one in each.recordings if not one.left_out] for each in real.conditions}
    large = [each for each in real.conditions if len(each.recordings) >= 3]
    even = [(each, one) for each in large for one in each.recordings if int(one.fields["repeat"]) % 2 == 0]
    for home, one in even:
        for other in large:
            if other.fields["specimen"] == home.fields["specimen"] or one.left_out:
                continue
            swapped = {name: dict(own) for name, own in curves.items()}
            swapped[other.name][one.file] = swapped[home.name].pop(one.file)
            rest = pooled | {home.name: [file for file in pooled[home.name] if file != one.file]}
            rest[other.name] = [*pooled[other.name], one.file]
            yield one.file, dict(wrong_labels(swapped, rest))


@pytest.mark.long
def test_three_of_four_recordings_under_another_specimens_name_are_found(real):
    tried = list(moved(real))
    found = sum(file in named for file, named in tried)
    wrongly = sum(len(named) - (file in named) for file, named in tried)
    assert len(tried) > 200 and found > 0.7 * len(tried)
    assert wrongly < 0.001 * len(real.recordings) * len(tried)
