# SPDX-License-Identifier: Apache-2.0
"""Modulus and relaxation of tissue from the force of a whole insertion, with the true geometry: the shaft drags it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np

from ...checks import finite_number
from ...display.axes import DEPTH, FORCE
from ...display.canvas import MEASURED, MODEL
from ...display.quantities import plain
from ...errors import InputError
from ...identification.estimates import Estimate, EstimateResult, Parameters
from ...identification.statistics.noise import TWO_SIDED
from ...models.model import Model
from ...recording.source import RecordingSource, recording_of
from ..elastic.condensed import CondensedTissue
from ..elastic.needle_path import NeedlePath, layers_along
from ..elastic.shaft_stiffness import StiffnessByLabel, stiffness_by_label
from ..elastic.tissue import Tissue, check_kinds
from ..materials import Elastic, check_labels
from ..mesh.block import graded_lines, grid
from .insertion_curve import InsertionCurve, insertion_curve
from .insertion_search import (
    Found,
    InsertionSearch,
    Solutions,
    branches,
    solutions,
)
from .modulus_fit import modulus_estimates

MAX_HALF_WIDTH = float(np.log(10.0))  # of the logarithm of a modulus: beyond, the curve does not show it
MIN_STICKING = 3.0  # [resolutions of the depth] travel after a reversal in which the shaft sticks
MIN_REVERSAL = 0.33  # [of that] travel after a reversal: in less, the tip's own spring is as large as the shaft's
MAX_CHANGE = 0.05  # of the logarithm of a modulus with the spacing
_WIDEST_SHARE = 0.5  # share that relaxes: a curve that allows more without a sign of it does not show any
_LARGE = 10.0  # depth and radius of a block that stands for a half-space, in lengths of the path
_SOURCE = "insertion into the solid"
_LOG_UNIT = float(np.log(20e3))  # of its modulus [Pa] before the search
_TURNS, _SETTLED = 6, 5e-3  # of condensing, where labels have moduli of their own; change of a modulus that ends them


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class InsertionFit(EstimateResult):
    """Moduli found from an insertion, with 95 % intervals, and what was found with them.

    Attributes
    ----------
    young_modulus, low, high : dict of str to float
        Of each label that was found, at once, before anything relaxes [Pa].
    parameters : Parameters
        Friction per length [N/m] and cutting force [N], for each label along the path where labels are found apart;
        ``withdrawal_ratio``, friction outwards over inwards [1]; ``force_offset`` [N]; ``contact_depth`` [m].
        ``relaxation_share_1``, not identifiable where the motion shows none, ``relaxation_time_1`` [s] and a second
        branch where it does; ``presliding`` [m] where the force shows a spring at the shaft, whose ratio is 1.
    half_space_modulus : float
        What the same curve gives if tissue is taken for a half-space [Pa].
    geometry_factor : float
        That over the modulus found, where one number was found: the effect of boundaries.
    condensed : CondensedTissue
        With the moduli found, for ``CondensedInsertion(found.condensed, found.model)``.
    model : Model
        Friction, cutting force and relaxation found; its tip breaks through at once.
    depth, force, fitted : ndarray, shape (m,)
        Means over short travels of what was used: depth [m], measured force [N], and that of the fit [N].
    rmse, noise : float
        Of the residual [N], and the standard deviation of white noise in the means [N].
    warnings : tuple of str
        A misfit beyond the noise with the place where it is largest, a spacing that is too wide, other moduli that fit
        as well. Intervals hold all three, but a misfit only as far as parts of the curve disagree.
    """

    young_modulus: dict[str, float]
    low: dict[str, float]
    high: dict[str, float]
    parameters: Parameters
    half_space_modulus: float
    geometry_factor: float
    condensed: CondensedTissue = field(repr=False)
    model: Model = field(repr=False)
    depth: np.ndarray = field(repr=False)
    force: np.ndarray = field(repr=False)
    fitted: np.ndarray = field(repr=False)
    rmse: float
    noise: float
    warnings: tuple[str, ...] = ()

    @property
    def estimates(self) -> tuple[Estimate, ...]:
        """The moduli of the labels [Pa], and ``parameters``."""
        return (*modulus_estimates(self.young_modulus, self.low, self.high), *self.parameters.values())

    def _heading(self) -> str:
        return f"InsertionFit: residual {plain(self.rmse, 'N')} rms, noise {plain(self.noise, 'N')}"

    def _draw(self, axes: Any) -> tuple[str, ...]:
        """Measured and fitted force over depth."""
        axes.plot(1e3 * self.depth, self.force, color=MEASURED, lw=0.8, label="measured")
        axes.plot(1e3 * self.depth, self.fitted, color=MODEL, lw=1.2, label="fitted")
        return DEPTH, FORCE

    def document(self) -> dict:
        """The numbers for JSON."""
        names = ("half_space_modulus", "geometry_factor", "rmse", "noise", "warnings")
        return super().document() | {name: getattr(self, name) for name in names}


def fit_insertion(
    tissue: Tissue,
    path: NeedlePath,
    recording: RecordingSource,
    *,
    labels: Sequence[str] = (),
    contact_depth: float | None = None,
    puncture_depth: float | None = None,
) -> InsertionFit:
    """Find moduli, friction, cutting force and relaxation so that a needle in the solid has a recorded force.

    Parameters
    ----------
    tissue : Tissue
        Geometry, supports and Poisson ratios; its moduli are where the search begins, within a factor of 100.
    path : NeedlePath
        Of the needle, with its radius, as long as the needle is deep or longer.
    recording : Recording, path, DataFrame, mapping or (time, depth, force)
        An insertion with a reversal [s], [m], [N]: its withdrawal, or some millimetres back on the way.
    labels : sequence of str, optional
        Labels whose moduli are found apart, the others keep theirs; by default all are scaled together. Friction and
        cutting force are then found apart too, for each label along the path.
    contact_depth, puncture_depth : float, optional
        Where the needle meets the surface and breaks through [m], in the zero of the recording; by default those of
        ``nf.segment``. The search of the contact begins there.

    Returns
    -------
    InsertionFit

    Raises
    ------
    InputError
        If the recording has no contact or no reversal in the tissue, the path is too short, a label is unknown, the
        tissue is too stiff for the resolution of the depth, or a modulus is not determined within a factor of 10.

    Notes
    -----
    Least squares on the force of ``CondensedInsertion`` along means over short travels: the free travel, and all that
    follows the breakthrough by a quarter of the indentation, or without one from a quarter of the deepest on. The
    modulus is in the slope and the rounding after a reversal, where the shaft sticks; the force of a needle that only
    slides hardly depends on it. Force offset, depth of contact and friction outwards are found too, so that a force
    that is constantly too large or too small in one direction is not taken for dragged tissue. The contact before the
    breakthrough is ``fit_modulus``'s.

    A branch that relaxes is kept where it lessens the sum of squares by 12 variances of the noise, or the force changes
    in a rest, with a share above 0; a spring between shaft and tissue where it lessens it as much.

    Intervals count the autocorrelation of the residual and how parts of the curve disagree, every solution of several
    starts that fits as well, or half as badly again where none fits, and what is found along half the spacing with
    cells of half the size (in space: the same cells), and as much again beyond, as these errors fall at least in
    proportion to the size. What a curve does not show is not in them: a tenth of the force that relaxes makes the
    modulus some 6 % too large.
    """
    check_kinds(tissue, path)
    check_labels(labels, tissue.materials)
    _check_depths(contact_depth=contact_depth, puncture_depth=puncture_depth)
    curve = insertion_curve(recording_of(recording), float(path.nodes[1]), contact_depth, puncture_depth)
    _check_path(curve, path)
    layers = _layers(tissue, path) if labels else [("", 0.0)]
    search = InsertionSearch(curve, stiffness_by_label(tissue, path, labels), tuple(top for _, top in layers))
    levels = [_solved(tissue, path, labels, search, search.optima())]  # elastic, then with what the force shows
    while more := levels[-1][1].extended(levels[-1][2][0]):
        levels.append(_solved(levels[-1][0], path, labels, *more))
    for tissue, search, optima in reversed(levels):
        found = solutions(search, optima, tissue, path, labels)
        if np.all(found.low[search.relaxation][::2] > 0.0) or search.branches == search.falls == 1:
            break
    names = tuple(labels) or tuple(tissue.materials)
    _check_determined(search, optima[0], names)
    half_space = _half_space(tissue, path, search, optima[0])
    young = {name: tissue.materials[name].young_modulus for name in names}
    return _result(search, found, young, layers=[name for name, _ in layers], half_space=half_space)


def _solved(tissue, path, labels, search, optima):  # type: ignore[no-untyped-def]
    """Tissue, search and where searches end; with labels the tissue is condensed again where the best moduli are."""
    for _ in range(_TURNS if labels else 0):
        found, moved = optima[0], optima[0].numbers[search.moduli]
        tissue = tissue.scaled(dict(zip(labels, np.exp(moved))))
        search = replace(search, solid=stiffness_by_label(tissue, path, labels))
        start = np.concatenate([np.zeros(len(moved)), found.numbers[search.moduli.stop :]])
        others = [replace(each, numbers=each.numbers + start - found.numbers) for each in optima[1:]]
        optima = [search.polished(start), *others]
        if np.abs(optima[0].numbers[search.moduli]).max() < _SETTLED:
            break
    return tissue, search, optima


def _half_space(tissue: Tissue, path: NeedlePath, search: InsertionSearch, found: Found) -> float:
    """Modulus [Pa] of a half-space with the same curve."""
    first = tissue.materials[layers_along(tissue, path)[0][0]]
    solid = _unit_half_space(path.depth, path.spacing, path.radius, first.poisson_ratio)
    logarithm = np.log(first.young_modulus) + found.numbers[0]
    start = np.append(logarithm - _LOG_UNIT, found.numbers[search.moduli.stop :])
    return float(np.exp(_LOG_UNIT + replace(search, solid=solid).polished(start).numbers[0]))


@lru_cache(maxsize=16)
def _unit_half_space(depth: float, spacing: float, radius: float, poisson_ratio: float) -> StiffnessByLabel:
    size, across, along = _LARGE * depth, 0.5 * radius, max(0.5 * radius, 0.5 * spacing)
    radii = graded_lines([0.0, size], lambda r: across + 0.25 * np.maximum(r - across, 0.0))
    depths = graded_lines([0.0, depth, size], lambda z: along + 0.25 * np.maximum(z - depth - along, 0.0))
    mesh = grid([radii, depths])
    block = Tissue(mesh, Elastic(float(np.exp(_LOG_UNIT)), poisson_ratio), symmetry="axisymmetric")
    return stiffness_by_label(block, NeedlePath(depth, spacing, radius), ())


def _layers(tissue: Tissue, path: NeedlePath) -> list[tuple[str, float]]:
    """Labels along the path and the distances at which they begin [m]; one that comes again has a number."""
    layers = layers_along(tissue, path)
    names = [name for name, _ in layers]
    again = [f"_{names[:k].count(name) + 1}" if name in names[:k] else "" for k, name in enumerate(names)]
    return [(name + number, top) for (name, top), number in zip(layers, again)]


def _check_depths(**depths: float | None) -> None:
    for name, value in depths.items():
        if value is not None:
            finite_number(name, value, "Give it in m.")
    contact, puncture = depths["contact_depth"], depths["puncture_depth"]
    if contact is not None and puncture is not None and puncture < contact:
        limit = f"must not be above the contact at {1e3 * contact:.4g} mm"
        raise InputError("puncture_depth", f"{1e3 * puncture:.4g} mm", limit, next_step="Both are in m, + inwards.")


def _check_path(curve: InsertionCurve, path: NeedlePath) -> None:
    deepest = float(curve.depth.max()) - curve.contact_depth
    if deepest > path.depth:
        limit = f"the needle goes {1e3 * deepest:.4g} mm deep"
        step = f"Give a path of {1e3 * deepest:.4g} mm or more, in a mesh that is deeper."
        raise InputError("depth of the path", f"{1e3 * path.depth:.4g} mm", limit, next_step=step)


def _check_determined(search: InsertionSearch, found: Found, names: Sequence[str]) -> None:
    """Raise InputError for a modulus that the curve does not show."""
    sticks, resolution = search.sticking(found.numbers), search.curve.resolution
    if sticks < MIN_STICKING * resolution:
        limit = f"the depth resolves {1e6 * resolution:.3g} um: tissue is too stiff to show its modulus"
        step = "Record slower, or with a better measurement of depth."
        raise InputError("travel in which the shaft sticks", f"{1e6 * sticks:.3g} um", limit, next_step=step)
    if search.curve.reversal < MIN_REVERSAL * sticks:
        limit = f"the shaft sticks for {1e3 * sticks:.3g} mm: the modulus would depend on how the tip unloads"
        step = f"Pull back by {1e3 * MIN_REVERSAL * sticks:.2g} mm or more."
        raise InputError("longest reversal", f"{1e3 * search.curve.reversal:.3g} mm", limit, next_step=step)
    half = TWO_SIDED * found.errors[search.moduli]
    worst = int(half.argmax())
    if not half[worst] < MAX_HALF_WIDTH:
        step = "Record a reversal that is longer, or keep this label's modulus."
        limit = "the force does not determine it within a factor of 10"
        raise InputError(f"modulus of {names[worst]!r}", "lost in the noise", limit, next_step=step)


def _result(search, found, young, *, layers, half_space):  # type: ignore[no-untyped-def]
    """The fit, for moduli ``young`` [Pa] of the tissue that was condensed last."""
    best = found.as_good[0]
    places = np.minimum(np.arange(len(young)), search.moduli.stop - 1)  # one for each label, or one for all
    low, modulus, high = (
        {name: value * float(np.exp(numbers[k])) for (name, value), k in zip(young.items(), places)}
        for numbers in (found.low, best.numbers, found.high)
    )
    fitted = search.force(best.numbers)
    return InsertionFit(
        young_modulus=modulus,
        low=low,
        high=high,
        parameters=_parameters(search, found, layers),
        half_space_modulus=half_space,
        geometry_factor=half_space / next(iter(modulus.values())) if len(modulus) == 1 else float("nan"),
        condensed=search.condensed(best.numbers),
        model=search.model(best.numbers),
        depth=search.curve.depth[search.curve.used],
        force=search.measured,
        fitted=fitted,
        rmse=float(np.sqrt(np.mean((fitted - search.measured) ** 2))),
        noise=search.noise,
        warnings=tuple(_warnings(search, found, young)),
    )


def _warnings(search: InsertionSearch, found: Solutions, young: dict[str, float]) -> Iterator[str]:
    """What of the fit is not as the noise would have it."""
    best = found.as_good[0]
    finer = f"Give a path with a spacing of {1e3 * search.solid.condensed.spacing * 0.5:.3g} mm or less."
    if leaves := search.misfit(best):
        wrong = search.misfit(found.other)
        yield f"{leaves}: {'there the tissue does what this model has not.' if wrong else finer}"
    for k, (name, value) in zip(range(search.moduli.stop), young.items()):
        here, there, *others = value * np.exp([each.numbers[k] for each in (best, found.other, *found.as_good)])
        if abs(np.log(there / here)) > MAX_CHANGE:
            along = f"{plain(there, 'Pa')} along a path of half the spacing"
            yield f"The modulus of {name!r} is {plain(here, 'Pa')}, and {along}: the interval holds both. {finer}"
        if np.ptp(np.log(others)) > TWO_SIDED * best.errors[k]:
            between = f"{plain(min(others), 'Pa')} to {plain(max(others), 'Pa')}"
            yield f"Several solutions fit as well, with a modulus of {name!r} from {between}: the interval holds them."


def _parameters(search: InsertionSearch, solved: Solutions, layers: Sequence[str]) -> Parameters:
    """What was found with the moduli, by name."""
    numbers, low, high, found = solved.as_good[0].numbers, solved.low, solved.high, []
    for k, layer in enumerate(layers):
        prefix, friction, cutting = f"{layer}_" if layer else "", search.friction.start + k, search.cutting.start + k
        found.append(_ratio(f"{prefix}friction_per_length", "N/m", numbers[friction], low[friction], high[friction]))
        ends, known = (
            (numbers[cutting], low[cutting], high[cutting]),
            high[cutting] - low[cutting] < np.ptp(search.measured),
        )
        found.append(_estimate(f"{prefix}cutting_force", "N", *ends, known=known))
    found += _more(search, solved)
    ratio = (0.0, 0.0, 0.0) if search.sprung else (numbers[-3], low[-3], high[-3])
    found.append(replace(_ratio("withdrawal_ratio", "1", *ratio), identifiable=not search.sprung))
    for name, unit, k in (("force_offset", "N", -2), ("contact_depth", "m", -1)):
        found.append(Estimate(name, float(numbers[k]), unit, float(low[k]), float(high[k]), source=_SOURCE))
    return Parameters({each.name: each for each in found})


def _more(search: InsertionSearch, solved: Solutions) -> Iterator[Estimate]:
    """Share and time constant of each branch, or what share there may be without a sign of it; travel of a spring."""
    start, best = search.relaxation.start, solved.as_good[0]
    ends = best.numbers, solved.low, solved.high
    if not search.branches:
        highest = max(0.0, *(part + TWO_SIDED * error for part, error, _ in search.branch(best)[1]))
        yield _estimate("relaxation_share_1", "1", 0.0, 0.0, highest, known=highest < _WIDEST_SHARE)
    for name, (place, left) in enumerate(branches(best.numbers[search.relaxation]), 1):
        share, low, high = (left * float(each[start + place]) for each in ends)
        yield _estimate(f"relaxation_share_{name}", "1", share, low, min(high, 1.0), known=high - low < _WIDEST_SHARE)
        yield _ratio(f"relaxation_time_{name}", "s", *(each[start + place + 1] for each in ends))
    if search.sprung:
        yield _ratio("presliding", "m", *(each[search.relaxation.stop] for each in ends))


def _ratio(name: str, unit: str, logarithm: float, low: float, high: float) -> Estimate:
    """What was found by its logarithm."""
    return _estimate(name, unit, *np.exp([logarithm, low, high]), known=high - low < 2.0 * MAX_HALF_WIDTH)


def _estimate(name: str, unit: str, value: float, low: float, high: float, *, known: bool) -> Estimate:
    """Of what cannot be negative."""
    ends = (max(float(low), 0.0), float(high)) if known else (0.0, np.inf)
    return Estimate(name, max(float(value), 0.0), unit, *ends, identifiable=bool(known), source=_SOURCE)
