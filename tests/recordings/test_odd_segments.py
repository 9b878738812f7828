# SPDX-License-Identifier: Apache-2.0
"""Segments that run back in time, rest first, have clocks of their own, or are chosen: the public case, and further
files of its kind, by value."""

from itertools import pairwise

import numpy as np
import pytest
from odd_insertion import DEPTH, FORCE, HEAD, ROWS, TIME, case, check, force_of, rows, written

import needleforce as nf
from needleforce.identification import fit_indentation

# --- segments: back in time, at rest first, or chosen by a column


TURN = 450  # the row at which the needle turns


def segments(order, *, clock="whole", table=ROWS, labels=("extend", "pause", "retract")):
    """A text with a comment above each segment; ``order`` has (first, stop, -1 for rows from the last on)."""
    out = []
    for k, (first, stop, way) in enumerate(order):
        part = table[first:stop].copy()
        part[:, 0] -= 0.0 if clock == "whole" else part[0, 0]
        out.append(f"\n#\n# segmentIndex: {k}\n# segment: {labels[k]}\n# columns: time depth force\n# units: s mm N\n")
        out.append(rows(part[::way], sep=" "))
    return "".join(out)


@pytest.mark.parametrize("clock", ["whole", "each"])
@pytest.mark.parametrize(
    "order",
    [
        [(0, TURN, 1), (TURN, 800, -1)],
        [(0, TURN, -1), (TURN, 800, -1)],
        [(0, TURN, -1), (TURN, 800, 1)],
        [(0, 350, 1), (350, TURN, 1), (TURN, 800, -1)],
        [(0, 350, 1), (350, TURN, -1), (TURN, 800, -1)],
        [(0, 40, 1), (40, TURN, 1), (TURN, 800, -1)],
    ],
)
def test_segments_that_run_back_in_time_are_turned(tmp_path, order, clock):
    run = nf.read(written(tmp_path, segments(order, clock=clock), "curve.txt"), baseline=False)
    check(run)
    turned = sum(way < 0 for _, _, way in order)
    assert any("runs back" in each.message and each.count == turned for each in run.notes)


@pytest.mark.parametrize("columns", ["time_s,depth_mm,force_N", "Time [s],Height [mm],Signal [N]"])
def test_a_whole_file_that_runs_back_is_turned(tmp_path, columns):
    check(nf.read(written(tmp_path, columns + "\n" + rows(ROWS[::-1])), baseline=False))


@pytest.mark.parametrize("rest", [5, 12, 25, 40, 49])
def test_a_first_phase_at_rest_is_no_recording(tmp_path, rest):
    """Each phase has a clock of its own, from zero."""
    table = ROWS.copy()
    table[rest:, 0] -= table[rest, 0]
    run = nf.read(written(tmp_path, HEAD + rows(table)), baseline=False)
    check(run)
    assert any(each.kind == "phases" for each in run.notes)


def test_repeats_one_below_the_other_are_still_apart(tmp_path):
    again = np.column_stack([TIME, DEPTH, force_of(TIME) + 0.003 * np.random.default_rng(5).normal(size=len(TIME))])
    assert len(nf.read_all(written(tmp_path, HEAD + rows() + rows(again)))) == 2


SEGMENT = np.where(DEPTH <= 0.0, 0, np.where(TIME < 3.5, 1, np.where(TIME < 4.5, 2, 3)))
STEPS = np.array(["rest", "approach", "hold", "withdraw"])[SEGMENT]


@pytest.mark.parametrize(
    "header, labels, wanted, value",
    [
        ("segment", SEGMENT, {"segment": "1"}, 1),
        ("segment", SEGMENT, {"segment": 1}, 1),
        ("Segment", [f"{each:.3e}" for each in SEGMENT], {"Segment": "3"}, 3),
        ("Step", STEPS, {"Step": "approach"}, 1),
        ("phase", STEPS, {"phase": "withdraw"}, 3),
        ("state", STEPS, {"state": "hold"}, 2),
    ],
)
def test_a_segment_is_chosen_by_a_column(tmp_path, header, labels, wanted, value):
    lines = [f"{label},{line}" for label, line in zip(labels, rows().splitlines(), strict=True)]
    path = written(tmp_path, f"{header},{HEAD}" + "\n".join(lines) + "\n")
    kept = value == SEGMENT
    if value == 2:  # the needle rests
        with pytest.raises(nf.InputError, match="the needle must move"):
            nf.read(path, segment=wanted)
        return
    run = nf.read(path, segment=wanted, baseline=False, inwards="increasing", units={"force": "+N"})
    check(run, TIME[kept], force=FORCE[kept])


@pytest.mark.parametrize("header, names", [("segment", "01234"), ("phase", ["rest", "in", "hold", "out", "end"])])
@pytest.mark.parametrize("back", [(), (3,), (1, 3)])
@pytest.mark.parametrize("repeats", [1, 2])
def test_segments_with_clocks_of_their_own_are_one_recording(tmp_path, header, names, back, repeats):
    """Those in ``back`` are saved from their last row on."""
    ends = [0, *(np.flatnonzero(np.diff(SEGMENT)) + 1).tolist(), len(TIME)]
    lines = []
    for k, (first, stop) in enumerate(pairwise(ends)):
        part = ROWS[first:stop] - [TIME[first], 0.0, 0.0]
        part = part[:: -1 if k in back else 1]
        lines += [f"{names[k]},{line}" for line in rows(part).splitlines()]
    path = written(tmp_path, f"{header},{HEAD}" + "\n".join(lines * repeats) + "\n")
    runs = nf.read_all(path, baseline=False)
    assert len(runs) == repeats and sum(map(len, runs)) == repeats * len(TIME)
    assert np.concatenate([run.force for run in runs]) == pytest.approx(np.tile(FORCE, repeats), abs=2e-5)
    if repeats == 1:
        check(runs[0])


@pytest.mark.parametrize("wanted", [{"segment": "retract"}, {"segmentIndex": "1"}])
def test_a_segment_is_chosen_by_the_comment_above_it(tmp_path, wanted):
    text = segments([(0, TURN, 1), (TURN, 800, -1)], labels=("extend", "retract"))
    run = nf.read(written(tmp_path, text), segment=wanted, baseline=False, inwards="increasing", units={"force": "+N"})
    check(run, TIME[TURN:], force=FORCE[TURN:])


@pytest.mark.parametrize(
    "wanted, message",
    [({"segment": "no"}, "never no, it contains extend, retract"), ({"part": "1"}, "the columns are")],
)
def test_a_segment_that_is_absent_is_refused(tmp_path, wanted, message):
    text = segments([(0, TURN, 1), (TURN, 800, -1)], labels=("extend", "retract"))
    with pytest.raises(nf.InputError, match=message):
        nf.read(written(tmp_path, text), segment=wanted)


def test_public_case_17(recordings):
    path = case(recordings, "17-two-segments-reversed") / "two_segments.out"
    for options in ({}, {"segment": {"segment": "extend"}}):
        run = nf.read(path, test="indentation", baseline=False, **options)
        last = int(run.depth.argmax()) + 1
        fit = fit_indentation(run.depth[:last], run.force[:last], nf.tips.Paraboloid(5e-6))
        assert fit.reduced_modulus.value == pytest.approx(1000.0, rel=0.01)
        assert 1e6 * (fit.contact_depth.value - run.depth[0]) == pytest.approx(1.5, abs=0.02)
