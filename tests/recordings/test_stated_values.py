# SPDX-License-Identifier: Apache-2.0
"""Rates, speeds and units that a file states above its table or next to its arrays; expected values by hand."""

import json

import h5py
import numpy as np
import pytest
from scipy.io import savemat

import needleforce as nf
from needleforce.recording.stated import stated_by
from needleforce.recording.table import Table

TIME = np.arange(0.0, 10.0, 0.01)
DEPTH_MM = 2.0 * TIME
FORCE_N = 0.05 * np.clip(DEPTH_MM - 5.0, 0.0, None)


def stated(*lines, decimal="."):
    return stated_by(Table(path=None, headers=[], preamble=(lines,), decimal=decimal))


@pytest.mark.parametrize(
    ("line", "rate_hz"),
    [
        ("Sampling rate: 1000 Hz", 1000.0),
        ("# fs = 500", 500.0),
        ("Fs,2000", 2000.0),
        ("sample_rate_hz: 250", 250.0),
        ("SampleRate\t1 kHz", 1000.0),
        ('"Sample interval (ms)","1"', 1000.0),
        ("Sample interval (ms), 2", 500.0),
        ("dt: 0.004", 250.0),
        ("wf_increment: 0.01", 100.0),
        ("Abtastrate: 200 Hz", 200.0),
        ("Abtastintervall [ms]; 5", 200.0),
        ("Fréquence d'échantillonnage : 100 Hz", 100.0),
        ("Sampling rate: 1,000 Hz", 1000.0),
        ("meta.sample_rate: 1e3", 1000.0),
        ("Sampling rate 1000 samples/s", 1000.0),
        ("Sampling time: 6 ms", 1000.0 / 6.0),
    ],
)
def test_a_rate(line, rate_hz):
    assert stated(line).rate.value == pytest.approx(rate_hz, rel=1e-12)


@pytest.mark.parametrize(
    "line",
    ["Frequency: 1 Hz", "Rate: 1 mm/min", "Heart rate: 70", "dt: 0.1", "Samples: 1000", "Sample 12", "rate", "fs: -3",
     "assumption: the samples are 100 Hz apart", "Force sampling rate: 100 Hz", "Date: 2024-01-01 10:00",
     "Sampling rate (max) 1000 Hz", "Update rate: 60 Hz",
     "Sampling time: 6 s"],
)  # fmt: skip
def test_no_rate(line):
    assert stated(line).rate is None


def test_a_level_that_contradicts_itself_states_no_rate():
    assert stated("Sampling rate: 1000 Hz", "Scan rate: 50 Hz").rate is None


def test_a_decimal_comma():
    assert stated("Abtastintervall: 0,5 ms", decimal=",").rate.value == pytest.approx(2000.0)


@pytest.mark.parametrize(
    ("line", "speed"),
    [
        ("Test speed: 1 mm/s", 1e-3),
        ("Crosshead speed 60 mm/min", 1e-3),
        ("Prüfgeschwindigkeit;0,5;mm/s", 0.5e-3),
        ('"Rate 1"', None),
        ("Vitesse d'essai : 120 mm/min", 2e-3),
        ("Post-test speed: 10 mm/s", None),
        ("Speed: 5", None),
        ("test_speed_mm_s: 4", 4e-3),
    ],
)
def test_a_speed(line, speed):
    found = stated(line).speed
    assert found is None if speed is None else found.value == pytest.approx(speed, rel=1e-12)


@pytest.mark.parametrize(
    ("line", "units"),
    [
        ("Units:,lbF", {"force": "lbf"}),
        ("Force unit: mN", {"force": "mN"}),
        ("Einheit Kraft: N", {"force": "N"}),
        ("Krafteinheit = cN", {"force": "cN"}),
        ("Units: N, mm, s", {"force": "N", "depth": "mm", "time": "s"}),
        ("Units: Metric", {}),
        ("Serial: N", {}),
    ],
)
def test_units(line, units):
    assert {q: symbol for q, (symbol, _) in stated(line).units.items()} == units


def rows(*columns):
    return "".join(",".join(f"{value:.10g}" for value in row) + "\n" for row in zip(*columns, strict=True))


def check(run):
    np.testing.assert_allclose(run.time - run.time[0], TIME, atol=1e-9)
    np.testing.assert_allclose(run.depth, 1e-3 * DEPTH_MM, atol=1e-9)
    np.testing.assert_allclose(run.force, FORCE_N, atol=1e-6)


def test_a_rate_in_the_preamble_is_an_assumption(file):
    run = nf.read(file("My rig\nSampling rate: 100 Hz\n\nForce [N],Depth [mm]\n" + rows(FORCE_N, DEPTH_MM)))
    check(run)
    assert "the time is that of 100 Hz, as the file states: 'Sampling rate: 100 Hz'" in run.card.assumptions


def test_a_rate_that_contradicts_the_time_is_noted(file):
    head = "Sampling rate: 1000 Hz\nTime [s],Force [N],Depth [mm]\n"
    run = nf.read(file(head + rows(TIME, FORCE_N, DEPTH_MM)))
    check(run)
    assert [n.kind for n in run.notes if "1000 Hz" in n.message and "100 samples a second" in n.message] == [
        "contradiction"
    ]


def test_a_rate_that_is_given_for_a_file_with_time_is_noted(file):
    run = nf.read(file("Time [s],Force [N],Depth [mm]\n" + rows(TIME, FORCE_N, DEPTH_MM)), rate=50.0)
    check(run)
    assert any("the rate that was given is not used" in note.message for note in run.notes)


def test_a_speed_is_proposed_and_the_option_works(file):
    path = file("Test speed: 2 mm/s\nTime [s],Force [N]\n" + rows(TIME, FORCE_N))
    with pytest.raises(nf.InputError, match=r"give --speed-mm-s 2 if the needle moved at 'Test speed: 2 mm/s'"):
        nf.read(path)
    check(nf.read(path, speed=2e-3))


def test_a_unit_in_the_preamble(file):
    path = file("Units:,lbF\nTime [s],Load,Depth [mm]\n" + rows(TIME, FORCE_N / 4.4482216152605, DEPTH_MM))
    run = nf.read(path)
    check(run)
    assert "force is in lbf, as the file states: 'Units:,lbF'" in run.card.assumptions


@pytest.mark.parametrize("kind", ["mat", "mat_struct", "npz", "json", "h5", "h5_group", "h5_dataset"])
def test_a_rate_next_to_arrays(kind, tmp_path):
    path = tmp_path / "run.any"
    arrays = {"force": FORCE_N, "depth": DEPTH_MM}
    if kind.startswith("mat"):
        with open(path, "wb") as target:
            savemat(target, arrays | ({"fs": 100.0} if kind == "mat" else {"settings": {"Fs": 100.0, "who": "me"}}))
    elif kind == "npz":
        with open(path, "wb") as target:
            np.savez(target, **arrays, fs=np.float64(100.0))
    elif kind == "json":
        lists = {name: values.tolist() for name, values in arrays.items()}
        path.write_text(json.dumps({"meta": {"sample_rate": 100, "who": "me"}, **lists}))
    else:
        with h5py.File(path, "w") as target:
            for name, values in arrays.items():
                target[name] = values
            if kind == "h5":
                target.attrs["sample_rate_hz"] = 100
            elif kind == "h5_group":
                target.create_group("settings").attrs["fs"] = 100.0
            else:
                target["force"].attrs["dt"] = 0.01
    check(nf.read(path))


@pytest.mark.parametrize(
    "line",
    ["Sampling rate of video: 30 Hz", "Camera acquisition rate: 30 Hz", "Temperature sampling rate: 10 Hz",
     "Max sampling rate: 10000 Hz", "Anti-aliasing sampling filter: 100 Hz", "Sample preparation time: 30 s",
     "Sampling duration: 6 s", "Acquisition delay: 0.5 s", "Rate: 10", "Time interval: 2019", "Data rate: 9600",
     "Sampling rate: 1000 Hz (recorded every 4th)", "Homing speed: 20 mm/s", "Max. speed 50 mm/s",
     "Display unit force: gf", "Preload force unit: gf", "Torque unit: N m"],
)  # fmt: skip
def test_what_is_stated_of_something_else_is_not_used(line):
    found = stated(line)
    assert found.rate is None and found.speed is None and found.units == {}


def test_counts_per_unit_above_the_table(file):
    """As a network box of a force sensor logs: counts, and how many are one newton."""
    above = '"RDT Sample Rate: 100"\n"Force Units: N","Counts per Unit Force: 1000000.0"\n'
    above += '"Torque Units: Nm","Counts per Unit Torque: 1000000.0"\n'
    table = '"Fx","Fy","Fz","Position (mm)"\n'
    table += "".join(f'"0","0","{round(1e6 * f)}","{z:.6f}"\n' for z, f in zip(DEPTH_MM, FORCE_N, strict=True))
    run = nf.read(file(above + table))
    np.testing.assert_allclose(run.force, FORCE_N, atol=1e-6)
    assert any(
        "1e-06N, as the file states" in each and "Counts per Unit Force" in each for each in run.card.assumptions
    )


def test_a_given_value_that_contradicts_the_file_is_noted(file):
    path = file("Sampling rate: 200 Hz\nTest speed: 1 mm/s\nForce (N)\n" + rows(FORCE_N))
    found = nf.read(path, rate=100.0, speed=2e-3).notes
    messages = [note.message for note in found if note.kind == "contradiction"]
    assert len(messages) == 2 and "the rate that was given is used" in messages[0] and "1 mm/s" in messages[1]
    assert not [note for note in nf.read(path, rate=200.0, speed=1e-3).notes if note.kind == "contradiction"]
