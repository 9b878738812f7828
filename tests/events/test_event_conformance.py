# SPDX-License-Identifier: Apache-2.0
"""The same streams in C++, C, Python and WebAssembly, in Node and in a browser, have the same events."""

import numpy as np
import pytest
from stream_faces import FACES, StreamFaces

NUMBERS = 7  # time, depth, size, probability, delay, noise, needed fall; then kind and status
# C, C++ and Python have the same mathematics library. That of WebAssembly differs in last bits, which may turn the sign
# of one innovation out of thousands, and with it the correlation: that is part of a probability, not of time or depth
CLOSE = 1e-5


def insertion(rate: float, change=None) -> list[str]:
    """Through two layers at 2 mm/s, a hold, out again, with noise of 5 mN; `change(rows)` is what a sensor does."""
    time = np.arange(int(16.0 * rate)) / rate
    depth = np.interp(time, [0.0, 6.0, 7.5, 16.0], [0.0, 12e-3, 12e-3, -2e-3])
    past = np.maximum(depth - 2e-3, 0.0)
    inwards = np.where(past < 4e-3, 300.0 * past, 0.5 + 150.0 * (past % 5e-3))
    force = np.where(time < 7.5, inwards, -0.4 * (depth > 2e-3)) + np.random.default_rng(1).normal(0.0, 5e-3, time.size)
    rows = np.column_stack([force, depth, np.full(time.size, 1.0 / rate)])
    if change:
        change(rows)
    return [f"{force!r} {depth!r} {dt!r}" for force, depth, dt in rows.tolist()]


def faults(rows):
    rows[100, 0], rows[250, 0], rows[260, 1] = np.nan, np.inf, -np.inf
    rows[150, 2], rows[151, 2], rows[152, 2] = 0.0, -1.0, np.nan
    rows[450, 2], rows[470, 2] = 0.4, 10.0


def zeroed(rows):
    rows[300:, 0] -= rows[300, 0]


def stuck(rows):
    rows[200:260, 0] = rows[200, 0]


def in_tissue(rows):
    rows[:, 0] += 2.0


def tension(rows):
    rows[:, 0] *= -1.0


def other_needle(rows):
    rows[350:, 1] += 0.1


def streams() -> dict:
    slow = insertion(100.0)
    kept = [*slow[:290], "keep", *slow[290:500], "restore", *slow[290:700], "reset", *slow[:400]]
    every = (faults, zeroed, stuck, in_tissue, tension, other_needle)
    changes = {each.__name__: insertion(100.0, each) for each in every}
    return {"slow": slow, "fast": insertion(1000.0), "kept": kept, **changes}


@pytest.fixture(scope="module")
def found(root, tmp_path_factory, request):
    """By face and stream: numbers (n, 7), words, and what was taken back."""
    faces = StreamFaces(root, tmp_path_factory.mktemp("streams"), "watch", request)
    return faces.of(streams(), NUMBERS)


@pytest.mark.parametrize("face", FACES[1:])
def test_every_face_finds_the_same_events(found, face):
    for stream, (numbers, *words) in found("c++").items():
        others, *other_words = found(face)[stream]
        assert words == other_words, f"{face}, {stream}: kinds or status differ"
        same = [0, 1, 2, 4] if face in ("wasm", "browser") else range(NUMBERS)
        assert np.array_equal(others[:, same], numbers[:, same]), f"{face}, {stream}"
        assert np.allclose(others, numbers, rtol=CLOSE, atol=0.0), f"{face}, {stream}"


def test_the_streams_have_every_kind_and_status(found):
    rows = [row for _, words, _ in found("c++").values() for row in words]
    assert {kind for kind, _ in rows} == {"none", "contact", "puncture", "sliding", "stop", "reversal", "exit"}
    every = {"ok", "learning", "not_finite", "bad_time", "gap", "stuck", "unknown_zero", "wrong_sign"}
    assert {status for _, status in rows} == every
    assert found("c++")["kept"][2] == [["taken"]]


def test_events_after_a_restored_state_are_those_before_it(found):
    numbers, words, _ = found("c++")["kept"]
    assert np.array_equal(numbers[290:500], numbers[500:710])
    assert words[290:500] == words[500:710]
