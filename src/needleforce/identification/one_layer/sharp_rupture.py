# SPDX-License-Identifier: Apache-2.0
"""A sharp rupture as the other explanation of a force peak: whether it explains the samples as well."""

from collections.abc import Sequence

import numpy as np

from ...errors import InputError
from ..statistics.noise import noise_of
from ..statistics.regression import VERY_STRONG_BIC, bic_gain, independent_samples
from ..strokes import Strokes
from .cycle_values import CycleFit
from .deformation_fit import DeformationFit


def refuse_sharp(
    residual: np.ndarray, sharp: CycleFit, loading: DeformationFit, strokes: Strokes, *, end: int, filter_length: int
) -> None:
    """Raises InputError unless the evidence of the gradual rupture's ``residual`` (n,) [N] against a sharp one is very
    strong."""
    modelled = _sharp_force(sharp, loading, strokes, end)
    used = np.ones(len(modelled), bool)
    if filter_length > 1:  # which smears a sharp rupture as well
        place = sharp.puncture.before
        used[max(place - filter_length, 0) : place + filter_length] = False
    force = np.concatenate([strokes.force_in[:end], strokes.force_out])
    residuals = [residual, force - modelled]
    one, other = (noise_of(np.where(used, each, 0.0), int(used.sum()), filter_length, 1.0) for each in residuals)
    n = independent_samples([one, other])
    if not bic_gain(one.sse, other.sse, 2, n) > VERY_STRONG_BIC:
        raise InputError("rupture", "not gradual", "a sharp one explains the samples as well")


def _sharp_force(sharp: CycleFit, loading: DeformationFit, strokes: Strokes, end: int) -> np.ndarray:
    """Force (n,) [N] of a sharp rupture at the place that suits the samples best, with the ``loading`` curve by itself
    before it, the best that a sharp rupture can have."""
    values, depth = sharp.values, strokes.depth_in[:end]
    loaded = loading.curve.force(depth - loading.values["contact_depth"], loading.values)
    loaded = loaded + loading.values["force_offset"] - values["force_offset"]
    cut = values["friction_per_length"] * np.maximum(depth - values["contact_depth"], 0.0) + values["cutting_force"]
    force = strokes.force_in[:end] - values["force_offset"]
    gain = np.cumsum((force - cut) ** 2 - (force - loaded) ** 2)
    modelled = np.where(np.arange(end) <= int(gain.argmax()), loaded, cut)
    back = -values["friction_per_length"] * np.maximum(strokes.depth_out - values["contact_depth"], 0.0)
    return np.concatenate([modelled, back]) + values["force_offset"]


def sharp_free(warnings: Sequence[str]) -> tuple[str, ...]:
    """The warnings that do not speak of a sharp rupture."""
    return tuple(each for each in warnings if "starts in contact" in each or "no withdrawal" in each)


def end_of_layer(strokes: Strokes, first: int, second: int | None) -> int:
    """Where the insertion of the first layer ends: at its least force between the end of the fall, sample ``first``,
    and the peak of the ``second`` puncture, as from there on the next layer is pressed in."""
    if second is None or second <= first + 1:
        return len(strokes.depth_in)
    return first + int(np.argmin(strokes.force_in[first:second])) + 1
