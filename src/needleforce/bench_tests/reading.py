# SPDX-License-Identifier: Apache-2.0
"""Tension, compression and bending tests from tables: curves and readings in SI, what is assumed, and the moduli."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..core import Needle
from ..display.quantities import percent
from ..errors import InputError
from ..identification.estimates import Estimate
from ..segmentation.strokes import deepest_sample
from .bending import needle_modulus
from .law_fit import StressCurve
from .stress_fit import MAX_MISFIT, fit_stress
from .tables import QUANTITIES, BenchTable, check_names, column_of, missing, read_table, readings

STRETCHES, STRESSES = ("stretch", "true_strain", "strain", "length", "displacement"), ("stress", "true_stress", "force")
STROKE_BLOCKS = 50  # means of so many readings show whether the test is one stroke
STROKE_MARGIN = 0.02  # [of the range] a smaller return is noise of the stretch
UNIAXIAL = "uniaxial"
MODE_ASSUMED = (
    "the loading mode is uniaxial, as none was given: a curve does not show it; the same slope means half the modulus "
    "if it is equibiaxial, three quarters if it is planar"
)
ZERO_FITTED = "the zero of the force is not known exactly and is fitted"


def read_stress(
    path: str | Path,
    *,
    mode: str | None = None,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    area: float | None = None,
    gauge_length: float | None = None,
) -> tuple[StressCurve, tuple[str, ...]]:
    """Read a stress-stretch curve from a table.

    Parameters
    ----------
    path : str or path-like
        Text with a column of stretch, strain, true_strain, length or displacement, and one of stress (nominal),
        true_stress or force; with units in the headers, in brackets or under them, or without a header.
    mode : str, optional
        "uniaxial", "equibiaxial" or "planar"; default: uniaxial, with a sentence that it is assumed.
    columns : mapping, optional
        Quantity -> header, or number of the column from 1.
    units : mapping, optional
        Quantity -> unit, such as ``{"stress": "kPa"}``; a leading minus reverses the sign.
    area : float, optional
        Undeformed cross section [m^2], for force.
    gauge_length : float, optional
        Undeformed length [m], for length and displacement.

    Returns
    -------
    curve : StressCurve
    assumptions : tuple of str
        What was assumed, in sentences.

    Raises
    ------
    InputError
        For a file without such columns, a missing unit, area or length, and cells that are no numbers.
    """
    columns, units = dict(columns or {}), dict(units or {})
    check_names(columns, units, (*STRETCHES, *STRESSES))
    table = read_table(path)
    assumed = [MODE_ASSUMED] if mode is None else []
    if not table.has_header and not columns and len(table.headers) == 2:
        columns = _recognised_order(table)
        assumed.append(f"column {columns['stretch']} is the stretch and the other the stress, by their signs")
    along, stretch_column = _first_of(table, STRETCHES, columns)
    across, stress_column = _first_of(table, STRESSES, columns)
    strain, load = readings(table, {along: stretch_column, across: stress_column}, units).values()
    named = any("compress" in table.headers[column].casefold() for column in (stretch_column, stress_column))
    if named and load.sum() > 0.0:
        load = -load
        strain = -strain if along not in ("stretch", "length") and strain.sum() > 0.0 else strain
        assumed.append("strain and stress are of compression, as a header names it, and are taken as negative")
    stretch = _as_stretch(along, strain, gauge_length)
    stress = _as_stress(across, load, stretch, area)
    used = _before_rupture(_one_stroke(stretch, stress), stress)
    if len(used) < len(stretch):
        assumed.append(f"the test ends at its largest strain, or where the stress falls: {len(used)} of {len(stretch)} "
                       "readings")  # fmt: skip
    if across == "force":
        assumed.append(ZERO_FITTED)
    if along in ("strain", "true_strain") and not table.units[stretch_column] and along not in units:
        assumed.append(f"the {along.replace('_', ' ')} is a ratio, not in per cent")
    curve = StressCurve(stretch[used], stress[used], mode=mode or UNIAXIAL, name=table.file)
    return curve, (*table.notes, *assumed)


def _first_of(table: BenchTable, quantities: tuple[str, ...], columns: Mapping[str, str]) -> tuple[str, int]:
    """The first of the quantities that has a column, those given first, and the column."""
    for quantity in sorted(quantities, key=lambda name: name not in columns):
        column = column_of(table, quantity, columns)
        if column is not None:
            return quantity, column
    others = " (or " + ", ".join(quantities[1:]) + ")"
    raise missing(table, quantities[0], others)


def _recognised_order(table: BenchTable) -> dict[str, str]:
    """Which of two columns without header is the stretch: the one that is above 1 where the other is positive, below 1
    where it is negative. Raises InputError if both orders, or none, are possible."""
    first, second = table.values(0), table.values(1)

    def possible(stretch: np.ndarray, stress: np.ndarray) -> bool:
        return bool((stretch > 0.0).all() and ((stretch - 1.0) * stress >= 0.0).all() and np.ptp(stretch) > 0.0)

    orders = possible(first, second), possible(second, first)
    if orders[0] == orders[1]:
        raise missing(table, "stretch")
    return {"stretch": "1", "stress": "2"} if orders[0] else {"stretch": "2", "stress": "1"}


def _as_stretch(quantity: str, values: np.ndarray, gauge_length: float | None) -> np.ndarray:
    if quantity in ("length", "displacement"):
        if gauge_length is None:
            step = "Give --gauge-length-mm, the undeformed length."
            raise InputError("gauge length", "missing", f"a {quantity} needs it", next_step=step)
        return values / gauge_length + (quantity == "displacement")
    return {"stretch": lambda v: v, "strain": lambda v: 1.0 + v, "true_strain": np.exp}[quantity](values)


def _as_stress(quantity: str, values: np.ndarray, stretch: np.ndarray, area: float | None) -> np.ndarray:
    if quantity == "force":
        if area is None:
            step = "Give --area-mm2, the undeformed cross section."
            raise InputError("cross section", "missing", "a force needs it", next_step=step)
        return values / area
    return values / stretch if quantity == "true_stress" else values


def _one_stroke(stretch: np.ndarray, stress: np.ndarray) -> np.ndarray:
    """The readings of a test without reversal, or those up to the largest strain."""
    blocks = np.array([block.mean() for block in np.array_split(stretch, min(STROKE_BLOCKS, len(stretch)))])
    travel, span = float(np.abs(np.diff(blocks)).sum()), float(np.ptp(blocks))
    if travel <= (1.0 + 2.0 * STROKE_MARGIN) * span or len(stretch) < STROKE_BLOCKS:
        return np.arange(len(stretch))
    return np.arange(deepest_sample(np.abs(stretch - 1.0), stress) + 1)


def _before_rupture(used: np.ndarray, stress: np.ndarray) -> np.ndarray:
    """The readings up to the largest stress, if that then falls below half: the specimen tore or slipped."""
    load = np.abs(stress[used])
    ordered = load[-1] >= 0.5 * load.max() or load[0] >= 0.5 * load.max()
    return used if len(used) < STROKE_BLOCKS or ordered else used[: int(load.argmax()) + 1]


def read_bending(
    path: str | Path,
    *,
    three_point: bool = False,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
    """Read the table of a bending test.

    Parameters
    ----------
    path : str or path-like
        Text with the columns position, force and tip_deflection of a cantilever, or force and deflection.
    three_point : bool
        Whether it is a three-point test, of which the first stroke to the largest deflection is used.
    columns, units : mapping, optional
        As in ``read_stress``.

    Returns
    -------
    readings : dict of str to numpy.ndarray
        The columns (n,) in SI.
    assumptions : tuple of str

    Raises
    ------
    InputError
        For a missing column or unit, and cells that are no numbers.
    """
    columns, units = dict(columns or {}), dict(units or {})
    wanted = ("force", "deflection") if three_point else ("position", "force", "tip_deflection")
    check_names(columns, units, wanted)
    table, chosen = read_table(path), {}
    for quantity in wanted:
        column = column_of(table, quantity, columns)
        if column is None:
            dimension = QUANTITIES[quantity][0]
            raise missing(table, quantity, f"_{'mm' if dimension == 'length' else 'N'}")
        chosen[quantity] = column
    found = readings(table, chosen, units)
    notes = list(table.notes)
    if three_point:
        last = deepest_sample(np.abs(found["deflection"]), found["force"]) + 1
        if last < len(found["force"]):
            notes.append(f"the test is the part up to the largest deflection, {last} of {len(found['force'])} readings")
        found = {quantity: values[:last] for quantity, values in found.items()}
    return found, tuple(notes)


def tissue_estimate(path: str | Path, law: str | None = None, mode: str | None = None) -> Estimate:
    """``tissue_young_modulus`` [Pa] from the table of a tension or compression test, see ``read_stress`` and
    ``fit_stress``; its source states law, mode and misfit."""
    try:
        curve, assumptions = read_stress(path, mode=mode)
        found = fit_stress(curve, law=law, fit_zero=ZERO_FITTED in assumptions)
    except InputError as error:
        raise (error if Path(path).name in error.place else error.at(Path(path).name)) from None
    misfit = f"misfit {percent(found.misfit)} of the peak" + ", above 5 %" * (found.misfit > MAX_MISFIT)
    assumed = f"{UNIAXIAL} mode assumed; " if mode is None else ""
    return replace(found.young_modulus, source=f"{found.young_modulus.source}; {assumed}{misfit}")


def needle_estimate(path: str | Path, needle: Needle) -> Estimate:
    """``needle_young_modulus`` [Pa] from a table with the columns position, force and tip_deflection, units in the
    headers."""
    try:
        readings, _ = read_bending(path)
        found = needle_modulus(readings["force"], readings["position"], readings["tip_deflection"], needle)
    except InputError as error:
        raise (error if Path(path).name in error.place else error.at(Path(path).name)) from None
    limits: tuple[Any, ...] = (found.low, found.high)
    clamp = ", elastic clamp" if found.clamp_compliance else ""
    source = f"cantilever, large deflections{clamp}, {len(found.used)} readings; misfit {percent(found.misfit)}"
    return Estimate("needle_young_modulus", found.young_modulus, "Pa", *limits, source=source)


def bench_estimates(
    bending: str | Path | None, tension: str | Path | None, needle: Needle | None
) -> dict[str, Estimate]:
    """The estimates of the bench tests by name. Raises InputError for a bending test without a needle."""
    found = []
    if bending is not None:
        if needle is None:
            step = "Give needle=nf.Needle(...) or a preset's .needle."
            raise InputError("needle", "missing", "the bending test needs its section and length", next_step=step)
        found.append(needle_estimate(bending, needle))
    if tension is not None:
        found.append(tissue_estimate(tension))
    return {estimate.name: estimate for estimate in found}
