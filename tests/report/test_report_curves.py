# SPDX-License-Identifier: Apache-2.0
"""The curves drawn: reduced samples keep their peaks; the correct recording; the correct stroke."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from needleforce.display.canvas import FULL, envelope
from needleforce.identification.estimates import Estimate
from needleforce.identification.report.curves import anomalous_recordings, binned, loading, repeats, representative
from needleforce.identification.report.force_figures import draw_before_puncture
from needleforce.identification.report.repeat_figures import residuals


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


def test_the_identified_zero_is_taken_off_before_the_puncture(make_fit):
    (one,) = make_fit().recordings
    zero = {"force_offset": Estimate("force_offset", 0.05, "N", 0.04, 0.06)}
    shifted = replace(one, recording=replace(one.recording, force=one.recording.force + 0.05), parameters=zero)
    drawn = []
    for each in (one, shifted):
        figure = Figure(figsize=(8.9, 3.5), dpi=72)
        draw_before_puncture(figure, FULL, repeats([each], None), None)
        drawn.append(figure.axes[0].lines[0].get_ydata())
    np.testing.assert_allclose(*drawn, atol=1e-12)


def test_a_spike_does_not_set_the_scale_of_residuals(make_fit):
    (one,) = make_fit().recordings
    force = one.recording.force.copy()
    force[int(np.argmax(one.recording.depth)) + 5] += 3.0  # as at a reversal of friction that comes late
    (figure,) = residuals(repeats([replace(one, recording=replace(one.recording, force=force))], None), one.quality)
    canvas = Figure(figsize=(8.9, 3.0), dpi=72)
    figure.draw(canvas, FULL)
    assert canvas.axes[0].get_ylim()[1] < 0.1 and "the largest residual is 3.0" in str(figure.caption)
