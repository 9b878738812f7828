# SPDX-License-Identifier: Apache-2.0
"""The bias of a sensor at rest, before anything is touched."""

import numpy as np

from ..errors import InputError
from ..wire.rdt import is_fault, status_words
from .settings import Bias, Settings
from .sources.source import ForceSample

FEWEST = 10  # readings
_ADVICE = "Keep the needle free and at rest, or allow more with --steady-N."


def bias_of(samples: list[ForceSample], settings: Settings) -> Bias:
    """Mean and noise of healthy readings. Raises InputError for too few, or for an axial force that is not steady.

    Steady: the mean of the last third within ``settings.steady`` [N] of that of the first, and so the noise.
    """
    healthy = [sample.wrench for sample in samples if not is_fault(sample.status)]
    fewest = max(FEWEST, len(samples) // 2)
    if len(healthy) < fewest:
        words = status_words(next((s.status for s in samples if is_fault(s.status)), 0))
        limit = f"{fewest} of {len(samples)} must be healthy; status: {words}"
        raise InputError("readings at rest", len(healthy), limit, "bias", "Give a longer rest with --bias-s, or 0.")
    wrench = np.array(healthy)
    _check_steady(wrench[:, settings.column], settings.steady)
    mean, noise = wrench.mean(axis=0), wrench.std(axis=0, ddof=1)
    return Bias(tuple(mean.tolist()), tuple(noise.tolist()), len(healthy))


def _check_steady(force: np.ndarray, steady: float) -> None:
    third = len(force) // 3
    drift = float(force[-third:].mean() - force[:third].mean())
    if not abs(drift) <= steady:
        limit = f"more than {steady:g} N: it drifts, or the needle touches"
        raise InputError("change of the force at rest", f"{drift:.3f} N", limit, "bias", _ADVICE)
    noise = float(force.std(ddof=1))
    if not noise <= steady:
        limit = f"more than {steady:g} N: it shakes, or the needle touches"
        raise InputError("standard deviation of the force at rest", f"{noise:.3f} N", limit, "bias", _ADVICE)
