# SPDX-License-Identifier: Apache-2.0
"""How much each factor contributes to an output: indices of Sobol, Morris and delta, by SALib, with their intervals."""

from dataclasses import dataclass

import numpy as np

from .rows import MORRIS_LEVELS, problem, salib

CONFIDENCE = 0.95
RESAMPLES = 1000  # of the bootstrap for the intervals


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """The indices of one output.

    Parameters
    ----------
    names : tuple of str
        The factors.
    main, main_error : ndarray, shape (k,)
        Contribution of each factor alone, and half its 95 % interval: first-order index (Sobol, delta), mean elementary
        effect (Morris, in the unit of the output).
    total, total_error : ndarray, shape (k,)
        Contribution with all interactions, and half its interval: total index (Sobol), mean absolute effect (Morris),
        delta, the moment-independent index.
    pairs : ndarray, shape (k, k)
        Second-order indices (Sobol with interactions), NaN elsewhere.
    rows : int
        Insertions that were used: groups with a failed one are left out.
    """

    names: tuple[str, ...]
    main: np.ndarray
    main_error: np.ndarray
    total: np.ndarray
    total_error: np.ndarray
    pairs: np.ndarray
    rows: int


def sensitivity(
    analysis: str,
    columns: list[str],
    rows: np.ndarray,
    values: np.ndarray,
    *,
    interactions: bool = False,
    seed: int = 0,
) -> Sensitivity | None:
    """The indices of an output ``values`` (n,) over ``rows`` (n, k); None if too few insertions have a value or all
    values are equal."""
    group = _group(analysis, len(columns), interactions)
    whole = np.isfinite(values).reshape(-1, group).all(axis=1)
    kept = np.repeat(whole, group)
    if whole.sum() < 2 or np.ptp(values[kept]) == 0.0:
        return None
    return _METHODS[analysis](columns, rows[kept], values[kept], interactions, seed)


def _group(analysis: str, factors: int, interactions: bool) -> int:
    """Rows that belong together: without one of them the others cannot be used."""
    if analysis == "sobol":
        return 2 * factors + 2 if interactions else factors + 2
    return factors + 1 if analysis == "morris" else 1


def _sobol(columns: list[str], rows: np.ndarray, values: np.ndarray, interactions: bool, seed: int) -> Sensitivity:
    found = salib("analyze.sobol").analyze(
        problem(columns),
        values,
        calc_second_order=interactions,
        num_resamples=RESAMPLES,
        conf_level=CONFIDENCE,
        seed=seed,
    )
    pairs = np.full((len(columns), len(columns)), np.nan)
    if interactions:
        pairs = np.where(np.isfinite(found["S2"]), found["S2"], np.transpose(found["S2"]))
    return Sensitivity(tuple(columns), found["S1"], found["S1_conf"], found["ST"], found["ST_conf"], pairs, len(rows))


def _morris(columns: list[str], rows: np.ndarray, values: np.ndarray, interactions: bool, seed: int) -> Sensitivity:
    found = salib("analyze.morris").analyze(
        problem(columns), rows, values, num_levels=MORRIS_LEVELS, num_resamples=RESAMPLES, seed=seed
    )
    pairs = np.full((len(columns), len(columns)), np.nan)
    main, total = np.asarray(found["mu"]), np.asarray(found["mu_star"])
    return Sensitivity(
        tuple(columns), main, np.asarray(found["sigma"]), total, np.asarray(found["mu_star_conf"]), pairs, len(rows)
    )


def _delta(columns: list[str], rows: np.ndarray, values: np.ndarray, interactions: bool, seed: int) -> Sensitivity:
    found = salib("analyze.delta").analyze(problem(columns), rows, values, num_resamples=100, seed=seed)
    pairs = np.full((len(columns), len(columns)), np.nan)
    return Sensitivity(
        tuple(columns), found["S1"], found["S1_conf"], found["delta_raw"], found["delta_raw_conf"], pairs, len(rows)
    )


_METHODS = {"sobol": _sobol, "morris": _morris, "delta": _delta}
