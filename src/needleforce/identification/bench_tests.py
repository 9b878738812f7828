# SPDX-License-Identifier: Apache-2.0
"""The paper's two bench tests from small CSV tables: bending of the needle, tension of the tissue."""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..core import Needle
from ..errors import InputError
from ..files import read_text
from ..units import find
from .estimates import Estimate
from .statistics.regression import least_squares

_STRESS = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "N/mm^2": 1e6}
_MAX_READINGS, _MAX_COLUMNS, _MAX_MAGNITUDE = 10_000, 100, 1e30
SMALL_DEFLECTION = 0.3  # [1] F a^2 / (E I), twice the end slope; beyond, the linear formula overestimates deflection
# law -> the columns whose weighted sum is the nominal stress, and the weights by which the coefficients give E
_BASES = {
    "linear": (lambda s: [s - 1.0], (1.0,)),
    "neo_hookean": (lambda s: [s - s**-2], (3.0,)),
    "mooney": (lambda s: [2.0 * (s - s**-2), 2.0 * (s - s**-2) / s], (6.0, 6.0)),
    "yeoh": (lambda s: [2.0 * (s - s**-2) * k * (s**2 + 2.0 / s - 3.0) ** (k - 1) for k in (1, 2, 3)], (6.0, 0.0, 0.0)),
}
LAWS = tuple(_BASES)


def needle_estimate(path: str | Path, needle: Needle) -> Estimate:
    """``needle_young_modulus`` [Pa] from a table with the columns position, force and tip_deflection, units in the
    headers."""
    table = _table(path, {"position": "length", "force": "force", "tip_deflection": "length"})
    try:
        found = needle_modulus(table["force"], table["position"], table["tip_deflection"], needle)
    except InputError as error:
        raise error.at(Path(path).name) from None
    source = f"cantilever, {int(found.used.sum())} of {len(found.used)} readings within small deflections"
    return Estimate("needle_young_modulus", found.young_modulus, "Pa", found.low, found.high, source=source)


def tissue_estimate(path: str | Path, law: str = "neo_hookean") -> Estimate:
    """``tissue_young_modulus`` [Pa] from a table with the columns stretch and stress (nominal)."""
    table = _table(path, {"stretch": "ratio", "stress": "stress"})
    try:
        found = tissue_modulus(table["stretch"], table["stress"], law=law)
    except InputError as error:
        raise error.at(Path(path).name) from None
    source = f"initial slope of a tension curve, {law}, {int(found.used.sum())} readings; incompressible"
    return Estimate("tissue_young_modulus", found.young_modulus, "Pa", found.low, found.high, source=source)


def _table(path: str | Path, wanted: dict[str, str]) -> dict[str, np.ndarray]:
    """The wanted columns in SI; an InputError names the columns of the table."""
    import pandas as pd

    text = io.StringIO(read_text(path, "table of readings"))
    try:
        frame = pd.read_csv(text, comment="#", nrows=_MAX_READINGS)
    except (ValueError, OverflowError) as error:
        raise InputError(
            "table of readings", limit=str(error).strip(), place=Path(path).name, next_step="Give a CSV file."
        ) from None
    if len(frame.columns) > _MAX_COLUMNS:
        limit = f"at most {_MAX_COLUMNS} can be read"
        raise InputError("number of columns", len(frame.columns), limit, Path(path).name, "Give a CSV file.")
    headers = ", ".join(map(str, frame.columns))
    columns = {}
    for quantity, dimension in wanted.items():
        header = next((str(name) for name in frame.columns if str(name).startswith(quantity)), None)
        factor = None if header is None else _factor(header.removeprefix(quantity), dimension)
        if factor is None:
            raise InputError(
                f"column {quantity}",
                "missing or without a unit",
                f"the columns are {headers}",
                place=Path(path).name,
                next_step=_header_step(quantity, dimension),
            )
        columns[quantity] = _numbers(frame[header], Path(path).name, header) * factor
    return columns


def _header_step(quantity: str, dimension: str) -> str:
    """How to name the column of a quantity."""
    return f"Name it {quantity}." if dimension == "ratio" else f"Name it {quantity}_ followed by its unit."


def _factor(ending: str, dimension: str) -> float | None:
    """Factor to SI of the unit at the end of a header; None for an unknown unit."""
    unit = ending.strip("_ []()")
    if dimension == "ratio":
        return 1.0 if not unit else None
    if dimension == "stress":
        return _STRESS.get(unit)
    found = find(unit, dimension)
    return None if found is None else found.numerator / found.denominator


def _numbers(column: Any, file: str, header: str) -> np.ndarray:
    try:
        values = column.to_numpy(float)
    except (ValueError, OverflowError, TypeError) as error:
        raise InputError(f"column {header}", limit=str(error), place=file, next_step="Give only numbers.") from None
    valid = np.abs(values) <= _MAX_MAGNITUDE
    if not valid.all():
        first = int(np.argmin(valid))
        place, limit = f"{file}: row {first + 2}", f"it must be finite and at most {_MAX_MAGNITUDE:g}"
        raise InputError(f"column {header}", values[first], limit, place, "Correct or remove this row.")
    return values


@dataclass(frozen=True, eq=False, kw_only=True)
class BendingFit:
    """Young modulus [Pa] with its interval, hub slack [m], and True (n,) for the readings with small deflection."""

    young_modulus: float
    low: float
    high: float
    slack: float
    used: np.ndarray


def cantilever_deflection(force: ArrayLike, position: ArrayLike, needle: Needle) -> Any:
    """Tip deflection [m] under ``force`` [N] at ``position`` [m] from the clamp: F a^2 (3 L - a) / (6 E I), small
    slopes."""
    return force * _compliance(position, needle) / needle.young_modulus


def cantilever_modulus(force: ArrayLike, position: ArrayLike, deflection: ArrayLike, needle: Needle) -> Any:
    """Young modulus [Pa] that one reading implies; ``needle.young_modulus`` is not used."""
    return force * _compliance(position, needle) / deflection


def cantilever_sensitivities(position: float, needle: Needle) -> dict[str, float]:
    """d ln E / d ln x of one reading, for x = force, deflection, outer_diameter, position, length; solid needle."""
    length = needle.length
    return {
        "force": 1.0,
        "deflection": -1.0,
        "outer_diameter": -4.0,
        "position": 2.0 - position / (3.0 * length - position),
        "length": 3.0 * length / (3.0 * length - position),
    }


def needle_modulus(force: ArrayLike, position: ArrayLike, deflection: ArrayLike, needle: Needle) -> BendingFit:
    """Young modulus of a needle by regression of deflection on the compliance of each reading.

    Parameters
    ----------
    force, position, deflection : array_like
        Force (n,) [N], its distance (n,) [m] from the clamp, and deflection of the tip (n,) [m].
    needle : Needle
        Section and length are used, its modulus is not.

    Returns
    -------
    BendingFit

    Raises
    ------
    InputError
        With fewer than three readings of small deflection, and for impossible readings.

    Notes
    -----
    The intercept is slack in the hub. Errors are assumed proportional to the deflection. Readings with
    F a^2 / (E I) > 0.3 are beyond small deflections and not used; E is fitted again until this selection is stable.
    Gere & Timoshenko, Mechanics of Materials.
    """
    force, position, deflection = (np.asarray(column, float) for column in (force, position, deflection))
    _refuse_impossible(position, deflection, needle)
    load = force * _compliance(position, needle)
    used = position <= np.sort(position)[min(2, len(position) - 1)]
    for _ in range(10):
        softness, half, slack = _softness(load[used], deflection[used])
        small = np.abs(force) * position**2 * softness / needle.second_moment <= SMALL_DEFLECTION
        if (small == used).all():
            break
        used = _enough(small, used)
    low, high = 1.0 / (softness + half), 1.0 / (softness - half) if softness > half else np.inf
    return BendingFit(young_modulus=1.0 / softness, low=low, high=high, slack=slack, used=used)


def _softness(load: np.ndarray, deflection: np.ndarray) -> tuple[float, float, float]:
    """1/E [1/Pa], the half width of its interval, and the slack [m]."""
    if len(load) < 3:
        raise InputError("number of bending readings", len(load), "at least 3 are needed", next_step="Give more.")
    # divided by the load, errors proportional to the deflection have equal weight
    design, ratio = np.column_stack([np.ones_like(load), 1.0 / load]), deflection / load
    values, covariance, t = least_squares(design, ratio)
    if not values[0] > 0.0:
        step = "Check the columns and their units."
        limit = "the needle would have no stiffness"
        raise InputError("tip_deflection", "not growing with the load", limit, next_step=step)
    return float(values[0]), t * float(np.sqrt(covariance[0, 0])), float(values[1])


def _compliance(position: Any, needle: Needle) -> Any:
    """a^2 (3 L - a) / (6 I): deflection times E over force [1/m]."""
    return position**2 * (3.0 * needle.length - position) / (6.0 * needle.second_moment)


def _refuse_impossible(position: np.ndarray, deflection: np.ndarray, needle: Needle) -> None:
    for row, (a, tip) in enumerate(zip(position, deflection), 1):
        if not 0.0 < a <= needle.length:
            limit = f"it must be above 0 and at most the needle's length {needle.length:g} m"
            step = "Give the distance of the force from the clamp, or correct the needle's length."
            raise InputError("position", f"{a:g} m", limit, f"reading {row}", step)
        if tip == 0.0:
            step = "Remove this reading."
            raise InputError("tip_deflection", "0 m", "a loaded needle bends", f"reading {row}", step)


def _enough(small: np.ndarray, used: np.ndarray) -> np.ndarray:
    if small.sum() >= 3:
        return small
    if small.sum() == 0 or used.sum() < 3:
        raise InputError(
            "small deflections",
            f"{small.sum()} readings",
            f"at least 3 with F a^2/(E I) below {SMALL_DEFLECTION} are needed",
            next_step="Load the needle nearer to the clamp or with a smaller force.",
        )
    return used


@dataclass(frozen=True, eq=False, kw_only=True)
class TensionFit:
    """Young modulus [Pa] at zero strain with its interval, the law and its coefficients [Pa], and True (n,) for the
    readings used."""

    young_modulus: float
    low: float
    high: float
    law: str
    coefficients: np.ndarray
    used: np.ndarray


def nominal_stress(law: str, stretch: ArrayLike, coefficients: Sequence[float] | np.ndarray) -> np.ndarray:
    """Nominal stress [Pa] at ``stretch`` (any shape, > 0) for the coefficients [Pa] of one of ``LAWS``, or of "ogden".

    Coefficients: linear E; neo_hookean mu; mooney C10, C01; yeoh C10, C20, C30; ogden mu_1, alpha_1, mu_2, alpha_2, …
    in the convention W = sum mu_p/alpha_p (sum lambda^alpha_p - 3), whose E is 3/2 sum mu_p alpha_p.
    """
    stretch = np.asarray(stretch, float)
    if law == "ogden":
        pairs = zip(coefficients[::2], coefficients[1::2])
        return sum(mu * (stretch ** (alpha - 1.0) - stretch ** (-0.5 * alpha - 1.0)) for mu, alpha in pairs)
    basis, _ = _BASES[_known(law)]
    return sum(c * column for c, column in zip(coefficients, basis(stretch), strict=True))


def tissue_modulus(
    stretch: ArrayLike, stress: ArrayLike, *, law: str = "neo_hookean", largest_strain: float = 0.3
) -> TensionFit:
    """Young modulus of a tissue from a tension test: least squares of one law, whose initial slope is E.

    Parameters
    ----------
    stretch, stress : array_like
        Stretch (n,) [1] and nominal stress (n,) [Pa].
    law : str
        One of ``LAWS``.
    largest_strain : float
        Readings with a larger |stretch - 1| are not used.

    Returns
    -------
    TensionFit

    Raises
    ------
    InputError
        For too few readings, and a law that softens within them (dP/dstretch <= 0).
    """
    basis, weights = _BASES[_known(law)]
    stretch, stress = np.asarray(stretch, float), np.asarray(stress, float)
    used = np.abs(stretch - 1.0) <= largest_strain
    if used.sum() <= len(weights) + 1:
        raise InputError(
            f"number of tension readings with a strain up to {largest_strain:g}",
            int(used.sum()),
            f"at least {len(weights) + 2} are needed for the law {law}",
            next_step="Give more readings at small strain.",
        )
    coefficients, covariance, t = least_squares(np.column_stack(basis(stretch[used])), stress[used])
    _refuse_softening(law, coefficients, stretch[used])
    weights = np.array(weights)
    modulus, error = float(weights @ coefficients), t * float(np.sqrt(weights @ covariance @ weights))
    return TensionFit(
        young_modulus=modulus,
        low=modulus - error,
        high=modulus + error,
        law=law,
        coefficients=coefficients,
        used=used,
    )


def _known(law: str) -> str:
    if law not in _BASES:
        raise InputError("tension law", repr(law), "unknown", next_step=f"Give one of {', '.join(LAWS)}.")
    return law


def _refuse_softening(law: str, coefficients: np.ndarray, stretch: np.ndarray) -> None:
    """Raises InputError for a law that softens within the readings, which is unstable (Drucker)."""
    fine = np.linspace(stretch.min(), stretch.max(), 200)
    if (np.diff(nominal_stress(law, fine, coefficients)) <= 0).any():
        raise InputError("tension law", law, "it softens within the readings", next_step="Use a law with fewer terms.")
