# SPDX-License-Identifier: Apache-2.0
"""Modulus of tissue from the force of a whole insertion, with the true geometry: the shaft drags the tissue."""

from collections.abc import Sequence
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
from ..elastic.tissue import Tissue, check_kinds
from ..materials import Elastic, check_labels
from ..mesh.block import graded_lines, grid
from .insertion_curve import InsertionCurve, insertion_curve
from .insertion_search import Found, InsertionSearch, StiffnessByLabel, stiffness_by_label
from .modulus_fit import modulus_estimates

MAX_HALF_WIDTH = float(np.log(10.0))  # of the logarithm of a modulus: beyond, the curve does not show it
MIN_STICKING = 3.0  # [resolutions of the depth] travel after a reversal in which the shaft sticks
MIN_REVERSAL = (
    0.33  # [of that] travel after a reversal: in less, the tip's own spring is as large a part as the shaft's
)
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
        Of each label that was found [Pa].
    parameters : Parameters
        Friction per length [N/m] and cutting force [N], for each label along the path where labels are found apart;
        ``withdrawal_ratio``, friction outwards over inwards [1]; ``force_offset`` [N]; ``contact_depth`` [m].
    half_space_modulus : float
        What the same curve gives if tissue is taken for a half-space [Pa].
    geometry_factor : float
        That over the modulus found, where one number was found: the effect of boundaries.
    condensed : CondensedTissue
        With the moduli found, for ``CondensedInsertion(found.condensed, found.model)``.
    model : Model
        Friction and cutting force found; its tip breaks through at once.
    depth, force, fitted : ndarray, shape (m,)
        Means over short travels of what was used: depth [m], measured force [N], and that of the fit [N].
    rmse, noise : float
        Of the residual [N], and the standard deviation of white noise in the means [N]: where the first is several
        times the second, the tissue does what the model does not have, and moduli are as doubtful as that.
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
        names = ("half_space_modulus", "geometry_factor", "rmse", "noise")
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
    """Find moduli, friction and cutting force so that a needle in the solid has the force of a recorded insertion.

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

    Intervals count the autocorrelation of the residual, but not the error of the mesh: moduli are up to 3 % too small
    with cells of the needle's radius, 1 % with half of it. Tissue is elastic: if a tenth of the force relaxes, the
    modulus is some 6 % too large. A spring between shaft and tissue, such as bristles, is taken for tissue.
    """
    check_kinds(tissue, path)
    _check_labels(labels, tissue)
    _check_depths(contact_depth=contact_depth, puncture_depth=puncture_depth)
    curve = insertion_curve(recording_of(recording), float(path.nodes[1]), contact_depth, puncture_depth)
    _check_path(curve, path)
    layers = _layers(tissue, path) if labels else [("", 0.0)]
    tissue, search, found = _solved(tissue, path, curve, labels, layers)
    names = tuple(labels) or tuple(tissue.materials)
    _check_determined(search, found, names)
    half_space = _half_space(tissue, path, search, found)
    young = {name: tissue.materials[name].young_modulus for name in names}
    return _result(search, found, young, layers=[name for name, _ in layers], half_space=half_space)


def _solved(tissue, path, curve, labels, layers):  # type: ignore[no-untyped-def]
    """Tissue, search and numbers; with labels the tissue is condensed again where the moduli are."""
    tops = tuple(top for _, top in layers)
    search = InsertionSearch(curve, stiffness_by_label(tissue, path, labels), tops)
    found = search.found()
    for _ in range(_TURNS if labels else 0):
        moved = found.numbers[search.moduli]
        tissue = tissue.scaled(dict(zip(labels, np.exp(moved))))
        search = InsertionSearch(curve, stiffness_by_label(tissue, path, labels), tops)
        found = search.solved(np.concatenate([np.zeros(len(moved)), found.numbers[search.moduli.stop :]]))
        if np.abs(found.numbers[search.moduli]).max() < _SETTLED:
            break
    return tissue, search, found


def _half_space(tissue: Tissue, path: NeedlePath, search: InsertionSearch, found: Found) -> float:
    """Modulus [Pa] of a half-space with the same curve."""
    first = tissue.materials[layers_along(tissue, path)[0][0]]
    solid = _unit_half_space(path.depth, path.spacing, path.radius, first.poisson_ratio)
    logarithm = np.log(first.young_modulus) + found.numbers[0]
    start = np.append(logarithm - _LOG_UNIT, found.numbers[search.moduli.stop :])
    return float(np.exp(_LOG_UNIT + replace(search, solid=solid).solved(start).numbers[0]))


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


def _check_labels(labels: Sequence[str], tissue: Tissue) -> None:
    check_labels(labels)
    unknown = [label for label in labels if label not in tissue.materials]
    if unknown:
        raise InputError("label", unknown[0], f"the mesh has {list(tissue.materials)}")


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
    half, fitted = TWO_SIDED * found.errors, search.force(found.numbers)
    places = np.minimum(np.arange(len(young)), search.moduli.stop - 1)  # one for each label, or one for all
    low, modulus, high = (
        {
            name: value * float(np.exp(found.numbers[k] + by * half[k]))
            for (name, value), k in zip(young.items(), places)
        }
        for by in (-1.0, 0.0, 1.0)
    )
    return InsertionFit(
        young_modulus=modulus,
        low=low,
        high=high,
        parameters=_parameters(search, found.numbers, half, layers),
        half_space_modulus=half_space,
        geometry_factor=half_space / next(iter(modulus.values())) if len(modulus) == 1 else float("nan"),
        condensed=search.condensed(found.numbers),
        model=search.model(found.numbers),
        depth=search.curve.depth[search.curve.used],
        force=search.measured,
        fitted=fitted,
        rmse=float(np.sqrt(np.mean((fitted - search.measured) ** 2))),
        noise=search.noise,
    )


def _parameters(search: InsertionSearch, numbers: np.ndarray, half: np.ndarray, layers: Sequence[str]) -> Parameters:
    """What was found with the moduli, by name."""
    found = []
    for k, layer in enumerate(layers):
        prefix, friction, cutting = f"{layer}_" if layer else "", search.friction.start + k, search.cutting.start + k
        found.append(_ratio(f"{prefix}friction_per_length", "N/m", numbers[friction], half[friction]))
        highest = 0.5 * float(np.ptp(search.measured))
        found.append(_force(f"{prefix}cutting_force", float(numbers[cutting]), float(half[cutting]), highest))
    found.append(_ratio("withdrawal_ratio", "1", numbers[-3], half[-3]))
    for name, unit, k in (("force_offset", "N", -2), ("contact_depth", "m", -1)):
        value, width = float(numbers[k]), float(half[k])
        found.append(Estimate(name, value, unit, value - width, value + width, source=_SOURCE))
    return Parameters({each.name: each for each in found})


def _ratio(name: str, unit: str, logarithm: float, half: float) -> Estimate:
    """What was found by its logarithm."""
    known = bool(half < MAX_HALF_WIDTH)
    ends = np.exp(logarithm + half * np.array([-1.0, 1.0])) if known else (0.0, np.inf)
    value, low, high = (float(each) for each in (np.exp(logarithm), *ends))
    return Estimate(name, value, unit, low, high, identifiable=known, source=_SOURCE)


def _force(name: str, value: float, half: float, highest: float) -> Estimate:
    """A force that cannot be negative, known within a highest half width [N]."""
    known, value = half < highest, max(value, 0.0)
    low, high = (max(value - half, 0.0), value + half) if known else (0.0, np.inf)
    return Estimate(name, value, "N", low, high, identifiable=known, source=_SOURCE)
