# SPDX-License-Identifier: Apache-2.0
"""A stiffness of dragged tissue that is known before the fit, as from finite elements: checks, weight, search."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ... import core
from ...errors import InputError
from ..statistics.noise import TWO_SIDED, noise_of
from .binned_cycle import BinnedCycle
from .parameters import FRICTION_RATIO, TISSUE_STIFFNESS, logistic
from .problem import KnownStiffness, Problem
from .search import FINAL_STEPS, MIN_GAIN, Solved, again, best, refined, with_exchanged_springs
from .uncertainty import uncertainty_of

MIN_RELATIVE_ERROR = 1e-6
"""Smaller ones count as this one: no interval shows them, and their rows would hide all others."""
LIMITS = next((row["low"], row["high"]) for row in core.laws.DraggedTissue.table() if row["name"] == "stiffness")
MAX_RATIO = 0.999  # of friction over the spring's force at rest, for starts
MAX_ROUNDS = 3  # of a search, with the weights by the fit without what is known that the round before has led to

Search = Callable[[Problem, list[np.ndarray]], Solved]


def known_stiffnesses(given: Any, layers: int | None) -> tuple[KnownStiffness, ...]:
    """What is known of the layers' stiffnesses.

    Parameters
    ----------
    given : sequence
        For each layer from the surface down its stiffness [N/m] and relative error, or None.
    layers : int or None
        Number of layers.

    Returns
    -------
    tuple of KnownStiffness

    Raises
    ------
    InputError
        Without ``layers``, for another number of entries, for entries that are not two finite numbers above 0, and for
        a stiffness that the law does not have.
    """
    if layers is None:
        limit = "tissue_stiffness has an entry for each layer"
        raise InputError("layers", "missing", limit, next_step="Give layers, or leave tissue_stiffness out.")
    entries = list(given) if isinstance(given, Sequence | np.ndarray) else [given]
    if len(entries) != layers:
        raise InputError(
            "number of entries in tissue_stiffness",
            len(entries),
            f"it must be that of the layers, {layers}",
            next_step="Give one (value, relative_error) for each layer from the surface down, None for an unknown one.",
        )
    return tuple(_known(layer, entry) for layer, entry in enumerate(entries) if entry is not None)


def _known(layer: int, entry: Any) -> KnownStiffness:
    where = f"tissue_stiffness of layer {layer + 1}"
    try:
        value, error = map(float, entry)
    except (TypeError, ValueError):
        raise InputError(where, repr(entry), "it must be (value, relative_error) or None") from None
    if not (np.isfinite(value) and value > 0.0):
        raise InputError(where, f"{value:g} N/m", "it must be finite and above 0", next_step="Give it in N/m.")
    if not LIMITS[0] <= value <= LIMITS[1]:
        limit = f"the law has {LIMITS[0]:g} to {LIMITS[1]:g} N/m"
        raise InputError(where, f"{value:g} N/m", limit, next_step="Give it in N/m.")
    if not (np.isfinite(error) and error > 0.0):
        step = "Give the standard deviation of its logarithm, such as 0.2 for 20 %, or None for an unknown stiffness."
        raise InputError(f"relative error of {where}", f"{error:g}", "it must be finite and above 0", next_step=step)
    return KnownStiffness(layer=layer, value=value, relative_error=max(error, MIN_RELATIVE_ERROR))


def with_known(alone: Solved, known: tuple[KnownStiffness, ...]) -> Solved:
    """The fit ``alone``, of the recordings, once more with what is known beforehand and with other mechanisms.

    Layers keep their order in a search, and so their numbers: their tops move as distances from the layer above.
    """
    return _searched(alone, known, best) if known else alone


def refined_with(solved: Solved, cycles: tuple[BinnedCycle, ...]) -> Solved:
    """The same fit in shorter bins, with the weights by the noise in these."""
    known = solved.problem.known
    alone = refined(replace(solved, problem=replace(solved.problem, known=())), cycles)

    def lowest(problem: Problem, starts: list[np.ndarray]) -> Solved:
        found = (again(Solved(problem, x, np.inf), x) for x in (solved.x, *starts))
        return min(found, key=lambda each: each.cost)

    return _searched(alone, known, lowest)


def _searched(alone: Solved, known: tuple[KnownStiffness, ...], search: Search) -> Solved:
    """The fit with what is known beforehand, from the one without it and from the known stiffnesses: a narrow row
    leaves a descent no way along the valley between springs that the recordings hardly distinguish.

    Where that leads to a better fit of the recordings, the noise of the one without was too large, and with it the
    weight.
    """
    for _ in range(MAX_ROUNDS):
        problem = replace(alone.problem, known=weighted(alone, known))
        held = problem.unknowns.held | {each.place for each in known} | {problem.unknowns.withdrawal}
        near = replace(problem, unknowns=replace(problem.unknowns, held=held))
        begun = [alone.x] + [
            with_exchanged_springs(problem.unknowns, alone.x, upper, upper + 1)
            for upper in range(problem.unknowns.layers - 1)
        ]
        starts = [near.solve(x, FINAL_STEPS)[0] for each in begun for x in _at_the_values(problem, each)]
        found = search(problem, [alone.x, *starts])
        freed = again(found, found.x, known=())
        if not freed.cost < (1.0 - MIN_GAIN) * alone.cost:
            break
        alone = freed
    judged = _judged(problem.known, found.cost - min(alone.cost, freed.cost))
    return replace(found, problem=replace(problem, known=judged))


def weighted(alone: Solved, known: tuple[KnownStiffness, ...]) -> tuple[KnownStiffness, ...]:
    """The same with the noise by which their rows are weighted.

    It is the variance of the residuals that explains the interval of the stiffness by the recordings alone: with one
    recording the long-run variance of its noise, with three or more that to which their scatter amounts. It does not
    depend on the prior, so that one that contradicts the recordings does not raise its own weight.
    """
    found, problem = uncertainty_of(alone), alone.problem
    runs = range(len(problem.cycles))
    noise = np.mean([noise_of(problem.residuals(r, alone.x), len(problem.cycles[r].depth)).long_run for r in runs])
    made = []
    for each in known:
        k = found.names.index(each.name)
        error, variance = found.half[k] / TWO_SIDED, found.for_unit_noise[k]
        if not (np.isfinite(error) and error > 0.0 and variance > 0.0):  # the recordings do not show this stiffness
            made.append(replace(each, noise=float(noise), alone=np.nan, alone_error=np.inf))
            continue
        value = float(found.value[k])
        made.append(
            replace(each, noise=float(error**2 / variance), alone=value, alone_error=float(error / value)),
        )
    return tuple(made)


def _judged(known: tuple[KnownStiffness, ...], rise: float) -> tuple[KnownStiffness, ...]:
    """The same with those marked that the recordings contradict: by their own interval, and by the ``rise`` of the cost
    over that of the recordings alone, which does not rise along a valley however far an end of it is."""
    noise = float(np.mean([each.noise for each in known]))
    clear = 2.0 * rise > TWO_SIDED**2 * noise
    apart = [
        abs(np.log(each.alone / each.value)) > TWO_SIDED * np.hypot(each.alone_error, each.relative_error)
        for each in known
    ]
    return tuple(replace(each, contradicted=bool(clear and far)) for each, far in zip(known, apart))


def _at_the_values(problem: Problem, x: np.ndarray) -> Iterator[np.ndarray]:
    """The vector with the known stiffnesses, with the same ratio of friction to spring, and with the same friction."""
    same_ratio, same_friction = x.copy(), x.copy()
    for each in problem.known:
        ratio_at = each.place + FRICTION_RATIO - TISSUE_STIFFNESS
        same_ratio[each.place] = same_friction[each.place] = np.log(each.value)
        ratio = min(logistic(x[ratio_at]) * np.exp(x[each.place]) / each.value, MAX_RATIO)
        same_friction[ratio_at] = np.log(ratio / (1.0 - ratio))
    yield from (same_ratio, same_friction)


def disagreements(known: tuple[KnownStiffness, ...]) -> list[str]:
    """Sentences on stiffnesses by the recordings alone that contradict what is known beforehand."""
    return [
        f"{each.name}: the recordings alone give {each.alone:.4g} N/m "
        f"({_limit(each, -1.0):.4g} to {_limit(each, 1.0):.4g}), which contradicts {each.text}."
        for each in known
        if each.contradicted
    ]


def _limit(each: KnownStiffness, sign: float) -> float:
    """A limit of the interval [N/m] by the recordings alone."""
    return each.alone * float(np.exp(sign * TWO_SIDED * each.alone_error))
