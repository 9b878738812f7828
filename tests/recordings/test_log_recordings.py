# SPDX-License-Identifier: Apache-2.0
"""Logs read as recordings: of this package, of other recorders, and recordings written as logs."""

import hashlib

import numpy as np
import plain_log
import pytest
from plain_insertion import insertion
from rosbags.typesys import Stores, get_typestore

import needleforce as nf
from needleforce.recording import Card, Note, Recording
from needleforce.recording.log import LogWriter, read_log, write_log

STORE = get_typestore(Stores.ROS2_HUMBLE)


def kinds(recording):
    return {note.kind: note for note in recording.notes}


@pytest.fixture
def path(tmp_path):
    return tmp_path / "run.mcap"


def test_an_insertion_is_read_in_si_on_one_clock(path):
    plain_log.write(path)
    recording = nf.read(path, baseline=False)
    number = np.arange(497)  # up to the last state of the axis
    np.testing.assert_allclose(recording.time, number * 1e-3, atol=1e-9)
    np.testing.assert_allclose(recording.depth, number * 1e-6, atol=1e-12)
    np.testing.assert_allclose(recording.velocity, 1e-3, rtol=1e-12)
    assert recording.force.tolist() == [1e-3 * n for n in number]
    assert recording.axes["tx"].tolist() == [0.3] * 497 and set(recording.axes) == {"fx", "fy", "tx", "ty", "tz"}
    card = recording.card
    assert (card.needle, card.tissue, card.rig, card.filter_length) == ("trocar", "gel", "bench", 50)
    assert card.sha256 == hashlib.sha256(path.read_bytes()).hexdigest() and card.source == str(path)
    assert nf.read(path, filter_length=7).card.filter_length == 7


def test_the_axial_axis_is_assumed_only_if_it_is_not_given(path, tmp_path):
    plain_log.write(path)
    assert "axial" in read_log(path).card
    assert not any("along the needle" in sentence for sentence in nf.read(path).card.assumptions)
    plain = tmp_path / "plain.mcap"
    log = LogWriter(plain, {})
    for number in range(100):
        at = number * 1_000_000
        log.wrench(number, at, at, at, (0, 0, float(number), 0, 0, 0))
        log.state(number, at, at, at, 1e-6 * number, 1e-3)
    log.close({})
    sentence = "the force along the needle is fz of the sensor"
    assert sentence in nf.read(plain).card.assumptions
    assert sentence not in nf.read(plain, columns={"force": "fz"}).card.assumptions


def test_two_drifting_clocks_are_aligned(path):
    """Sensor 50 ppm fast from any zero, axis 200 ppm slow from another; packets arrive with random delays."""
    chance, count, log = np.random.default_rng(3), 20_000, LogWriter(path, {})
    late = chance.exponential(200e3, (count, 2)).astype(int).tolist()
    for number in range(count):
        true = number * 1_000_000
        sensor, axis = int(true * 1.00005) + 777, int(true * 0.9998) + 10**12
        log.wrench(number, plain_log.START + true + late[number][0], sensor, 0, (0, 0, number, 0, 0, 0))
        if number % 16 == 0:
            log.state(number // 16, plain_log.START + true + late[number][1], axis, 0, 1e-6 * number, 1e-3)
    log.close({})
    recording = nf.read(path, baseline=False)
    number = recording.force
    np.testing.assert_allclose(recording.time, number * 1e-3, atol=20e-6)
    np.testing.assert_allclose(recording.depth, number * 1e-6, atol=1e-3 * 100e-6)
    drifts = [
        float(note.message.split("drift is ")[1].split()[0]) for note in recording.notes if note.kind == "alignment"
    ]
    np.testing.assert_allclose(drifts, [-50.0, 200.0], atol=2.0)


def test_wrapped_late_and_duplicated_packets_are_sorted(path):
    log = LogWriter(path, {})
    order = [0, 1, 2, 5, 3, 4, 6, 6, *range(7, 300)]
    for number in order:
        at = number * 1_000_000
        log.wrench(2**32 - 3 + number, at + 5000, at, at, (0, 0, float(number), 0, 0, 0))
        log.state(number, at + 5000, at, at, 1e-6 * number, 1e-3)
    log.close({})
    recording = nf.read(path, baseline=False)
    assert recording.force.tolist() == list(range(300))
    np.testing.assert_allclose(np.diff(recording.time), 1e-3, atol=1e-9)
    assert kinds(recording)["duplicated"].count == 1 and "lost" not in kinds(recording)


def test_lost_packets_are_counted_with_the_longest_gap(path):
    plain_log.write(path, skip={10, 50, 51, 52, 200})
    note = kinds(nf.read(path, baseline=False))["lost"]
    assert note.count == 5 and "5 of 500 wrenches (1 %)" in note.message and "4 ms" in note.message


def test_a_restarted_sensor_continues(path):
    log = LogWriter(path, {})
    for number in range(600):
        at = plain_log.START + number * 1_000_000
        counter, device = (50_000 + number, number) if number < 300 else (number - 300, number - 300)
        log.wrench(counter, at, device * 1_000_000, at, (0, 0, float(number), 0, 0, 0))
        log.state(number, at, number * 1_000_000, at, 1e-6 * number, 1e-3)
    log.close({})
    recording = nf.read(path, baseline=False)
    assert recording.force.tolist() == list(range(600))
    np.testing.assert_allclose(recording.time, np.arange(600) * 1e-3, atol=1e-6)
    assert kinds(recording)["restart"].count == 1


def test_the_marked_bias_is_removed_from_all_axes(path):
    log = plain_log.write(path, close=False)
    log.mark(plain_log.START, "bias", wrench=[1.0, 2.0, 0.25, 0.5, 0.0, 0.0], noise=[0.0] * 6, samples=500)
    log.close({})
    recording = nf.read(path)
    assert recording.force.tolist() == [1e-3 * n - 0.25 for n in range(497)]
    assert recording.axes["tx"].tolist() == [0.3 - 0.5] * 497
    assert "0.25" in kinds(recording)["baseline"].message
    assert nf.read(path, baseline=False).force[0] == 0.0


def test_an_invalid_bias_is_not_removed(path):
    log = plain_log.write(path, close=False)
    for wrong in ([1.0], None, ["a"] * 6, [float("nan")] * 6):
        log.mark(plain_log.START, "bias", wrench=wrong)
    log.close({})
    assert nf.read(path).force[0] == 0.0


def test_wrenches_with_a_fault_are_left_out(path):
    log = plain_log.write(path, close=False, first=2**32 - 20)
    for sequence in (2**32 - 10, 100):  # the 10th and the 120th
        log.mark(plain_log.START, "status", status=1 << 17, words="saturated", sequence=sequence)
    log.close({})
    recording = nf.read(path, baseline=False)
    assert recording.force.tolist() == [1e-3 * n for n in range(497) if n not in (10, 120)]
    assert kinds(recording)["status"].count == 2 and "saturated" in kinds(recording)["status"].message
    assert "lost" not in kinds(recording)  # they arrived


@pytest.mark.parametrize(
    "options, expected",
    [
        ({"units": {"force": "-N"}}, lambda n: -1e-3 * n),
        ({"columns": {"force": "-fz"}}, lambda n: -1e-3 * n),
        ({"columns": {"force": "fx"}}, lambda n: 0.1 + n),
        ({"columns": {"force": "/needle/wrench:fy"}}, lambda n: 0.2 + n),
        ({"units": {"force": "mN"}}, lambda n: 1e-3 * n / 1000.0),
    ],
)
def test_axis_sign_and_unit_of_the_force_can_be_given(path, options, expected):
    plain_log.write(path)
    recording = nf.read(path, baseline=False, **options)
    assert recording.force.tolist() == [expected(n) for n in range(497)]


@pytest.mark.parametrize(
    "options, message",
    [
        ({"columns": {"force": "tx"}}, "known are fx, fy, fz"),
        ({"columns": {"force": "/nowhere"}}, "/needle/wrench"),
        ({"columns": {"time": "t"}}, "only force and depth"),
        ({"inwards": "up"}, "inwards"),
        ({"filter_length": 0}, "filter_length"),
        ({"units": {"depth": "N"}}, "unit of depth"),
    ],
)
def test_invalid_options_are_refused(path, options, message):
    plain_log.write(path)
    with pytest.raises(nf.InputError, match=message):
        nf.read(path, **options)


def test_without_an_axis_the_motion_is_read_from_another_file(path, tmp_path):
    log = LogWriter(path, {})
    for number in range(500):
        at = number * 1_000_000
        log.wrench(number, at, at, at, (0, 0, number, 0, 0, 0))
    log.close({})
    with pytest.raises(nf.InputError, match="--motion FILE"):
        nf.read(path)
    motion = tmp_path / "motion.csv"
    motion.write_text("time_s,depth_mm\n" + "".join(f"{n * 0.01},{n * 0.01}\n" for n in range(51)))
    recording = nf.read(path, motion=motion, baseline=False)
    np.testing.assert_allclose(recording.depth, recording.time * 1e-3, atol=1e-12)
    assert len(recording) == 500


def recording_of(start=0.0):
    time, depth, force = insertion()[:3]
    chance = np.random.default_rng(5)
    axes = {"fx": chance.normal(size=len(time)), "tz": chance.normal(size=len(time))}
    card = Card("origin.csv", "ab" * 32, "needle é", "gel", "rig", 50, ("one thing", "another"))
    notes = (Note("baseline", "a bias is removed", 1), Note("gap", "2 gaps", 2))
    return Recording(time + start, depth, np.gradient(depth, time), force, axes, card, notes)


@pytest.mark.parametrize("start", [0.0, -3.25, 1234.5])
def test_a_recording_written_as_a_log_is_read_unchanged(path, start):
    given = recording_of(start)
    assert write_log(given, path) == path
    again = nf.read(path, baseline=False)
    np.testing.assert_allclose(again.time, given.time, rtol=0.0, atol=1e-9)
    for quantity in ("depth", "velocity", "force"):
        assert getattr(again, quantity).tolist() == getattr(given, quantity).tolist()
    assert {axis: values.tolist() for axis, values in again.axes.items()} == {
        axis: values.tolist() for axis, values in given.axes.items()
    }
    assert (again.card.needle, again.card.tissue, again.card.filter_length) == ("needle é", "gel", 50)
    assert again.card.assumptions[:2] == ("one thing", "another") and set(given.notes) <= set(again.notes)


def test_the_same_recording_gives_the_same_bytes(tmp_path):
    paths = [write_log(recording_of(), tmp_path / name) for name in ("a.mcap", "b.mcap")]
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_a_log_is_written_atomically(path):
    path.write_text("mine")
    bad = recording_of()
    bad.force[3] = np.nan
    with pytest.raises(nf.InputError, match="not finite"):
        write_log(bad, path)
    assert path.read_text() == "mine" and [each.name for each in path.parent.iterdir()] == ["run.mcap"]


def test_large_packages_are_imported_only_when_needed():
    import subprocess
    import sys

    code = "import sys, needleforce.recording.log as log; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not {"mcap", "rosbags", "zstandard", "lz4"} & set(done.stdout.split())
