# SPDX-License-Identifier: Apache-2.0
"""How much each factor contributes to an output: indices of Sobol, Morris and delta, by SALib, with their intervals."""

from dataclasses import dataclass, replace

import numpy as np

from .rows import MORRIS_LEVELS, problem, salib

CONFIDENCE = 0.95
RESAMPLES, DELTA_RESAMPLES = 1000, 100  # of the bootstrap for the intervals; delta takes long


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
    made = _made(columns, rows, main=(found["S1"], found["S1_conf"]), total=(found["ST"], found["ST_conf"]))
    if not interactions:
        return made
    return replace(made, pairs=np.where(np.isfinite(found["S2"]), found["S2"], np.transpose(found["S2"])))


def _morris(columns: list[str], rows: np.ndarray, values: np.ndarray, interactions: bool, seed: int) -> Sensitivity:
    found = salib("analyze.morris").analyze(
        problem(columns), rows, values, num_levels=MORRIS_LEVELS, num_resamples=RESAMPLES, seed=seed
    )
    main, total = (found["mu"], found["sigma"]), (found["mu_star"], found["mu_star_conf"])
    return _made(columns, rows, main=main, total=total)


def _delta(columns: list[str], rows: np.ndarray, values: np.ndarray, interactions: bool, seed: int) -> Sensitivity:
    found = salib("analyze.delta").analyze(problem(columns), rows, values, num_resamples=DELTA_RESAMPLES, seed=seed)
    total = found["delta_raw"], found["delta_raw_conf"]
    return _made(columns, rows, main=(found["S1"], found["S1_conf"]), total=total)


def _made(columns: list[str], rows: np.ndarray, *, main: tuple, total: tuple) -> Sensitivity:
    """From the two indices and their errors, without those of pairs."""
    main, main_error, total, total_error = (np.asarray(each, float) for each in (*main, *total))
    pairs = np.full((len(columns), len(columns)), np.nan)
    return Sensitivity(
        names=tuple(columns),
        main=main,
        main_error=main_error,
        total=total,
        total_error=total_error,
        pairs=pairs,
        rows=len(rows),
    )


_METHODS = {"sobol": _sobol, "morris": _morris, "delta": _delta}
