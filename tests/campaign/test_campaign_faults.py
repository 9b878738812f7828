# SPDX-License-Identifier: Apache-2.0
"""Every kind of faulty recording is described, and the fit uses the others or states why it cannot."""

import numpy as np
import pytest
import simulated_runs as runs

import needleforce as nf
from needleforce.campaign import campaign

BAD = 4
# specimen -> kind, words of the sentence, and whether the pooled fit leaves it out
NAMED = {
    "dies": ("dead", ("exactly 0.", "from 2 s on", "channel is dead"), True),
    "sign": ("sign", ("wrong sign", "during insertion", "--unit force=-N"), True),
    "pounds": ("force_unit", ("another unit", "4.448 times smaller", "lbf and N"), True),
    "millinewtons": ("force_unit", ("1000 times larger", "mN and N"), True),
    "millimetres": ("depth_unit", ("travel of 18", "1000 times larger", "mm and m"), True),
    "saturated": ("saturated", ("extreme of 0.15", "consecutive samples", "up to the puncture"), True),
    "speed": ("motion", ("speed is 6 mm/s", "repeats 5 mm/s"), True),
    "travel": ("motion", ("travel is 20 mm", "repeats 19 mm"), True),
    "hold": ("motion", ("hold is 2", "repeats 1"), True),
    "dropped": ("dropped", ("dropped", "longest gap is 0.4"), False),
    "drift": ("drift", ("baseline drifts", "before the contact", "after the exit"), False),
    "unpierced": ("no_puncture", ("has no puncture", "2 of its 2 repeats"), False),
    "close": ("close_punctures", ("closer than the filter", "average of 40"), False),
    "outlier": ("outlier", ("puncture indentation is 4.", "repeats, 3."), False),
    "label": ("label", ("label may be wrong", "condition double"), False),
}


@pytest.mark.parametrize("specimen", NAMED)
def test_a_fault_is_named(by_file, specimen):
    kind, words, left_out = NAMED[specimen]
    one = by_file[f"{specimen}_{BAD}.csv"]
    assert kind in [anomaly.kind for anomaly in one.anomalies]
    text = " ".join(anomaly.sentence for anomaly in one.anomalies if anomaly.kind == kind)
    assert all(word in text for word in words), text
    assert one.left_out is left_out and not (left_out and one.pooled)


def test_valid_recordings_have_no_anomalies(by_file):
    anomaly = {file: one.why for file, one in by_file.items() if one.anomalies and f"_{BAD}" not in file}
    assert set(anomaly) == {"stray.csv"}


@pytest.mark.parametrize("specimen", NAMED)
def test_the_fit_uses_the_other_repeats(by_specimen, specimen):
    condition = by_specimen[specimen]
    without = NAMED[specimen][2] or specimen == "unpierced"  # which has no parameters to pool
    assert len(condition.recordings) - len(condition.pooled) == without and condition.model is not None


def test_the_pooled_values_use_only_the_other_repeats(by_specimen, folder):
    expected = nf.identify([nf.read(folder / f"sign_{repeat}.csv") for repeat in (1, 2)])
    pooled = by_specimen["sign"].parameters
    assert {name: (each.value, each.low, each.high) for name, each in pooled.items()} == {
        name: (each.value, each.low, each.high) for name, each in expected.parameters.items()
    }


def test_the_truth_is_found(by_specimen):
    # the preset's friction per length, 18.6 N/m, and twice that; specimens differ by 1 %
    for specimen, factor in (("speed", 1.0), ("double", 2.0)):
        friction = by_specimen[specimen].parameters["friction_per_length"].value
        assert friction == pytest.approx(factor * nf.preset("paper").friction.per_length, rel=0.03)


def test_a_copy_counts_once(by_file, by_specimen):
    copy = by_file["double_4.csv"]
    assert [anomaly.kind for anomaly in copy.anomalies] == ["copy"] and "double_2.csv" in copy.why and not copy.pooled
    assert len(by_specimen["double"].pooled) == 3


def test_unreadable_files_do_not_stop_the_campaign(by_file):
    words = {"double_5-empty.csv": "empty", "double_6-text.csv": "", "double_7-depthless.csv": "depth"}
    for file, word in words.items():
        one = by_file[file]
        assert one.status == "unreadable" and not one.has_parameters and one.why.startswith(file) and word in one.why


def test_a_missing_file_is_reported(folder):
    found = campaign([folder / "double_1.csv", folder / "double_9.csv"], pattern="{specimen}_{repeat}")
    gone = next(one for one in found.recordings if one.file == "double_9.csv")
    assert gone.status == "unreadable" and gone.why and found.conditions[0].model is not None
    (alone,) = campaign([folder / "doubl"]).others
    assert alone.why.startswith("doubl: file is missing") and "condition" not in alone.why


def test_a_file_of_no_condition_is_identified_by_itself(done):
    (stray,) = done.others
    assert stray.file == "stray.csv" and stray.has_parameters and not stray.pooled
    assert "{specimen}_{repeat}" in stray.why and "'_' before {repeat} in 'stray'" in stray.why


def test_two_equally_frequent_motions_are_all_left_out(tmp_path):
    for repeat in range(4):
        nf.write(runs.run(800 + repeat, speed=5e-3 if repeat < 2 else 7e-3), tmp_path / f"gel_{repeat}.csv")
    (condition,) = campaign(tmp_path, pattern="{specimen}_{repeat}").conditions
    assert condition.model is None and "none of them is the most frequent" in condition.why
    assert all(one.has_parameters and one.left_out for one in condition.recordings)


def test_a_speed_that_its_label_contradicts(tmp_path):
    nf.write(runs.run(820), tmp_path / "gel_2.csv")
    (condition,) = campaign(tmp_path, pattern="{specimen}_{speed_mm_s}").conditions
    (anomaly,) = condition.recordings[0].anomalies
    assert anomaly.kind == "label" and "speed_mm_s is 2 mm/s" in anomaly.sentence and "at 5 mm/s" in anomaly.sentence


@pytest.mark.parametrize("free", [20e-3, 4e-3])
def test_a_force_without_noise_and_its_return_to_the_baseline_are_no_dead_channel(tmp_path, free):
    for depth in (14e-3, 15e-3):
        made = nf.simulate(nf.preset("paper"), nf.Motion.insert(-free, 5e-3, depth, 1.0, True), 200.0)
        nf.write(made, tmp_path / f"gel_{1e3 * depth:.0f}.csv")
    (condition,) = campaign(tmp_path, pattern="{specimen}_{repeat}").conditions
    assert not any(anomaly.kind == "dead" for one in condition.recordings for anomaly in one.anomalies)


def test_saturation_beyond_the_puncture_is_kept(tmp_path):
    one = runs.run(830)
    nf.write(runs.changed(one, force=np.minimum(one.force, 0.3)), tmp_path / "gel_1.csv")
    (condition,) = campaign(tmp_path, pattern="{specimen}_{repeat}").conditions
    (anomaly,) = condition.recordings[0].anomalies
    assert anomaly.kind == "saturated" and "beyond the puncture" in anomaly.sentence and not anomaly.left_out


def test_a_coarse_sensor_is_not_saturated(tmp_path):
    one = runs.run(840)
    nf.write(runs.changed(one, force=np.round(one.force / 0.01) * 0.01), tmp_path / "gel_1.csv")
    (condition,) = campaign(tmp_path, pattern="{specimen}_{repeat}").conditions
    assert condition.recordings[0].anomalies == ()


def test_an_unknown_model_is_wrong_usage(folder):
    with pytest.raises(nf.InputError, match="model"):
        campaign(folder / "speed_1.csv", model="no such model")


def test_recordings_without_an_insertion_are_explained(tmp_path):
    random = np.random.default_rng(5)
    time = np.arange(0.0, 5.0, 0.01)
    depth = np.interp(time, [0.0, 2.0, 3.0, 5.0], [0.0, 0.02, 0.02, 0.0])
    noise = random.normal(0.0, 1.0, len(time))
    forces = {"zero": 0.0 * time, "constant": 0.0 * time + 1.0, "noise": noise, "huge": 1e300 * noise,
              "tiny": 1e-300 * noise, "step": 1.0 * (depth > 0.01)}  # fmt: skip
    for number, (name, force) in enumerate(forces.items()):
        for specimen in ("mixed", name):
            still = depth + 1e-9 * number * (specimen == name)  # other bytes
            nf.write(nf.Recording(time, still, 0.0 * time, force), tmp_path / f"{specimen}_{number}.csv")
    done = campaign(tmp_path, pattern="{specimen}_{repeat}")
    assert len(done.recordings) == 2 * len(forces)
    assert all(one.why and not one.has_parameters for one in done.recordings)
    assert not any(anomaly.kind == "saturated" for one in done.recordings for anomaly in one.anomalies)
    done.report(tmp_path / "report.html")
    assert "NaN" not in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_only_the_recordings_of_one_condition_are_in_memory(folder, monkeypatch):
    import weakref

    from needleforce.recording.reader import RecordingFile

    read, alive, counts = RecordingFile.read, weakref.WeakSet(), []

    def watched(opened, part):
        recording, spans = read(opened, part)
        counts.append(len(alive))
        alive.add(recording)
        return recording, spans

    monkeypatch.setattr(RecordingFile, "read", watched)
    files = [folder / f"{specimen}_{repeat}.csv" for specimen in ("sign", "speed", "travel") for repeat in (1, 2, BAD)]
    campaign(files, pattern="{specimen}_{repeat}")
    assert len(counts) == 9 and max(counts) <= 3
