# SPDX-License-Identifier: Apache-2.0
"""Schwarz's information criterion (BIC, 1978) of curves fitted to the same samples, alike or not."""

import math

from .noise import Noise

VERY_STRONG = 10.0  # difference of two criteria, in the words of Kass & Raftery 1995


def criterion(noise: Noise, numbers: int, samples: float) -> float:
    """n log(sum of squares / count) + numbers log(n), n being ``samples``; numbers do not count the noise's own."""
    variance = max(noise.sse / noise.count, 1e-300)
    return samples * math.log(variance) + numbers * math.log(samples)


def independent_samples(noises: list[Noise]) -> float:
    """Samples that count where neighbours are alike: count times plain over long-run variance, of the least residual.

    Misfit makes neighbours alike too, so that the best of the curves says most about the noise; never fewer than two.
    """
    least = min(noises, key=lambda noise: noise.sse)
    return max(least.count * least.variance / least.long_run, 2.0) if least.long_run > 0.0 else float(least.count)
