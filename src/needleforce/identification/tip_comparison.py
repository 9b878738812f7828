# SPDX-License-Identifier: Apache-2.0
"""Which tip describes an indentation curve: BIC, and how much of a difference is noise."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..errors import InputError
from .indentation import IndentationFit, fit_indentation
from .statistics.information import VERY_STRONG
from .statistics.noise import Z_95, noise_of


class TipRow(NamedTuple):
    """One tip: its fit, its BIC above the lowest with the 95 % noise of that difference, and whether they differ.

    ``told_apart`` is False for a difference below 10 or below its noise, and for the best itself.
    """

    fit: IndentationFit
    more_than_best: float
    noise: float
    told_apart: bool


def compare_tips(depth, force, tips: Sequence, *, progress=None, **options) -> tuple[TipRow, ...]:
    """The fit of ``fit_indentation`` with each of ``tips``, the lowest BIC first; ``options`` are its own.

    Tips of one shape, as cones of any angle, fit alike: a curve does not choose between the moduli that they give.
    ``progress(iterable, text)`` wraps the tips. Raises InputError for no tip, and, naming the tip, where a fit does.
    """
    if not tips:
        raise InputError("tips", "none", "nothing to fit", next_step="Give at least one of nf.tips.")
    watched = progress(tips, "fitting") if progress else tips
    fits = sorted((_fit(depth, force, tip, options) for tip in watched), key=lambda fit: fit.bic)
    return tuple(_row(fit, fits[0]) for fit in fits)


def _fit(depth, force, tip, options: dict) -> IndentationFit:
    try:
        return fit_indentation(depth, force, tip, **options)
    except InputError as error:
        raise error.at(repr(tip)) from None


def _row(fit: IndentationFit, best: IndentationFit) -> TipRow:
    """The noise is that of a sum of differences of squares, which are alike among neighbours (after Vuong 1989)."""
    more = fit.bic - best.bic
    apart = (fit.residual**2 - best.residual**2) / (best.residual_rms * fit.residual_rms)
    noise = Z_95 * math.sqrt(len(apart) * noise_of(apart - np.mean(apart), len(apart)).long_run)
    return TipRow(fit, more, noise, more > max(VERY_STRONG, noise))
