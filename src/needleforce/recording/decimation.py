# SPDX-License-Identifier: Apache-2.0
"""Decimation to a lower rate, in one pass over blocks of samples: every quantity through one filter without delay."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..errors import InputError
from ..files import MAX_SAMPLES
from .recording import COLUMNS, Card, Recording

_MIN_RATIO = 2.0  # of the rates: with less there is nothing to filter
_MIN_WEIGHT = 0.75  # of a sample within the recording: one with less is at an end, or at a gap, and not in its middle
_RATES = 1e-3, 1e6  # [Hz]


class Decimated:
    """Samples at ``rate`` [Hz], to which blocks of others are added in any order of time.

    Each sample is the mean of those around it, weighted by a triangle of two of the new steps to each of its sides but
    one: w = 1 - |t| rate. It is the mean over a step taken twice: its response is sinc²(f / rate), so it has no delay,
    no overshoot at a fall of the force, and the noise of n samples a step falls by sqrt(3 n / 2). Time is averaged as
    the other quantities, so that losses and uneven steps shift nothing.
    """

    def __init__(self, rate: float):
        if not _RATES[0] <= rate <= _RATES[1]:
            limit = f"outside {_RATES[0]:g} to {_RATES[1]:g} Hz"
            raise InputError("rate to decimate to", f"{rate:g} Hz", limit, next_step="Give it with --decimate-to-hz.")
        self._rate, self._origin, self._ratio, self.count = rate, 0.0, 1.0, 0
        self._names: tuple[str, ...] = ()
        self._sums = np.zeros((0, 0))

    def add(self, values: Mapping[str, np.ndarray]) -> None:
        """Add samples (n,) of quantities, of which one is the time [s]; the first ones are the earliest."""
        time = values["time"]
        if not self.count:
            self._names, self._origin = tuple(values), float(time[0])
            self._sums = np.zeros((1 + len(values), 0))
        self.count += len(time)
        place = np.maximum(time - self._origin, 0.0) * self._rate
        whole = place.astype(np.int64)
        share, first, end = place - whole, int(whole.min()), int(whole.max()) + 2
        self._reserve(end)
        for weight, offset in ((1.0 - share, 0), (share, 1)):
            for row, name in zip(self._sums, ("", *self._names)):
                terms = weight * values[name] if name else weight
                row[first:end] += np.bincount(whole - first + offset, terms, end - first)

    def _reserve(self, count: int) -> None:
        if count > MAX_SAMPLES:
            limit = f"more than {MAX_SAMPLES} samples"
            raise InputError("rate to decimate to", f"{self._rate:g} Hz", limit, next_step="Give a lower one.")
        if count > self._sums.shape[1]:
            more = min(max(count, 2 * self._sums.shape[1]), MAX_SAMPLES) - self._sums.shape[1]
            self._sums = np.pad(self._sums, ((0, 0), (0, more)))

    def values(self) -> dict[str, np.ndarray]:
        """The new samples of each quantity. Raises InputError for a rate that is not lower."""
        weight = self._sums[0]
        usual = float(np.median(weight[weight > 0.0]))
        if usual < _MIN_RATIO:
            limit = f"at most half the rate of the recording, which is about {usual * self._rate:.4g} Hz"
            raise InputError("rate to decimate to", f"{self._rate:g} Hz", limit, next_step="Give a lower one.")
        kept = weight >= _MIN_WEIGHT * usual
        self._ratio = usual
        return {name: row[kept] / weight[kept] for name, row in zip(self._names, self._sums[1:])}

    def card(self, card: Card) -> Card:
        """The card of the recording that was reduced, with a filter length of the same delay."""
        sentence = (
            f"{self.count} samples are reduced to {self._rate:g} a second: each is the mean over {self._ratio:.4g}, "
            "taken twice, without delay"
        )
        length = 1 + round((card.filter_length - 1) / self._ratio)
        return replace(card, filter_length=length, assumptions=(*card.assumptions, sentence))


def decimated(recording: Recording, rate: float) -> Recording:
    """A recording at a lower rate [Hz]; its card states how it was reduced. Raises InputError for a rate that is not
    lower."""
    reduced = Decimated(rate)
    reduced.add({name: getattr(recording, name) for name in COLUMNS} | recording.axes)
    values = reduced.values()
    main = {name: values.pop(name) for name in COLUMNS}
    return replace(recording, **main, axes=values, card=reduced.card(recording.card))
