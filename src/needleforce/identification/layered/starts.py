# SPDX-License-Identifier: Apache-2.0
"""Starting values of a layered fit from the events: layer by layer down the insertion of one repeat, then over its
whole cycle; and those of a fit with one layer less."""

import itertools
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from .binned_cycle import MIN_BINS, BinnedCycle, at_rest
from .parameters import (
    COEFFICIENT,
    FRICTION_RATIO,
    MM,
    PER_LAYER,
    RESTING_SURFACE,
    RUPTURE_LENGTH,
    SATURATION,
    TISSUE_STIFFNESS,
    TOP,
    LayeredParameters,
    logistic,
)
from .problem import Problem

TISSUE_START = (0.0, 0.0, 0.0, 0.2, 5.5, -7.8, 2.0)
"""Friction ratio, stiffness of 250 N/m, rupture within 0.4 mm, resting surface at 2 mm; the force sets the contact."""
WEAK_LAYER = (7.6, -6.9, 0.0, 0.0, 4.6, -7.6, 1.0)
"""A layer to be added: c = 2 kN/m^2, h_s = 1 mm, k_t = 100 N/m."""
COMMON_START = (0.2, 0.0, 0.0, 0.0, 0.0, 0.0)
"""Without a hold half of the force relaxes, half of that with the shorter time; forces do not depend on speed, friction
is the same in both directions; the time constants are those of the hold."""
BEYOND_DEEPEST_MM = 1.0  # [mm] below the deepest point: puncture of a layer that does not rupture
MIN_DISTANCE_MM = 1.0  # [mm] between the punctures of different layers
N_ADDED_TOPS = 4  # starts of a further layer's top
KINK_MM, KINK_STEP_MM = 0.5, 0.1  # [mm] of the slope above and below a rupture without a drop, and between two of them
SCATTER = 0.2  # [of the indentation] of a rupture between repeats, at most
BEFORE_PUNCTURE_MM = 0.1  # [mm] above the peak, where the fall has not begun
TOP_SHARES = (-0.3, 0.05, 0.4)  # [of the distance between two punctures] starts of a layer's top below the upper one
FRICTION_RATIOS, RESTING_SURFACES_MM = (-3.0, -2.0, -1.0, 0.0, 1.0), (0.5, 2.0)
"""Starts of a layer after its rupture: from a friction that holds next to nothing to one that hides the rupture."""
SPRINGS = np.log(np.geomspace(60.0, 800.0, 6))  # [N/m] starts of the springs, which only a reversal shows
MAX_SLOPE_SHARE = 0.45  # [of the spring] the friction's share of it beyond which there is no start
MAX_SHARE = 0.95  # of relaxation in a start
STAGE_STEPS = 25  # of a descent over a part of the insertion
N_KEPT, N_STARTS = 4, 10  # best fits of a part from which the next one starts, and starts of the search
APART = 0.02  # relative difference of cost, below which two fits are the same


def first_starts(problem: Problem, mapped: Callable) -> Iterator[np.ndarray]:
    """Starting vectors from the punctures of segmentation.

    A search over the complete cycle ends where the friction of a layer hides its rupture, or where springs exchange
    their parts, if it starts with typical values. The insertion down to the next puncture depends on the layers above
    it only: each of them is found there, from several frictions, surfaces and tops, with the relaxation that the hold
    shows; the springs, of which the insertion shows little, by the whole cycle. One repeat is enough for a start.

    Parameters
    ----------
    problem : Problem
        All repeats; those of their punctures are taken that fall most.
    mapped : callable
        ``mapped(work, items)`` does the work on each of the items.
    """
    for punctures in punctures_of_layers(problem.cycles, problem.unknowns.layers):
        yield from _down_the_depth(problem, punctures, mapped)


def _down_the_depth(problem: Problem, punctures: np.ndarray, mapped: Callable) -> Iterator[np.ndarray]:
    """Starting vectors for punctures (runs, layers) [mm] of the layers."""
    run = _clearest(problem.cycles, punctures)
    one = replace(problem, cycles=(problem.cycles[run],), unknowns=replace(problem.unknowns, runs=1))
    found = [_first(one, punctures[run])]
    for layer in range(problem.unknowns.layers + 1):
        if layer and punctures[run, layer - 1] > problem.cycles[run].deepest / MM:
            break
        part = _down_to(one, layer, punctures[run])
        starts = [each for x in found for each in _of_a_layer(one, x, layer)]
        solved = mapped(lambda x: part.solve(x, STAGE_STEPS), starts)  # noqa: B023
        found = _distinct(solved, N_KEPT)
    springs = mapped(lambda x: (x, one.cost(x)), [each for x in found for each in _springs(one.unknowns, x)])
    for x in _distinct(springs, N_STARTS):
        yield np.concatenate([x[: problem.unknowns.shared], punctures.ravel()])


def punctures_of_layers(cycles: tuple[BinnedCycle, ...], layers: int) -> list[np.ndarray]:
    """Depths (runs, layers) [mm] at which the layers may rupture: at those punctures of segmentation that fall most
    over all runs, in the order of depth, with the median for a run without one. Where there are fewer than layers, the
    others rupture below the deepest point, or where the slope falls most."""
    segmented = _by_depth(cycles, [[(each.depth / MM, each.drop) for each in cycle.punctures] for cycle in cycles])
    segmented = segmented[:layers]
    beyond = np.full(len(cycles), max(cycle.deepest for cycle in cycles) / MM + BEYOND_DEEPEST_MM)
    missing = layers - len(segmented)
    found = [[*segmented, *[beyond] * missing]]
    if missing:
        falls = _by_depth(cycles, [_falls_of_slope(cycle) for cycle in cycles])
        away = [each for each in falls if all(np.abs(each - one).min() > MIN_DISTANCE_MM for one in segmented)]
        if away:
            found.append([*segmented, *away[:missing], *[beyond] * (missing - len(away))])
    return [np.sort(np.column_stack(each), axis=1) for each in found]


def _by_depth(cycles: tuple[BinnedCycle, ...], runs: list[list[tuple[float, float]]]) -> list[np.ndarray]:
    """Places that runs have in common, by depth [mm] and size in each run: depths (runs,) [mm] of each, with the median
    for a run without it, the largest first by the sum over the runs."""
    contact = float(np.median([cycle.contact for cycle in cycles])) / MM
    groups = [[place] for place in sorted((depth, run, size) for run, own in enumerate(runs) for depth, size in own)]
    while (nearest := _nearest(groups, contact)) is not None:
        groups[nearest] += groups.pop(nearest + 1)
    found = []
    for group in sorted(groups, key=lambda group: -sum(size for *_, size in group)):
        own = np.full(len(runs), np.median([depth for depth, *_ in group]))
        for depth, run, _ in group:
            own[run] = depth
        found.append(own)
    return found


def _nearest(groups: list[list], contact: float) -> int | None:
    """The group of places of different runs that is nearest to the one below it, if both may be the same rupture."""
    found = []
    for k, (upper, lower) in enumerate(itertools.pairwise(groups)):
        span = lower[-1][0] - upper[0][0]
        reach = max(MIN_DISTANCE_MM, SCATTER * (upper[0][0] - contact))
        if span < reach and not {run for _, run, _ in upper} & {run for _, run, _ in lower}:
            found.append((span, k))
    return min(found)[1] if found else None


def _falls_of_slope(cycle: BinnedCycle) -> list[tuple[float, float]]:
    """Depths [mm] of the insertion at which the slope of the force falls more than nearby, and by how much [N/mm]: a
    rupture without a drop."""
    inwards = cycle.stroke == 0
    depth = np.arange(cycle.contact / MM, cycle.depth[inwards].max() / MM, KINK_STEP_MM)
    force = np.interp(depth, cycle.depth[inwards] / MM, cycle.force[inwards])
    reach = round(KINK_MM / KINK_STEP_MM)
    place = np.arange(reach + 1) - 0.5 * reach
    if len(force) < 4 * reach:
        return []
    slope = np.correlate(force, place / (place @ place) / KINK_STEP_MM)
    fall = slope[:-reach] - slope[reach:]
    peaks = [
        k
        for k in range(len(fall))
        if fall[k] > 0.0 and fall[k] == fall[max(k - 2 * reach, 0) : k + 2 * reach + 1].max()
    ]
    return [(float(depth[k + reach]), float(fall[k])) for k in peaks]


def _clearest(cycles: tuple[BinnedCycle, ...], punctures: np.ndarray) -> int:
    """The run that shows most of the punctures, and of those the one that is nearest to the medians."""
    shown = [sum(any(each.depth / MM == depth for each in cycle.punctures) for depth in own)
             for cycle, own in zip(cycles, punctures)]  # fmt: skip
    away = np.abs(punctures - np.median(punctures, axis=0)).sum(axis=1)
    return min(range(len(cycles)), key=lambda run: (-shown[run], away[run]))


def _first(one: Problem, punctures: np.ndarray) -> np.ndarray:
    """The vector of typical layers, each below the puncture of the one above, with the relaxation of the hold."""
    cycle, unknowns = one.cycles[0], one.unknowns
    x = _start(one.cycles, [cycle.contact / MM, *punctures[:-1]], punctures[None])
    if unknowns.relaxing not in unknowns.held and at_rest(cycle).sum() >= MIN_BINS:
        x[unknowns.relaxing : unknowns.relaxing + 2] = _shares(cycle, unknowns.times)
    return x


def _shares(cycle: BinnedCycle, times: tuple[float, float]) -> tuple[float, float]:
    """The logits of the share of the force that relaxes in the hold, and of its part with the shorter time."""
    from scipy.optimize import nnls

    here = at_rest(cycle)
    since, weight = np.cumsum(cycle.dt)[here], np.sqrt(cycle.count[here])
    decay = np.exp(-(since - since[0])[:, None] / np.array([np.inf, *times]))
    level, short, long = nnls(decay * weight[:, None], cycle.force[here] * weight)[0]
    relaxing = np.clip((short + long) / max(level + short + long, 1e-12), 1.0 - MAX_SHARE, MAX_SHARE)
    part = np.clip(short / max(short + long, 1e-12), 1.0 - MAX_SHARE, MAX_SHARE)
    return float(np.log(relaxing / (1.0 - relaxing))), float(np.log(part / (1.0 - part)))


def _down_to(one: Problem, layer: int, punctures: np.ndarray) -> Problem:
    """The insertion down to the puncture of a layer, or to its end; with the contact of this layer to be found, and all
    of those above it, but not the relaxation."""
    cycle, unknowns = one.cycles[0], one.unknowns
    end = punctures[layer] - BEFORE_PUNCTURE_MM if layer < unknowns.layers else np.inf
    used = (cycle.stroke == 0) & (cycle.depth / MM < end)
    used[:MIN_BINS] = True
    parts = {name: getattr(cycle, name)[used] for name in ("depth", "force", "dt", "count", "stroke")}
    after = (FRICTION_RATIO, TISSUE_STIFFNESS, RUPTURE_LENGTH, RESTING_SURFACE)
    held = {PER_LAYER * below + place for below in range(layer, unknowns.layers) for place in after}
    held |= set(range(PER_LAYER * (layer + 1), unknowns.relaxing))
    held |= {*range(unknowns.relaxing, unknowns.shared), *range(unknowns.shared + layer, unknowns.size)}
    own = replace(unknowns, held=unknowns.held | held)
    return replace(one, cycles=(replace(cycle, **parts),), unknowns=own, limits=one.bounds)


def _of_a_layer(one: Problem, x: np.ndarray, layer: int) -> Iterator[np.ndarray]:
    """Starts of the part of the insertion that ends at the puncture of a layer: what follows the puncture above it, and
    its own top."""
    if layer == 0:
        yield x
        return
    above, own, last = PER_LAYER * (layer - 1), PER_LAYER * layer, layer == one.unknowns.layers
    upper, lower = (x[TOP], x[TOP]) if last else one.unknowns.punctures(x)[0, layer - 1 : layer + 1]
    reached = min(lower, one.cycles[0].deepest / MM) - upper
    for ratio, surface in itertools.product(FRICTION_RATIOS, RESTING_SURFACES_MM):
        tried = x.copy()
        tried[above + FRICTION_RATIO], tried[above + RESTING_SURFACE] = ratio, surface
        if last:
            yield tried
            continue
        for share in TOP_SHARES:
            placed = tried.copy()
            placed[own + TOP] = max(x[TOP], upper + share * reached)
            contact = _contact(0.4 * one.cycles[0].peak, lower - placed[own + TOP])
            placed[own + COEFFICIENT], placed[own + SATURATION] = contact
            yield placed


def _springs(unknowns: LayeredParameters, x: np.ndarray) -> Iterator[np.ndarray]:
    """The vector with other springs and the same force while sliding inwards, f' / (1 + f' / k_t) per length."""
    own = x[: unknowns.relaxing].reshape(unknowns.layers, PER_LAYER)
    share = logistic(own[:, FRICTION_RATIO])
    slope = np.exp(own[:, TISSUE_STIFFNESS]) * share / (1.0 + share)
    for springs in itertools.product(SPRINGS, repeat=unknowns.layers):
        part = np.minimum(slope / np.exp(springs), MAX_SLOPE_SHARE)
        own[:, TISSUE_STIFFNESS], own[:, FRICTION_RATIO] = springs, np.log(part / (1.0 - 2.0 * part))
        yield x.copy()


def _distinct(found: Iterator[tuple[np.ndarray, float]], count: int) -> list[np.ndarray]:
    """The best vectors, at most ``count``, with costs that differ."""
    kept: list[tuple[np.ndarray, float]] = []
    for x, cost in sorted(found, key=lambda each: each[1]):
        if not kept or cost > (1.0 + APART) * kept[-1][1]:
            kept.append((x, cost))
        if len(kept) == count:
            break
    return [x for x, _ in kept]


def grown_starts(cycles: tuple[BinnedCycle, ...], before: LayeredParameters, x: np.ndarray) -> Iterator[np.ndarray]:
    """The vector ``x`` of a fit with one layer less, with a weak layer added at several depths, with or without a
    rupture."""
    shared, common = x[: before.relaxing], x[before.relaxing : before.shared]
    deepest = np.median([cycle.deepest for cycle in cycles]) / MM
    highest = shared[TOP::PER_LAYER].min()
    for top in np.linspace(highest + 1.0, deepest - 3.0, N_ADDED_TOPS):
        last = deepest + BEYOND_DEEPEST_MM
        for puncture in sorted({round(last, 1), round(min(top + 3.0, last), 1)}):
            added = np.array(WEAK_LAYER)
            added[TOP] = top
            own = np.column_stack([before.punctures(x), np.full(before.runs, puncture)])
            yield np.concatenate([shared, added, common, own.ravel()])
    # and one that weighs next to nothing, so that one layer more never fits worse
    added = np.array(WEAK_LAYER)
    added[[COEFFICIENT, TISSUE_STIFFNESS, TOP]] = 0.0, 0.0, 0.5 * (highest + deepest)
    own = np.column_stack([before.punctures(x), np.full(before.runs, deepest + BEYOND_DEEPEST_MM)])
    yield np.concatenate([shared, added, common, own.ravel()])


def typical_starts(cycles: tuple[BinnedCycle, ...], unknowns: LayeredParameters) -> Iterator[np.ndarray]:
    """Starting vectors for one or two layers."""
    contact = np.median([cycle.contact for cycle in cycles]) / MM
    deepest = np.median([cycle.deepest for cycle in cycles]) / MM
    first = _first_punctures(cycles, 0.0, deepest + BEYOND_DEEPEST_MM)
    if unknowns.layers == 1:
        yield _start(cycles, [contact], first[:, None])
        return
    middle = float(np.median(first))
    without_rupture = np.full(len(cycles), deepest + BEYOND_DEEPEST_MM)
    found = _first_punctures(cycles, middle + 1.0, 0.5 * (middle + deepest))
    for share in (0.35, 0.7, 1.0):
        for second in (found, without_rupture):
            top = min(contact + share * (middle - contact), float(np.median(second)) - 1.0)
            yield _start(cycles, [contact, top], np.column_stack([first, second]))


def _start(cycles: tuple[BinnedCycle, ...], tops: list[float], punctures: np.ndarray) -> np.ndarray:
    """The vector of typical tissue layers with ``tops`` [mm] that rupture at ``punctures`` (runs, layers) [mm]."""
    peak = np.median([cycle.peak for cycle in cycles])
    parts = []
    for layer, top in enumerate(tops):
        part = np.array(TISSUE_START)
        indentation = float(np.median(punctures[:, layer])) - top
        part[COEFFICIENT], part[SATURATION] = _contact(peak * (0.8 if layer == 0 else 0.4), indentation)
        part[TOP] = top
        part[TISSUE_STIFFNESS] += np.log(peak / 5.0)  # in proportion to the stiffness of the contact
        parts.append(part)
    return np.concatenate([*parts, COMMON_START, punctures.ravel()])


def _contact(force: float, indentation: float) -> tuple[float, float]:
    """Logarithms of coefficient and saturation depth of a contact with a force [N] at an indentation [mm], saturated
    half the way."""
    reached = max(indentation, 0.5) * MM
    saturation = min(6e-3, 0.5 * reached)
    return float(np.log(force / (saturation * (2.0 * reached - saturation)))), float(np.log(saturation))


def _first_punctures(cycles: tuple[BinnedCycle, ...], above: float, otherwise: float) -> np.ndarray:
    """Each run's first puncture deeper than ``above`` [mm]; the median for a run without one, ``otherwise`` if no run
    has one."""
    found = [[one.depth / MM for one in cycle.punctures if one.depth / MM > above] for cycle in cycles]
    known = [depths[0] for depths in found if depths]
    middle = float(np.median(known)) if known else otherwise
    return np.array([depths[0] if depths else middle for depths in found])
