# SPDX-License-Identifier: Apache-2.0
"""The paper's two tests beside the rig, from small CSV tables: bending of the needle, tension of the tissue."""

from pathlib import Path

import numpy as np

from ..errors import InputError
from ..units import find
from .bending import needle_modulus
from .estimates import Estimate
from .tension import tissue_modulus

_STRESS = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "N/mm^2": 1e6}


def needle_estimate(path, needle) -> Estimate:
    """``needle_young_modulus`` [Pa] from a table with the columns position, force and tip_deflection, units in the
    headers."""
    table = _table(path, {"position": "length", "force": "force", "tip_deflection": "length"})
    try:
        found = needle_modulus(table["force"], table["position"], table["tip_deflection"], needle)
    except InputError as error:
        raise error.at(Path(path).name) from None
    source = f"cantilever, {int(found.used.sum())} of {len(found.used)} readings within small deflections"
    return Estimate("needle_young_modulus", found.young_modulus, "Pa", found.low, found.high, source=source)


def tissue_estimate(path, law: str = "neo_hookean") -> Estimate:
    """``tissue_young_modulus`` [Pa] from a table with the columns stretch and stress (nominal)."""
    table = _table(path, {"stretch": "ratio", "stress": "stress"})
    try:
        found = tissue_modulus(table["stretch"], table["stress"], law=law)
    except InputError as error:
        raise error.at(Path(path).name) from None
    source = f"initial slope of a tension curve, {law}, {int(found.used.sum())} readings; incompressible"
    return Estimate("tissue_young_modulus", found.young_modulus, "Pa", found.low, found.high, source=source)


def _table(path, wanted: dict[str, str]) -> dict[str, np.ndarray]:
    """The wanted columns in SI; InputError names the columns seen."""
    import pandas as pd

    try:
        frame = pd.read_csv(path, comment="#")
    except (OSError, ValueError) as error:
        raise InputError(
            "table", limit=str(error).strip(), place=Path(path).name, next_step="Give a CSV file."
        ) from None
    seen = ", ".join(map(str, frame.columns))
    columns = {}
    for quantity, dimension in wanted.items():
        header = next((str(name) for name in frame.columns if str(name).startswith(quantity)), None)
        factor = None if header is None else _factor(header.removeprefix(quantity), dimension)
        if factor is None:
            raise InputError(
                quantity,
                "missing or without a unit",
                f"the columns are {seen}",
                Path(path).name,
                f"Name it {quantity}_ followed by its unit.",
            )
        columns[quantity] = _numbers(frame[header], Path(path).name, header) * factor
    return columns


def _factor(ending: str, dimension: str) -> float | None:
    """SI units in one of the unit that a header ends in."""
    unit = ending.strip("_ []()")
    if dimension == "ratio":
        return 1.0 if not unit else None
    if dimension == "stress":
        return _STRESS.get(unit)
    found = find(unit, dimension)
    return None if found is None else found.numerator / found.denominator


def _numbers(column, file: str, header: str) -> np.ndarray:
    try:
        values = column.to_numpy(float)
    except ValueError as error:
        raise InputError(header, limit=str(error), place=file, next_step="Give numbers only.") from None
    if not np.isfinite(values).all():
        raise InputError(header, "not finite", f"in row {int(np.argmin(np.isfinite(values))) + 2}", file)
    return values
