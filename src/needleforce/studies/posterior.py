# SPDX-License-Identifier: Apache-2.0
"""Models drawn from the posterior of a fit, with the correlations of its estimates."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..files import as_type
from ..identification.export import preset_document
from ..identification.models import MODELS, model_of
from ..identification.one_layer.loading_curves import FITS
from ..identification.statistics.noise import TWO_SIDED
from ..preset_files.presets import preset_of

IDENTIFIED = "identified"  # begins the name of an identified model; its law follows


@dataclass(frozen=True, eq=False)
class Posterior:
    """The estimates of a fit: values, distances to the limits of their intervals in standard deviations, correlation.

    Parameters
    ----------
    names : tuple of str
        The estimates.
    values : ndarray, shape (n,)
        Their values in SI.
    below, above : ndarray, shape (n,)
        Standard deviation towards the lower and the upper limit.
    root : ndarray, shape (n, n)
        A root of their correlation matrix.
    law : str
        What was fitted: the stiffness law, or a key of ``FITS``.
    needle : Needle or None
        The needle of the fit.
    """

    names: tuple[str, ...]
    values: np.ndarray
    below: np.ndarray
    above: np.ndarray
    root: np.ndarray
    law: str
    needle: Any

    @property
    def size(self) -> int:
        """Numbers that a draw takes."""
        return len(self.names)

    def document(self, row: np.ndarray) -> dict:
        """The preset of one draw, of numbers (n,) between 0 and 1. Raises InputError outside the range of a law."""
        from scipy.special import ndtri

        tiny = np.finfo(float).eps
        normal = self.root @ ndtri(np.clip(row, tiny, 1.0 - tiny))
        drawn = self.values + normal * np.where(normal > 0.0, self.above, self.below)
        values = {name: float(value) for name, value in zip(self.names, drawn)}
        return preset_document(model_of(values, self.law, self.needle))


def posterior_of(document: dict, name: str) -> Posterior:
    """The posterior of a fit that ``identify --json`` wrote. Raises InputError for a fit without one."""
    model = str(document.get("model")).removeprefix(f"{IDENTIFIED}_")
    law = MODELS.get(model, model)
    if law not in FITS:
        limit = "only fits of one layer are drawn"
        step = "Identify with a model of one layer, or give distributions of the factors."
        raise InputError("model of the fit", repr(model), limit, name, step)
    estimates = as_type(document["parameters"], list[dict], "fit", "Identify again with --json.")
    estimates = [each for each in estimates if each["value"] is not None]
    limits = np.array([[np.nan if each[end] is None else each[end] for end in ("low", "high")] for each in estimates])
    values = np.array([each["value"] for each in estimates], dtype=float)
    known = np.isfinite(limits)
    below = np.where(known[:, 0], values - limits[:, 0], 0.0) / TWO_SIDED
    above = np.where(known[:, 1], limits[:, 1] - values, 0.0) / TWO_SIDED
    names = tuple(each["name"] for each in estimates)
    needle = preset_of(document["preset"]).needle
    root = _root(_matrix(names, document.get("correlations")))
    return Posterior(
        names=names,
        values=values,
        below=np.maximum(below, 0.0),
        above=np.maximum(above, 0.0),
        root=root,
        law=law,
        needle=needle,
    )


def _matrix(names: tuple[str, ...], correlations: dict | None) -> np.ndarray:
    """The correlations of the estimates; those that the fit does not state are 0."""
    matrix = np.eye(len(names))
    stated = {} if correlations is None else {name: k for k, name in enumerate(correlations["names"])}
    for i, one in enumerate(names):
        for j, other in enumerate(names):
            if one in stated and other in stated:
                value = correlations["matrix"][stated[one]][stated[other]]
                matrix[i, j] = value if value is not None else float(i == j)
    return matrix


def _root(matrix: np.ndarray) -> np.ndarray:
    """A root of a correlation matrix, whose small negative eigenvalues are rounding."""
    values, vectors = np.linalg.eigh(matrix)
    return vectors * np.sqrt(np.maximum(values, 0.0))
