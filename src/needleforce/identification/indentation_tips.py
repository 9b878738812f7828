# SPDX-License-Identifier: Apache-2.0
"""Indentation fits of several tips, compared by their BIC."""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from numpy.typing import ArrayLike

from ..display.tables import in_words
from ..errors import InputError
from .indentation import IndentationFit, fit_indentation
from .statistics.noise import TWO_SIDED, noise_of
from .statistics.regression import VERY_STRONG_BIC


class TipFit(NamedTuple):
    """One tip of a comparison.

    Attributes
    ----------
    fit : IndentationFit
        Its fit.
    more_than_best : float
        Its BIC minus the lowest one.
    noise : float
        Half width of the interval of that difference.
    distinguishable : bool
        False for the best tip, and for a difference below 10 or below its noise.
    """

    fit: IndentationFit
    more_than_best: float
    noise: float
    distinguishable: bool


def compare_tips(
    depth: ArrayLike,
    force: ArrayLike,
    tips: Sequence[Any],
    *,
    progress: Callable[[Any, str], Any] | None = None,
    **options: Any,
) -> tuple[TipFit, ...]:
    """Fit the contact of each of several tips to one approach.

    Tips of the same shape, such as cones of any angle, fit equally well: a curve does not choose between their moduli.

    Parameters
    ----------
    depth, force : array_like
        Depth (n,) [m] and force (n,) [N], as in ``fit_indentation``.
    tips : sequence of Tip
        Some of ``nf.tips``.
    progress : callable, optional
        ``progress(iterable, text)`` wraps the tips.
    **options
        Keywords of ``fit_indentation``.

    Returns
    -------
    tuple of TipFit
        The lowest BIC first.

    Raises
    ------
    InputError
        Without a tip, and where a fit fails; the message names the tip.
    """
    if not tips:
        raise InputError("number of tips", 0, "at least 1 is needed", next_step="Give some of nf.tips.")
    fits = [_fit(depth, force, tip, options) for tip in (progress(tips, "fitting") if progress else tips)]
    fits.sort(key=lambda fit: fit.bic)
    return tuple(_row(fit, fits[0]) for fit in fits)


def _fit(depth: ArrayLike, force: ArrayLike, tip: Any, options: dict[str, Any]) -> IndentationFit:
    try:
        return fit_indentation(depth, force, tip, **options)
    except InputError as error:
        raise error.at(in_words(tip)) from None


def _row(fit: IndentationFit, best: IndentationFit) -> TipFit:
    """One row; the noise is that of a sum of differences of squares, which are autocorrelated (after Vuong 1989)."""
    more = fit.bic - best.bic
    difference = (fit.residual**2 - best.residual**2) / (best.residual_rms * fit.residual_rms)
    noise = TWO_SIDED * math.sqrt(len(difference) * noise_of(difference - difference.mean(), len(difference)).long_run)
    return TipFit(fit, more, noise, more > max(VERY_STRONG_BIC, noise))
