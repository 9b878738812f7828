# SPDX-License-Identifier: Apache-2.0
"""What the residuals say of the noise, and how the intervals took it, in plain words."""

from collections.abc import Iterable

from .statistics.noise import Noise

WHITE = "white"
FADING = "fading over {}: long-run variance of a first-order autoregression"
WINDOWED = "correlated over {}: flat-top long-run variance"
LONG = "correlated over {}, an eighth of the stroke or more: too few independent stretches, intervals may be too narrow"


def noise_words(noises: Iterable[Noise]) -> str:
    """One phrase for each kind of noise among the strokes (n,), with the reach of its correlation in samples."""
    reaches: dict[str, list[int]] = {}
    for noise in noises:
        if noise.count:
            reaches.setdefault(_kind(noise), []).append(noise.reach)
    return "; ".join(kind.format(_samples(reach)) for kind, reach in reaches.items())


def _kind(noise: Noise) -> str:
    if not noise.reach:
        return WHITE
    if noise.fades:
        return FADING
    return LONG if 8 * noise.reach >= noise.count - 8 else WINDOWED


def _samples(reaches: list[int]) -> str:
    low, high = min(reaches), max(reaches)
    return f"{low} samples" if low == high else f"{low} to {high} samples"
