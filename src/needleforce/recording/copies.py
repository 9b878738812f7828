# SPDX-License-Identifier: Apache-2.0
"""Recordings of one experiment among those given as repeats: the same readings, however they were saved."""

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from .. import core
from .recording import Recording

COPIED_SHARE = 0.1  # of the noise: forces of two files that differ by less are the same readings
ROUNDING = 1e-9  # of the force: what a conversion of units changes
MIN_COMPARED, MAX_LACKING = 20, 0.1  # samples whose forces are compared, and share that one of two may lack
MAX_COMPARED = 16_384  # samples whose noise is compared
MAX_THINNING = 20  # rows of one file for each row of the other
MIN_CORRELATION = 0.8  # of equal noise; that of measured repeats is up to 0.51, by what the drive does to each
FALSE_ALARMS = 1e-6  # of a pair of recordings with noise of their own
CLIPPED_SD = 3.0  # beyond, a change of the force is that of a rupture or a spike, and no noise


def copies(recordings: Sequence[Recording]) -> dict[int, int]:
    """The recordings of files that have the readings of another one before them.

    Parameters
    ----------
    recordings : sequence of Recording
        In the order in which they are compared.

    Returns
    -------
    dict
        Number of the recording -> number of the first one with its readings.

    Notes
    -----
    Files of the same bytes are copies, and so are others whose forces differ by less than a tenth of their noise in the
    root mean square. Independent repeats never have equal noise: files are copies, too, if the second differences of
    their forces have a correlation of 0.8 and more at some shift in time, larger than that of independent noise is in
    one of a million pairs (by Bartlett's variance, so that hum and smooth curves count as the few samples they are).
    That finds readings which were rounded, converted, scaled, shifted, cut, or of which every k-th row or the mean of
    k rows was saved. Forces in memory are not compared.
    """
    found: dict[int, int] = {}
    longest = min(max(map(len, recordings), default=0), MAX_COMPARED)
    size = 2 ** (2 * longest).bit_length()
    noises = [_Noise.of(each.force, size) for each in recordings] if len(recordings) > 1 else []
    for k, one in enumerate(noises):
        earlier = (j for j in range(k) if j not in found)
        first = next((j for j in earlier if _is_copy(recordings[k], recordings[j], one, noises[j])), None)
        found |= {} if first is None else {k: first}
    return found


@dataclass(frozen=True, eq=False)
class _Noise:
    """The second differences of a force in robust standard deviations: their ``count``, their ``spectrum``, and their
    sum of ``squares``, 0 where rounding hides them."""

    count: int
    spectrum: np.ndarray
    squares: float

    @classmethod
    def of(cls, force: np.ndarray, size: int) -> "_Noise":
        """Of a force (n,), with zeros up to ``size``."""
        second = np.diff(force[:MAX_COMPARED], 2)
        sd = float(np.median(np.abs(second))) / 0.6745 if len(second) else 0.0
        clipped = np.clip(second / sd, -CLIPPED_SD, CLIPPED_SD) if sd > 0.0 else np.zeros(1)
        return cls(len(clipped), np.fft.rfft(clipped, size), float(clipped @ clipped))

    def is_that_of(self, other: "_Noise", tried: int = 1) -> bool:
        """Whether both are one, ``tried`` pairs being compared, by their correlation at every shift."""
        products = np.abs(np.fft.irfft(self.spectrum * np.conj(other.spectrum)))
        min_product = MIN_CORRELATION * min(self.squares, other.squares)
        by_chance = (float(products @ products) / max(self.count, other.count)) ** 0.5
        level = -NormalDist().inv_cdf(0.5 * FALSE_ALARMS / ((self.count + other.count) * tried))
        return min_product > 0.0 and float(products.max()) > max(min_product, level * by_chance)


def _is_copy(one: Recording, other: Recording, noise: _Noise, others: _Noise) -> bool:
    hashes = one.card.sha256, other.card.sha256
    if hashes[0] == hashes[1]:
        return hashes[0] != "" and one.card.part == other.card.part
    if not all(hashes) or min(len(one), len(other)) < MIN_COMPARED:
        return False
    return _equal_forces(one.force, other.force) or noise.is_that_of(others) or _thinned(one, other, noise, others)


def _equal_forces(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether two forces, up to the length of the shorter from either end, differ by less than their noise allows."""
    count, size = min(len(one), len(other)), float(np.ptp(one))
    if max(len(one), len(other)) > (1.0 + MAX_LACKING) * count or not size > 0.0:
        return False
    tolerance = max(COPIED_SHARE * float(core.second_difference_noise(one)), ROUNDING * size)
    pairs = (one[:count], other[:count]), (one[-count:], other[-count:])
    return any(float(np.sqrt(np.mean((a - b) ** 2))) <= tolerance for a, b in pairs)


def _thinned(one: Recording, other: Recording, noise: _Noise, others: _Noise) -> bool:
    """Whether the noise of the slower recording is that of every k-th reading of the other, or of means of k."""
    (fine, _), (coarse, known) = sorted([(one, noise), (other, others)], key=lambda each: -each[0].rate)
    k = round(fine.rate / coarse.rate)
    if not 2 <= k <= MAX_THINNING:
        return False
    whole, size = len(fine) // k * k, 2 * (len(known.spectrum) - 1)
    for first in range(k):
        means = np.roll(fine.force, -first)[:whole].reshape(-1, k).mean(axis=1)
        if any(known.is_that_of(_Noise.of(each, size), 2 * k) for each in (fine.force[first::k], means)):
            return True
    return False
