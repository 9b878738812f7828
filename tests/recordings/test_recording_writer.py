# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from needleforce.errors import InputError
from needleforce.recording import Card, Note, Recording, read, write

ANY = st.floats(-1e9, 1e9)
TEXT = st.text(st.characters(exclude_categories=["Cs"]), max_size=30)
NAMES = ("time", "depth", "velocity", "force")


@st.composite
def recordings(draw):
    """Random finite values of an insertion: time and depth increase, force does not decrease."""
    size = draw(st.integers(2, 30))
    time = np.cumsum(draw(arrays(float, size, elements=st.floats(1e-6, 10.0))))
    depth = np.cumsum(draw(arrays(float, size, elements=st.floats(1e-9, 1e-2)))) - draw(st.floats(0.0, 1.0))
    if np.ptp(depth) == 0.0:
        depth[-1] += 1.0
    velocity, axis = (draw(arrays(float, size, elements=ANY)) for _ in range(2))
    force = draw(arrays(float, size, elements=ANY))
    card = Card("a source", "0" * 64, draw(TEXT), draw(TEXT), draw(TEXT), draw(st.integers(1, 99)),
                tuple(dict.fromkeys(t for t in draw(st.lists(TEXT, max_size=2)) if t)))  # fmt: skip
    return Recording(time, depth, velocity, force, {"fx": axis}, card, (Note("sign", "of life", 3),))


@given(recordings())
@settings(max_examples=100, deadline=None)
def test_written_and_read_is_the_same_bit_for_bit(tmp_path_factory, run):
    path = write(run, tmp_path_factory.mktemp("run") / "run.csv")
    back = read(path, baseline=False)
    for name in NAMES:
        assert getattr(back, name).tobytes() == getattr(run, name).tobytes()
    assert back.axes["fx"].tobytes() == run.axes["fx"].tobytes()
    for name in ("needle", "tissue", "rig", "filter_length", "assumptions"):
        assert getattr(back.card, name) == getattr(run.card, name)
    assert Note("sign", "of life", 3) in back.notes
    assert any(note.kind == "origin" and "a source" in note.message for note in back.notes)


@pytest.fixture
def run():
    time = np.arange(0.0, 10.0, 0.01)
    return Recording(time, 1e-3 * time, 1e-3 + 0 * time, time / 3.0, card=Card(needle="18 G"))


def test_the_file_is_plain(run, tmp_path):
    lines = write(run, tmp_path / "run.csv").read_bytes().split(b"\n")
    assert lines[0] == b"# signs: depth increases inwards, force is positive against insertion"
    assert lines[1:4] == [b"# needle: 18 G", b"time_s,depth_m,velocity_m_s,force_N", b"0.0,0.0,0.001,0.0"]
    assert lines[4] == b"0.01,1e-05,0.001,0.0033333333333333335"


def test_same_data_give_same_bytes(run, tmp_path):
    assert write(run, tmp_path / "a.csv").read_bytes() == write(run, tmp_path / "b.csv").read_bytes()


def test_a_second_reading_and_writing_adds_nothing(run, tmp_path):
    once = read(write(run, tmp_path / "a.csv"))
    twice = read(write(once, tmp_path / "b.csv"))
    assert twice.card.assumptions == once.card.assumptions
    assert {note.kind for note in twice.notes} == {note.kind for note in once.notes} | {"origin"}


def test_a_failed_write_leaves_the_old_file(run, tmp_path, monkeypatch):
    target = tmp_path / "run.csv"
    target.write_text("before")

    def fails(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", fails)
    with pytest.raises(InputError, match=r"run.csv: file is not written, No space left on device"):
        write(run, target)
    assert [path.name for path in tmp_path.iterdir()] == ["run.csv"] and target.read_text() == "before"


@pytest.mark.parametrize(
    "change, message",
    [
        ({"force": np.zeros(3)}, r"shape of force is \(3,\), time has \(1000,\)"),
        ({"force": np.full(1000, np.nan)}, "force is not finite, at sample 0"),
        ({"time": np.zeros(1000)}, "time is not increasing"),
        ({"axes": {"sparkle": np.zeros(1000)}}, "axis is 'sparkle', known are"),
    ],
)
def test_invalid_recordings_are_not_written(run, tmp_path, change, message):
    with pytest.raises(InputError, match=message):
        write(Recording(**(vars(run) | change)), tmp_path / "run.csv")
    assert not list(tmp_path.iterdir())


def test_a_missing_folder_is_refused(run, tmp_path):
    with pytest.raises(InputError, match="file is not written"):
        write(run, tmp_path / "none" / "run.csv")
