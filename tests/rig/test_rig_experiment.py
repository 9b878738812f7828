# SPDX-License-Identifier: Apache-2.0
"""The complete experiment: bytes, files, true values, and reading of its files."""

import numpy as np
import pytest

import needleforce as nf
from needleforce.rig import Experiment, Scatter, example_recording, paper_experiment

SMALL = {"sites": 2, "speeds": (3e-3,), "depth": 8e-3}
EQUAL = Scatter(0.0, 0.0, 0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def experiment() -> Experiment:
    return paper_experiment(1, sites=2, speeds=(3e-3,))


def test_the_same_seed_gives_the_same_bytes(tmp_path):
    first, again = (paper_experiment(4, **SMALL).write(tmp_path / folder) for folder in "ab")
    other = paper_experiment(5, **SMALL).write(tmp_path / "c")
    assert [path.name for path in first] == [path.name for path in again] == [path.name for path in other]
    for path, same, different in zip(first, again, other):
        assert path.read_bytes() == same.read_bytes() != different.read_bytes()


def test_it_is_the_papers_experiment():
    whole = paper_experiment(0, depth=6e-3)
    assert len(whole.runs) == 2 * 5 * 2 and len(whole.sites) == 2 * 5
    for first, second in whole.pairs():
        assert (first.site, first.speed) == (second.site, second.speed) and not first.second and second.second
        np.testing.assert_allclose(np.diff(first.time), 1e-3, atol=1e-12)
        assert np.median(np.diff(first.motion_time)) == pytest.approx(1.0 / 60.0, rel=1e-2)
        assert set(first.axes) == {"force", "fx", "fy", "tx", "ty", "tz"}


def test_file_names_have_speed_site_and_pass_and_there_are_no_other_files(tmp_path):
    counts = []
    written = paper_experiment(2, **SMALL).write(tmp_path, progress=lambda runs, text: counts.append(len(runs)) or runs)
    runs = [f"3mm_s_site{site}_pass{number}" for site in (1, 2) for number in (1, 2)]
    expected = {f"{run}_{stream}.csv" for run in runs for stream in ("force", "motion")}
    assert {path.name for path in tmp_path.iterdir()} == expected | {"needle_bending.csv", "tissue_tension.csv"}
    assert len(written) == 10 and counts == [4]


def test_a_file_read_with_its_motion_equals_the_run_in_memory(tmp_path, experiment):
    run = experiment.runs[0]
    force, motion = run.write(tmp_path)
    there, here = nf.read(force), run.recording()
    for name in ("time", "depth", "velocity", "force"):
        np.testing.assert_array_equal(getattr(there, name), getattr(here, name))
    np.testing.assert_array_equal(there.axes["ty"], here.axes["ty"])
    np.testing.assert_array_equal(nf.read(force, motion=motion).depth, here.depth)
    assert there.card.filter_length == here.card.filter_length == 10


def test_files_do_not_contain_the_true_values(tmp_path, experiment):
    text = experiment.runs[0].write(tmp_path)[0].read_text()
    assert not any(word in text for word in ("cutting", "friction", "modulus", "dimple"))


def test_the_recorded_depth_is_the_commanded_one(experiment):
    for first, second in experiment.pairs():
        assert first.recording().depth.max() == pytest.approx(16e-3, abs=0.03e-3)
        assert second.recording().depth.max() == pytest.approx(15.7e-3, abs=0.03e-3)
        assert first.recording().depth[-1] == pytest.approx(-4e-3, abs=0.05e-3)


def test_every_run_records_its_specimen_for_any_depth_of_the_surface():
    experiment = paper_experiment(8, sites=6, speeds=(3e-3,))
    assert min(site.surface for site in experiment.sites) < 0.0 < max(site.surface for site in experiment.sites)
    for number, site in enumerate(experiment.sites):
        for run, hole in zip(experiment.pairs()[number], (0.0, 16e-3 - site.surface)):
            recording = run.recording()
            true = site.specimen.force(recording.depth - site.surface, hole=hole)
            going = np.abs(recording.velocity) > 2.9e-3
            off = (recording.force - true)[going]
            assert abs(np.median(off)) < 4.0 * 2e-3 and np.percentile(np.abs(off - np.median(off)), 95) < 6e-3


def test_peak_and_its_depth_are_recorded_as_drawn_except_for_the_filter(experiment):
    for (first, _), site in zip(experiment.pairs(), experiment.sites):
        recording = first.recording()
        indentation = recording.depth - site.surface
        loading = (indentation < site.specimen.puncture_depth + 0.1e-3) & (np.arange(len(recording)) < 5000)
        peak = np.flatnonzero(loading)[recording.force[loading].argmax()]
        delay = 4.5e-3 * 3e-3 * 2.0 * site.specimen.reduced_modulus * 0.35e-3  # 1.3 mN too low
        assert recording.force[peak] == pytest.approx(site.specimen.puncture_force - delay, abs=4e-3)
        assert indentation[peak] == pytest.approx(site.specimen.puncture_depth, abs=0.05e-3)


def test_lateral_forces_are_recorded_and_small(experiment):
    recording, site = experiment.runs[0].recording(), experiment.sites[0]
    pressing = recording.force > 0.2
    lateral = [np.mean(recording.axes[axis][pressing]) / np.mean(recording.force[pressing]) for axis in ("fx", "fy")]
    np.testing.assert_allclose(lateral, site.lateral, atol=0.025)  # 3 standard deviations of the bias of 2 mN
    torque = np.polyfit(recording.force, recording.axes["ty"], 1)[0]
    assert torque == pytest.approx(80e-3 * site.lateral[0], abs=2e-5)


def test_truth_has_nominal_and_drawn_values(experiment):
    truth = experiment.truth
    assert set(truth) == {
        "needle_young_modulus", "tissue_young_modulus", "puncture_force", "puncture_indentation", "friction_per_length",
        "cutting_force",
    }  # fmt: skip
    assert truth["cutting_force"].nominal == 0.0776 and truth["friction_per_length"].nominal == 18.6
    assert truth["cutting_force"].drawn == np.mean([site.specimen.cutting_force for site in experiment.sites])
    assert truth["needle_young_modulus"].nominal == 14.1e9 and truth["tissue_young_modulus"].drawn == 116e3


def test_the_part_at_one_speed_has_its_own_truth():
    both = paper_experiment(1, sites=2, speeds=(2e-3, 3e-3), depth=6e-3)
    part = both.at(3e-3)
    assert {run.speed for run in part.runs} == {3e-3} and len(part.sites) == 2
    assert part.truth["cutting_force"] != both.truth["cutting_force"]
    with pytest.raises(nf.InputError, match=r"0\.002, 0\.003"):
        both.at(1e-3)


def test_changing_a_mean_changes_no_draw():
    few, more = (paper_experiment(3, cutting_force=force, **SMALL) for force in (0.0776, 1.2 * 0.0776))
    for a, b in zip(few.sites, more.sites):
        assert b.specimen.cutting_force == pytest.approx(1.2 * a.specimen.cutting_force, rel=1e-12)
        assert a.specimen.puncture_force == b.specimen.puncture_force and a.surface == b.surface
    np.testing.assert_array_equal(few.runs[1].motion_time, more.runs[1].motion_time)
    np.testing.assert_array_equal(few.runs[1].axes["force"], more.runs[1].axes["force"])  # a second pass never cuts


def recorded_difference(cutting_force):
    """First minus second pass, a mean over 4 to 11 mm of depth and over sites that do not scatter."""
    experiment = paper_experiment(6, cutting_force=cutting_force, sites=3, speeds=(3e-3,), scatter=EQUAL)
    grid = np.linspace(4e-3, 11e-3, 200)
    forces = []
    for run in experiment.runs:
        recording = run.recording()
        end = recording.depth.argmax()
        inwards = np.maximum.accumulate(recording.depth[:end])
        forces.append(np.interp(grid, inwards, recording.force[:end]).mean())
    return np.mean(forces[::2]) - np.mean(forces[1::2])


def test_the_recorded_difference_has_the_known_bias_and_follows_the_cutting_force():
    usual, more = recorded_difference(0.0776), recorded_difference(1.2 * 0.0776)
    left_over = 4.0 * 2e-3 * np.sqrt(2.0 / 3.0)  # biases of six runs, of which the reader removes the significant ones
    assert usual == pytest.approx(0.0776 - 18.6 * 0.8e-3, abs=left_over)
    assert more - usual == pytest.approx(0.2 * 0.0776, abs=0.3e-3)


def test_segmentation_finds_the_drawn_events(experiment):
    for (first, _), site in zip(experiment.pairs(), experiment.sites):
        events = nf.segment(first.recording())
        assert events.status == "ok" and len(events.punctures) == 1
        assert events.punctures[0].depth - site.surface == pytest.approx(site.specimen.puncture_depth, abs=0.1e-3)
        assert events.contact.depth == pytest.approx(site.surface, abs=0.25e-3)


def test_the_example_is_small_and_can_be_read(tmp_path):
    example = example_recording(1)
    path = nf.write(example, tmp_path / "example.csv")
    assert path.stat().st_size < 100_000
    assert example.rate == pytest.approx(100.0)
    back = nf.read(path)
    np.testing.assert_array_equal(back.depth, example.depth)
    assert len(nf.segment(back).punctures) == 1


@pytest.mark.parametrize(
    ("bad", "quantity"),
    [
        ({"seed": -1}, "seed"),
        ({"seed": 1.5}, "seed"),
        ({"sites": 0}, "sites"),
        ({"speeds": ()}, "speeds"),
        ({"speeds": (0.0,)}, "speeds"),
        ({"speeds": (3e-3, 3e-3)}, "speeds"),
        ({"depth": 1e-3}, "depth"),
        ({"depth": np.nan}, "depth"),
        ({"cutting_force": -1.0}, "force"),
        ({"friction_per_length": -1.0}, "per_length"),
    ],
)
def test_impossible_experiments_are_refused(bad, quantity):
    with pytest.raises(nf.InputError, match=quantity):
        paper_experiment(**({"seed": 1, "sites": 1, "speeds": (3e-3,), "depth": 6e-3} | bad))


def test_a_folder_that_cannot_be_made_is_an_error(tmp_path):
    (tmp_path / "taken").write_text("a file")
    with pytest.raises(nf.InputError, match="taken"):
        paper_experiment(1, **SMALL).write(tmp_path / "taken")
