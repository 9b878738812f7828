# SPDX-License-Identifier: Apache-2.0
"""A prior over tissues learnt from what was identified in each."""

from collections.abc import Sequence

import numpy as np

from ..errors import InputError
from .steering_model import SteeringModel
from .tip_path_fit import SteeringFit
from .tissue_prior import Spread, TissuePrior


def prior(fits: Sequence[SteeringFit | SteeringModel]) -> TissuePrior:
    """Learn what several tissues have in common, so that less has to be measured in the next one.

    Parameters
    ----------
    fits : sequence of SteeringFit or SteeringModel
        One a tissue: of ``nf.steering.identify`` for tip paths, or of ``nf.steering.load``; of one form, and all of
        needles that are held in the same way.

    Returns
    -------
    TissuePrior
        For ``nf.steering.identify(insertions, needle, prior=...)``.

    Raises
    ------
    InputError
        If there is no fit, or they are of several forms.

    Notes
    -----
    Mean and covariance are those of a mixture: what each tissue shows with its own errors, so that what it does not
    show stays open, and the wide prior, which counts as one tissue more. Of x and y the means are 0 and the spreads the
    same, as a tissue has no direction.
    """
    models = [getattr(each, "model", each) for each in fits]
    predictors = [model.predictor for model in models]
    groups = {(model.form, tuple(each.name for each in model.predictor.parameters)) for model in models}
    if len(groups) != 1 or not all(predictor.insertions for predictor in predictors):
        given = " and ".join(sorted(f"{form} with {len(names)} parameters" for form, names in groups)) or "nothing"
        step = "Identify all from tip paths, with the same model and held."
        raise InputError("fits of a prior", given, "one form is needed, from tip paths", next_step=step)
    form, names = groups.pop()
    spread = _over_tissues([each.found for each in predictors], names)
    response = _over_tissues([each.response_found for each in predictors])
    return TissuePrior(form, names, spread, response, len(predictors))


def _over_tissues(tissues: Sequence[Spread], names: Sequence[str] = ()) -> Spread:
    """Mean and covariance of numbers in a further tissue: of a mixture of what each tissue shows, and of the wide
    prior, once."""
    count = len(tissues[0].mean)
    each = [Spread.wide(count), *tissues]
    mean = _without_direction(np.mean([one.mean for one in each], axis=0), names)
    apart = np.array([one.mean for one in each]) - mean
    within = np.mean([one.covariance for one in each], axis=0)
    return Spread(mean, _evenly(within + apart.T @ apart / len(each), names))


def _sides(names: Sequence[str]) -> list[list[int]]:
    """Indices of x and y of each parameter that has both."""
    known = list(names)
    return [[k, known.index(f"{name[:-2]}_y")] for k, name in enumerate(known) if name.endswith("_x")]


def _without_direction(mean: np.ndarray, names: Sequence[str]) -> np.ndarray:
    for pair in _sides(names):
        mean[pair] = 0.0
    return mean


def _evenly(covariance: np.ndarray, names: Sequence[str]) -> np.ndarray:
    for pair in _sides(names):
        variance = np.diag(covariance)[pair].mean()
        covariance[pair], covariance[:, pair] = 0.0, 0.0
        covariance[pair, pair] = variance
    return covariance
