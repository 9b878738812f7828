# SPDX-License-Identifier: Apache-2.0
"""Needles that bend, as members of a batch: each moves as it does alone."""

import numpy as np
import pytest

import needleforce as nf

DEPTHS = np.linspace(0.0, 1.0, 60)[:, None] * np.array([5e-3, 12e-3, 20e-3])
ASIDE = np.stack([0.1 * DEPTHS, 0.0 * DEPTHS], axis=-1)


def needles(n=3):
    needle = nf.Needle(0.7e-3, 0.4e-3, length=0.15, young_modulus=200e9)
    return [nf.FlexibleInsertion(nf.preset("paper"), needle, lateral=30e3) for _ in range(n)]


@pytest.mark.parametrize("threads", [1, 2])
def test_each_member_moves_as_it_does_alone(threads):
    runs = nf.InsertionBatch.of(needles(), threads).run(DEPTHS, lateral=ASIDE, dt=2e-3)
    for i, alone in enumerate(needles()):
        expected = alone.run(DEPTHS[:, i], ASIDE[:, i], dt=2e-3)
        for name, values in expected.items():
            np.testing.assert_array_equal(runs[name][:, i], values)


def test_some_members_start_again():
    batch = nf.InsertionBatch.of(needles())
    batch.run(DEPTHS[:30], dt=2e-3)
    before = batch.snapshot()
    batch.run(DEPTHS[30:], dt=2e-3)
    batch.restore(before, members=[1])
    batch.reset(members=[2])
    again = batch.run(DEPTHS[30:, [1, 1, 1]], dt=2e-3)["force"]
    alone = needles(1)[0]
    expected = alone.run(DEPTHS[:, 1], dt=2e-3)["force"][30:]
    np.testing.assert_array_equal(again[:, 1], expected)
    assert batch.step(-1e-3, dt=2e-3)[0].force == 0.0


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda batch: batch.run(DEPTHS[:, :2], dt=1e-3), r"not \(steps, 3\)"),
        (lambda batch: batch.run([[0.0, 0.0, 0.0], [0.0]], dt=1e-3), "rows of different lengths"),
        (lambda batch: batch.reset([3]), "member is 3, not between 0 and 2"),
        (lambda batch: batch.restore(()), "not of a batch of 3"),
        (lambda batch: nf.InsertionBatch.of([*batch.engines, batch.engines[0]]), "the same object as engine 0"),
        (lambda batch: nf.InsertionBatch.of([nf.preset("paper")]), "not an insertion"),
        (lambda batch: nf.InsertionBatch.of(batch.engines, threads=0), "threads is 0, below 1"),
        (lambda batch: batch.step([0.0, 1.0], dt=1e-3), r"the shape of depths is \(2,\), not \(3,\)"),
        (lambda batch: batch.reset([0.5]), "neither places nor a mask"),
        (lambda batch: batch.restore(3), "Give what snapshot"),
    ],
)
def test_what_fits_no_batch_is_refused(call, message):
    with pytest.raises(nf.InputError, match=message):
        call(nf.InsertionBatch.of(needles()))


def test_no_member_moves():
    assert nf.InsertionBatch.of([]).run(np.zeros((5, 0))) == {}
