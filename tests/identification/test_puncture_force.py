"""The force at the puncture as measured, where a filter has smeared the break."""

from types import SimpleNamespace

import numpy as np
import pytest

from needleforce.identification.one_layer.puncture_force import measured_peak
from needleforce.identification.statistics.noise import Noise

STEP, FILTER, PEAK, CONTACT, ZERO = 3e-6, 10, 899, 400, 0.05


def smeared() -> SimpleNamespace:
    """At 3 mm/s: free, a parabola up to 0.2 N at the sample PEAK, half of it gone over the length of the filter."""
    sample = np.arange(1100)
    rising = 0.2 * (np.clip(sample - CONTACT, 0, PEAK - CONTACT) / (PEAK - CONTACT)) ** 2
    force = rising - 0.1 * np.clip((sample - PEAK) / FILTER, 0.0, 1.0)
    noise = np.random.default_rng(4).normal(0.0, 1e-3, len(sample))
    return SimpleNamespace(depth_in=STEP * sample, force_in=force + noise + ZERO)


def test_a_curve_that_ends_at_the_peak_holds_nothing_of_the_break():
    strokes = smeared()
    fit = SimpleNamespace(
        causes={},  # a puncture found 20 samples too early
        puncture=SimpleNamespace(before=PEAK - 20, left_out=FILTER - 1),
        values={"puncture_depth": STEP * (PEAK - 20), "contact_depth": STEP * CONTACT,
                "puncture_indentation": STEP * (PEAK - CONTACT), "force_offset": ZERO},
        low={"puncture_depth": STEP * (PEAK - 21), "force_offset": ZERO - 1e-4},
        high={"puncture_depth": STEP * (PEAK - 19), "force_offset": ZERO + 1e-4},
    )  # fmt: skip
    late = STEP * (PEAK + 0.5 * (FILTER - 1))  # events have the depth of the force as filtered
    event = SimpleNamespace(force=float(strokes.force_in[PEAK - 3 : PEAK + 1].max()), depth=late, gradual=False)
    free = Noise(count=CONTACT - 20, variance=1e-6, long_run=1e-6)
    found = measured_peak(strokes, fit, event, FILTER, free).estimate(fit)
    assert found.value == pytest.approx(0.2, abs=2e-3)
    assert found.low < 0.2 < found.high
