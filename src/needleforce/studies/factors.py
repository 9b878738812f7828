# SPDX-License-Identifier: Apache-2.0
"""Factors: which value of the model or the motion each one is, and its values from numbers between 0 and 1."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .. import core
from ..errors import InputError
from ..models.laws import FAMILIES, law_called
from ..preset_files.schema import ENDINGS, TOP, keys, si_key, tips, to_si

MOTION_KEYS = {
    "start_mm": 1e-3,
    "speed_mm_s": 1e-3,
    "depth_mm": 1e-3,
    "hold_s": 1.0,
    "acceleration_mm_s2": 1e-3,
}
BENDING_KEYS = {
    "foundation_kPa": 1e3,
    "bevel_half_angle_deg": math.pi / 180.0,
    "bevel_friction": 1.0,
    "bevel_face_share": 1.0,
}
# ending of a name -> unit as on an axis, the longest first
_UNITS = {
    each: each.replace("_per_", "/").removeprefix("per_").replace("m2", "m²").replace("m/s", "m/s").replace("_", " ")
    if not each.startswith("per_")
    else f"1/{each.removeprefix('per_')}"
    for each in sorted(
        {*(ending for endings in ENDINGS.values() for ending in endings), "mm_s", "mm_s2"}, key=len, reverse=True
    )
} | {"mm_s": "mm/s", "mm_s2": "mm/s²", "deg": "°", "um": "µm"}
GRID_TAIL = 0.05  # share of a distribution without limits that a grid leaves out on each side


@dataclass(frozen=True, eq=False)
class Factor:
    """A factor.

    Parameters
    ----------
    name : str
        As in the study file, such as ``layer_2.friction.per_length_N_per_mm``.
    place : tuple of (str or int)
        Where the value stands in the preset, the motion or the bending.
    values : callable
        ``values(u)`` are those (n,) of numbers ``u`` (n,) between 0 and 1, in the unit of the name, or texts.
    to_si : callable
        From the unit of the name to SI.
    levels : int
        Values on a grid.
    spread : str
        How a grid covers it: from end to end, without the tails, or each of its values.
    group : str
        Factors of one group are drawn together: their values belong to one condition of a campaign.
    """

    name: str
    place: tuple[str | int, ...]
    values: Callable[[np.ndarray], np.ndarray]
    to_si: Callable[[Any], Any]
    levels: int
    spread: str = "each"
    group: str = ""

    @property
    def label(self) -> str:
        """As on an axis: ``friction: per length [N/mm]``."""
        head, _, key = self.name.rpartition(".")
        ending = next((each for each in _UNITS if key.endswith(f"_{each}")), "")
        stem = key.removesuffix(f"_{ending}") if ending else key
        unit = f" [{_UNITS[ending]}]" if ending else ""
        return f"{head}: {stem}{unit}".replace("_", " ").replace(".", " ", 1) if head else f"{stem}{unit}"


def factors_of(question: Any, document: dict, folder: Path) -> list[Factor]:
    """The factors of a question; ``document`` is the preset that they change, ``folder`` that of the study file.

    Raises InputError for a name that neither the model nor the motion has, or a distribution without its numbers.
    """
    found = []
    for section in question.factor:
        place, to_si_of_name, unit = _place(section.name, question, document)
        if section.distribution == "campaign":
            values, count = _of_conditions(_population(section.table, question, folder)[section.quantity] / unit)
        else:
            values, count = _DISTRIBUTIONS[section.distribution](section)
        group = section.table if section.distribution == "campaign" else ""
        spread = {"uniform": "ends", "normal": "tails", "log-normal": "tails"}.get(section.distribution, "each")
        levels = count if spread == "each" else section.levels or count
        found.append(
            Factor(
                name=section.name,
                place=place,
                values=values,
                to_si=to_si_of_name,
                levels=levels,
                spread=spread,
                group=group,
            )
        )
    return found


def factor_values(factors: list[Factor], rows: np.ndarray) -> dict[str, np.ndarray]:
    """The values (n,) of each factor in its own unit, of rows (n, columns) of numbers between 0 and 1."""
    column = {name: k for k, name in enumerate(dict.fromkeys(each.group or each.name for each in factors))}
    return {each.name: each.values(rows[:, column[each.group or each.name]]) for each in factors}


def _population(name: str, question: Any, folder: Path) -> dict[str, np.ndarray]:
    """For each quantity that factors take from a campaign's table, its values in the conditions that have them all."""
    import pandas

    path = folder / name
    wanted = [each.quantity for each in question.factor if each.distribution == "campaign" and each.table == name]
    if not (name and all(wanted)):
        limit = "the distribution campaign needs table and quantity"
        raise InputError("factor", "no table or quantity", limit, next_step="Add both.")
    try:
        table = pandas.read_parquet(path) if path.suffix == ".parquet" else pandas.read_csv(path)
        pooled = table[table["file"].isna() & table["quantity"].isin(wanted)]
        fields = list(table.columns[: table.columns.get_loc("file")])
        found = pooled.set_index([*fields, "quantity"])["value"].unstack().reindex(columns=wanted).dropna()
    except (OSError, ValueError, KeyError, ImportError) as error:
        step = "Give a table that campaign --table wrote."
        raise InputError("table of a campaign", str(path), str(error), next_step=step) from None
    if len(found) < 2:
        limit = f"two conditions with {' and '.join(wanted)} are needed"
        raise InputError("table of a campaign", f"{len(found)} conditions", limit, str(path))
    return {quantity: found[quantity].to_numpy(float) for quantity in wanted}


def _of_conditions(values: np.ndarray) -> tuple[Callable, int]:
    """The values of the conditions, each as often as the others."""
    return lambda u: values[np.minimum((u * len(values)).astype(int), len(values) - 1)], len(values)


def _place(name: str, question: Any, document: dict) -> tuple[tuple, Callable, float]:
    """Where a factor's value stands, its conversion to SI, and the size of its unit in SI."""
    head, _, key = name.rpartition(".")
    if name == "model.preset":
        return ("model", "preset"), str, 1.0
    if head in ("motion", "bending"):
        known = MOTION_KEYS if head == "motion" else BENDING_KEYS
        if key not in known or (head == "bending" and question.bending is None):
            raise _unknown(name, [f"{head}.{each}" for each in known])
        return (head, key), lambda value: float(value), known[key]
    section, place = _section(name, head, document)
    table = _table(name, place, section)
    for row in table:
        for written, factor in keys(row["name"], row["unit"]).items():
            if written == key:
                where = (*place, si_key(row["name"], row["unit"]))
                return where, lambda value, factor=factor: to_si(float(value), factor), to_si(1.0, factor)
    raise _unknown(name, [f"{head}.{written}" for row in table for written in keys(row["name"], row["unit"])])


def _section(name: str, head: str, document: dict) -> tuple[dict, tuple]:
    """The section of the preset that a name begins with, and the way to it."""
    parts: list[str | int] = list(head.split("."))
    if str(parts[0]).startswith("layer_"):
        number = str(parts[0]).removeprefix("layer_")
        parts = [*(["layers", int(number) - 2] if number.isdigit() and int(number) > 1 else []), *parts[1:]]
    found: Any = document
    for part in parts:
        inside = isinstance(found, list) and isinstance(part, int) and part < len(found)
        if not (inside or (isinstance(found, dict) and part in found)):
            known = [key for key, value in document.items() if isinstance(value, dict)]
            layers = [f"layer_{number}" for number in range(1, 2 + len(document.get("layers", ())))]
            raise _unknown(name, [*known, *layers, "motion"])
        found = found[part]
    return found, tuple(parts)


def _table(name: str, place: tuple, section: dict) -> list[dict]:
    """The parameters that a section of a preset may have."""
    if place[-1] in FAMILIES:
        return law_called(place[-1], section["law"]).table()
    if place[-1] == "tip":
        return next(tip for tip in tips() if tip.name == section["shape"]).table()
    if isinstance(place[-1], int):
        return TOP
    owners = {"needle": core.Needle, "tissue": core.Tissue}
    if place[-1] not in owners:
        raise _unknown(name, [*FAMILIES, *owners])
    return owners[place[-1]].table()


def _unknown(name: str, known: list[str]) -> InputError:
    step = f"Known here are {', '.join(known[:30])}."
    return InputError("factor", repr(name), "the model, the motion and the needle have no such value", next_step=step)


def _numbers(section: Any, *names: str) -> list[float]:
    """The numbers that a distribution needs. Raises InputError for one that is missing or not finite."""
    for name in names:
        value = getattr(section, name)
        if value is None or not math.isfinite(value):
            limit = f"its distribution {section.distribution} needs {' and '.join(names)}"
            raise InputError(f"factor {section.name}", f"{name} is {value}", limit, next_step=f"Add {name} = ….")
    return [getattr(section, name) for name in names]


def _uniform(section: Any) -> tuple[Callable, int]:
    low, high = _numbers(section, "low", "high")
    if not low < high:
        raise InputError(f"factor {section.name}", f"low {low:g}, high {high:g}", "low is not below high")
    return lambda u: low + (high - low) * u, 5


def _clipped(section: Any, distribution: Any) -> tuple[Callable, int]:
    """A distribution between the limits of its section, where it has them."""
    low = distribution.cdf(section.low) if section.low is not None else 0.0
    high = distribution.cdf(section.high) if section.high is not None else 1.0
    if not low < high:
        raise InputError(f"factor {section.name}", f"low {section.low}, high {section.high}", "nothing between them")
    tiny = np.finfo(float).eps
    return lambda u: distribution.ppf(np.clip(low + (high - low) * u, tiny, 1.0 - tiny)), 5


def _normal(section: Any) -> tuple[Callable, int]:
    from scipy import stats

    mean, sd = _numbers(section, "mean", "sd")
    _positive(section, "sd", sd)
    return _clipped(section, stats.norm(mean, sd))


def _log_normal(section: Any) -> tuple[Callable, int]:
    from scipy import stats

    median, ratio = _numbers(section, "median", "ratio")
    _positive(section, "median", median)
    if not ratio > 1.0:
        limit = "the factor between median and one standard deviation above it is over 1"
        raise InputError(f"factor {section.name}", f"ratio {ratio:g}", limit)
    return _clipped(section, stats.lognorm(math.log(ratio), scale=median))


def _positive(section: Any, what: str, value: float) -> None:
    if not value > 0.0:
        raise InputError(f"factor {section.name}", f"{what} {value:g}", "must be above 0")


def _choices(section: Any) -> tuple[Callable, int]:
    if not section.choices:
        raise InputError(f"factor {section.name}", "no choices", "one at least", next_step="Add choices = […].")
    texts = any(isinstance(each, str) for each in section.choices)
    if texts and section.name != "model.preset":
        raise InputError(f"factor {section.name}", repr(section.choices), "its choices are numbers")
    listed = np.array(section.choices, dtype=object if texts else float)
    return lambda u: listed[np.minimum((u * len(listed)).astype(int), len(listed) - 1)], len(listed)


_DISTRIBUTIONS = {
    "uniform": _uniform,
    "normal": _normal,
    "log-normal": _log_normal,
    "choices": _choices,
}
