# SPDX-License-Identifier: Apache-2.0
"""The curves drawn: reduced samples keep their peaks; the correct recording; the correct stroke."""

import numpy as np
import pytest

from needleforce.display.canvas import envelope
from needleforce.identification.report.curves import anomalous_recordings, binned, loading, repeats, representative


@pytest.mark.parametrize("shift", [0.0, 0.3, 0.99])
@pytest.mark.parametrize("at", [0, 1, 12_345, 44_998, 44_999])
def test_a_drop_of_one_sample_is_kept(at, shift):
    time, force = np.linspace(0.0, 18.0, 45_000), np.zeros(45_000)
    force[at] = -1.0
    x, y = envelope(time, force, 100, shift)
    assert len(x) <= 4 * 101 and y.min() == -1.0 and x[np.argmin(y)] == time[at]
    assert np.all(np.diff(x) > 0)


def test_insertion_and_withdrawal_keep_their_order():
    depth = np.concatenate([np.linspace(0, 20, 5000), np.full(3000, 20.0), np.linspace(20, 0, 5000)])
    force = np.concatenate([np.linspace(0, 1, 5000), np.linspace(1, 0.5, 3000), np.linspace(-1, 0, 5000)])
    x, y = envelope(depth, force, 50)
    assert (y.max(), y.min()) == (1.0, -1.0) and x[0] == x[-1] == 0.0
    turn = int(np.argmax(x))
    assert np.all(np.diff(x[:turn]) >= 0) and y[: turn + 1].max() == 1.0


def test_few_samples_are_unchanged():
    x = np.arange(10.0)
    assert envelope(x, x, 100)[0] is x


def test_bins_have_mean_and_range_and_nan_if_empty():
    mean, low, high = binned(np.array([0.1, 0.2, 2.5]), np.array([1.0, 3.0, 5.0]), np.array([0.0, 1.0, 2.0, 3.0]))
    np.testing.assert_array_equal(mean, [2.0, np.nan, 5.0])
    np.testing.assert_array_equal(low, [1.0, np.nan, 5.0])
    np.testing.assert_array_equal(high, [3.0, np.nan, 5.0])


def test_repeats_are_in_seconds_and_millimetres_from_their_own_contact(make_fit):
    one = repeats(make_fit(1).recordings, None)[0]
    assert one.time[0] == 0.0 and one.indentation.max() == pytest.approx(20.0, abs=0.05)
    assert one.inward.any() and not (one.inward & one.outward).any()
    part = loading(one)
    assert one.indentation[part][-1] == pytest.approx(3.237, abs=0.04)


def test_the_median_recording_represents_and_the_anomalous_one_is_found(make_fit):
    fit = make_fit(4, anomalous=2)
    assert anomalous_recordings(fit.recordings) == {2}
    assert anomalous_recordings(make_fit(2, anomalous=2).recordings) == set()
    assert representative(repeats(fit.recordings, None)).number != 2
    assert representative(()) is None
