# SPDX-License-Identifier: Apache-2.0
"""Recordings in parts, which a recorder begins one after the other, and recordings that are reduced while read."""

import errno
import os
import shutil

import numpy as np
import plain_log
import pytest
from mcap.reader import make_reader

import needleforce as nf
from needleforce.campaign.folder_files import find_files
from needleforce.recording.log import LogWriter, read_log, to_recording, topics, writer
from needleforce.recording.log.mcap_records import RecordReader
from needleforce.recording.recording import COLUMNS

COUNT, PART = 900, 256
PARTS = ["run.mcap", "run.part0002.mcap", "run.part0003.mcap", "run.part0004.mcap"]
BIAS = [0.0, 0.0, 0.25, 0.0, 0.0, 0.0]


def write(path, count=COUNT, close=True, **parts):
    """Wrenches at 1 kHz with a bias before, and a state of the axis with every fourth."""
    log = LogWriter(path, plain_log.CARD, **parts)
    log.mark(plain_log.START, "bias", wrench=BIAS, noise=[0.0] * 6, samples=9)
    for number in range(count):
        stamp, device = plain_log.START + number * 1_000_000, number * 1_000_000
        log.wrench(number, stamp + 200_000, device, stamp, (0.0, 0.0, 0.25 + 1e-3 * number, 0.0, 0.0, 0.0))
        if number % 4 == 0 or number == count - 1:
            log.state(number, stamp + 200_000, device, stamp, 1e-6 * number, 1e-3)
        if number % 100 == 99:
            log.flush()
    if close:
        log.close({"why": "done"})
    return log


@pytest.fixture
def parts(tmp_path):
    write(tmp_path / "run.mcap", part_samples=PART)
    return tmp_path


def test_parts_are_joined_as_one_file(parts, tmp_path):
    write(tmp_path / "one.mcap")
    for limits in ({"part_samples": PART}, {"part_time": 0.25}):
        folder = tmp_path / str(limits)
        folder.mkdir()
        write(folder / "run.mcap", **limits)
        assert sorted(os.listdir(folder)) == PARTS
        joined, one = nf.read(folder / "run.mcap"), nf.read(tmp_path / "one.mcap")
        for name in COLUMNS:
            assert np.array_equal(getattr(joined, name), getattr(one, name)), name
        assert [note.message for note in joined.notes] == [note.message for note in one.notes]
    assert nf.read(parts / "run.mcap").card.needle == "trocar"


def test_each_part_is_complete_by_itself(parts):
    """With checksums, card and bias, and on the clock of the run; another reader sees all of them."""
    seen = 0
    for number, name in enumerate(PARTS):
        with open(parts / name, "rb") as file:
            reader = make_reader(file, validate_crcs=True)
            seen += len(list(reader.iter_messages(topics=["/needle/wrench"])))
            ends = {each.name: each.metadata for each in reader.iter_metadata()}["needleforce.end"]
        assert ends == ({"continued": PARTS[number + 1]} if number < 3 else {"why": "done"})
        alone = nf.read(parts / name, part="part0001" if number == 0 else None)
        first = round(alone.time[0] / 1e-3)
        assert first - number * PART in range(4) and np.allclose(
            alone.force, 1e-3 * first + 1e-3 * np.arange(len(alone))
        )
        assert not any(note.kind == "incomplete" for note in alone.notes)
        same = nf.read(parts / "run.mcap", part=f"part{number + 1:04}")
        assert np.array_equal(same.force, alone.force)
    assert seen == COUNT


def test_a_campaign_takes_the_parts_as_one_recording(parts):
    (parts / "alone.part0002.mcap").write_bytes((parts / PARTS[1]).read_bytes())
    assert [each.name for each in find_files(parts)[0]] == ["alone.part0002.mcap", "run.mcap"]


def rename(folder, *pairs):
    for source, target in pairs:
        os.replace(folder / source, folder / target)


def foreign(folder):
    (folder / "other").mkdir()
    write(folder / "other" / "run.mcap", part_samples=PART)
    shutil.copy(folder / "other" / PARTS[2], folder / PARTS[2])


def plain(folder):
    nf.write(nf.read(folder / PARTS[0], part="part0001"), folder / PARTS[1])


FAULTS = {
    "missing": (lambda folder: (folder / PARTS[2]).unlink(), "part 3 is missing, .*one after the other"),
    "the last missing": (lambda folder: (folder / PARTS[3]).unlink(), "part 4 is missing"),
    "doubled": (lambda folder: shutil.copy(folder / PARTS[1], folder / PARTS[2]), "part 3 is 2, .*one after the other"),
    "exchanged": (
        lambda folder: rename(folder, (PARTS[1], "a.mcap"), (PARTS[2], PARTS[1]), ("a.mcap", PARTS[2])),
        "part 2 is 3, .*one after the other",
    ),
    "of another recording": (foreign, "part 3 is of another run"),
    "no part": (plain, "part 2 is of another run"),
    "no log": (lambda folder: (folder / PARTS[1]).write_text("time,force\n1,2\n"), "not an MCAP file"),
    "asked for": (lambda folder: None, "part0005.*it has part0001 to part0004"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_set_with_a_fault_is_refused_by_name(fault, parts):
    change, message = FAULTS[fault]
    change(parts)
    with pytest.raises(nf.InputError, match=f"(?s).*{message}"):
        nf.read(parts / "run.mcap", part="part0005" if fault == "asked for" else None)
    assert len(nf.read(parts / "run.mcap", part="part0001")) > 200


def test_a_kill_at_any_byte_of_a_rotation_loses_nothing_that_was_flushed(tmp_path, monkeypatch, many):
    """The bytes reach the system in this order: all folders that a kill can leave are read."""
    written, plain_write = [], writer._Appended.write

    def noted(self, data):
        written.append((self.path.name, bytes(data)))
        plain_write(self, data)

    monkeypatch.setattr(writer._Appended, "write", noted)
    write(tmp_path / "run.mcap", count=300, part_samples=PART)
    place, whole = tmp_path / "cut", {}
    place.mkdir()
    first = next(k for k, (name, _) in enumerate(written) if name == PARTS[1])
    last = [k for k, (name, _) in enumerate(written) if name == PARTS[0]][-1] + 3
    for name, data in written[:first]:
        whole[name] = whole.get(name, b"") + data
    step = 1 if many(1, 2) == 2 else 61
    for name, data in written[first:last]:
        for cut in range(0, len(data), step):
            for each, content in (whole | {name: whole.get(name, b"") + data[:cut]}).items():
                (place / each).write_bytes(content)
            found = nf.read(place / "run.mcap")
            assert len(found) >= 253 and np.allclose(np.diff(found.force), 1e-3), (name, cut)
        whole[name] = whole.get(name, b"") + data


def test_readers_of_a_recording_that_grows(tmp_path):
    log, seen = write(tmp_path / "run.mcap", count=200, close=False, part_samples=PART), []
    for begin in range(200, 800, 50):
        for number in range(begin, begin + 50):
            stamp = plain_log.START + number * 1_000_000
            log.wrench(number, stamp, number * 1_000_000, stamp, (0.0,) * 6)
            log.state(number, stamp, number * 1_000_000, stamp, 1e-6 * number, 1e-3)
        log.flush()
        readers = [read_log(tmp_path / "run.mcap") for _ in range(2)]
        assert len(readers[0].wrench) == len(readers[1].wrench) == begin + 50
        seen.append(len(readers[0].files))
    log.close({})
    assert seen == sorted(seen) and seen[-1] == 4


def test_no_reading_is_missing_where_the_recorder_begins_a_part_while_one_is_read(tmp_path, monkeypatch):
    log, walked, more = write(tmp_path / "run.mcap", count=200, close=False, part_samples=PART), [], range(200, 300)

    def then_written(self, *given):
        yield from walk(self, *given)
        for number in more if not walked else ():
            stamp = plain_log.START + number * 1_000_000
            log.wrench(number, stamp, number * 1_000_000, stamp, (0.0,) * 6)
        walked.append(self.path.name)
        log.flush()

    walk = RecordReader._walk
    monkeypatch.setattr(RecordReader, "_walk", then_written)
    for count in (200, 300):
        found = read_log(tmp_path / "run.mcap").wrench
        assert len(found) == count and (np.diff(found.sequence) == 1).all()
    log.close({})
    assert walked == [PARTS[0], PARTS[0], PARTS[1]]


def test_a_disk_that_is_full_at_the_next_part_leaves_a_complete_file(tmp_path, monkeypatch):
    plain_write = writer._Appended.write

    def full(self, data):
        if "part" in self.path.name:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        plain_write(self, data)

    monkeypatch.setattr(writer._Appended, "write", full)
    log = LogWriter(tmp_path / "run.mcap", {}, part_samples=100)
    with pytest.raises(nf.InputError, match="No space left"):
        for number in range(200):
            log.wrench(number, number, number, number, (0.0,) * 6)
    log.close({"why": "disk full"})
    found = read_log(tmp_path / "run.mcap")
    assert found.complete and len(found.wrench) == 100 and os.listdir(tmp_path) == ["run.mcap"]


def sampled(time, force, depth=None):
    return nf.Recording(time=time, depth=1e-3 * time if depth is None else depth, force=force)


def reduced(recording, tmp_path, rate):
    return nf.read(nf.write(recording, tmp_path / "in.parquet"), decimate_to=rate, baseline=False)


@pytest.mark.parametrize("frequency", [2.0, 10.0, 30.0, 70.0, 95.0, 143.0, 260.0])
def test_the_filter_has_the_response_that_is_stated(frequency, tmp_path):
    """Of a tone, against sinc² of its frequency over the new rate, and no shift of it."""
    time = np.arange(70_000) / 7000.0
    found = reduced(sampled(time, np.sin(2 * np.pi * frequency * time)), tmp_path, 100.0)
    inner = slice(3, -3)
    expected = np.sinc(frequency / 100.0) ** 2 * np.sin(2 * np.pi * frequency * found.time[inner])
    assert np.abs(found.force[inner] - expected).max() < 3e-4
    assert np.allclose(np.diff(found.time[inner]), 0.01) and np.allclose(found.depth, 1e-3 * found.time)


def test_noise_falls_as_stated_and_a_fall_has_no_overshoot(tmp_path):
    chance, time = np.random.default_rng(5), np.arange(700_000) / 7000.0
    noise = reduced(sampled(time, chance.normal(0.0, 1.0, len(time))), tmp_path, 100.0).force[3:-3]
    assert noise.std() == pytest.approx(np.sqrt(2.0 / (3.0 * 70.0)), rel=0.03)
    assert np.mean(noise[1:] * noise[:-1]) / noise.var() == pytest.approx(0.25, abs=0.03)
    fall = reduced(sampled(time, np.where(time < 50.0, 1.0, 0.2)), tmp_path, 100.0).force
    assert fall.max() == pytest.approx(1.0) and fall.min() == pytest.approx(0.2) and (np.diff(fall) < 1e-12).all()


def test_losses_shift_nothing(tmp_path):
    """A line stays on the line where a tenth of the samples is missing, and a gap stays a gap."""
    chance, time = np.random.default_rng(6), np.arange(70_000) / 7000.0
    kept = (chance.random(len(time)) > 0.1) & ~((time > 4.0) & (time < 5.0))
    found = reduced(sampled(time[kept], 3.0 * time[kept]), tmp_path, 100.0)
    assert np.allclose(found.force, 3.0 * found.time) and (np.diff(found.time) > 0.0).all()
    assert np.diff(found.time).max() == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize("rate", [0.0, -5.0, float("nan"), 600.0, 5000.0])
def test_a_rate_that_is_not_lower_is_refused(rate, parts):
    with pytest.raises(nf.InputError, match="rate to decimate to"):
        nf.read(parts / "run.mcap", decimate_to=rate)


def test_a_long_recording_is_reduced_in_blocks(parts, monkeypatch):
    """Which hold less than a part, and whose number changes nothing; as a whole it is refused, with a way on."""
    monkeypatch.setattr(topics, "MAX_SAMPLES", 700)
    with pytest.raises(nf.InputError, match=r"over 700.*--decimate-to-hz 100, or read it by its parts"):
        nf.read(parts / "run.mcap")
    found = []
    monkeypatch.setattr(topics, "_OVERLAP_NS", 20_000_000)
    for block in (100, 150, 1 << 18):
        monkeypatch.setattr(topics, "MAX_SAMPLES", max(700, 4 * block))
        monkeypatch.setattr(to_recording, "_BLOCK", block)
        found.append(nf.read(parts / "run.mcap", decimate_to=50.0))
    for each in found:
        assert np.allclose(each.time, found[-1].time) and np.allclose(each.force, 1e3 * 1e-3 * each.time, atol=1e-9)
        assert np.allclose(each.depth, 1e-3 * each.time, atol=1e-9)
        assert each.card.assumptions[-1].startswith("900 samples are reduced to 50 a second")
    assert found[0].card.sha256 == found[-1].card.sha256 and found[0].card.filter_length == 1 + round(49 / 20)
