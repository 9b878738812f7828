# SPDX-License-Identifier: Apache-2.0
"""Factors: which value of the model or the motion each one is, and its values from numbers between 0 and 1."""

import math
import re
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
    "start_mm": (1e-3, "m"),
    "speed_mm_s": (1e-3, "m/s"),
    "depth_mm": (1e-3, "m"),
    "hold_s": (1.0, "s"),
    "acceleration_mm_s2": (1e-3, "m/s^2"),
}
MODEL, MODEL_PLACE = "model.preset", ("model", "preset")
"""Name and place of the factor whose values are presets."""
BENDING_KEYS = {
    "foundation_kPa": (1e3, "Pa"),
    "bevel_half_angle_deg": (math.pi / 180.0, "rad"),
    "bevel_friction": (1.0, "1"),
    "bevel_face_share": (1.0, "1"),
}
"""Key of the motion or the bending -> its factor to SI, and the unit."""
_SPELLED = {"mm_s": "mm/s", "mm_s2": "mm/s²", "deg": "°", "um": "µm"}
_ENDINGS = sorted({*(each for endings in ENDINGS.values() for each in endings), *_SPELLED}, key=len, reverse=True)
"""Endings of names with a unit, the longest first."""
GRID_TAIL = 0.05  # share of a distribution without limits that a grid leaves out on each side


@dataclass(frozen=True, eq=False)
class Factor:
    """A factor.

    Parameters
    ----------
    name : str
        As in the study file, such as ``layer_2.friction.per_length_N_per_mm``.
    column : str
        Its column in the table of the result, whose values are in SI: ``layer_2.friction.per_length``.
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
    column: str
    place: tuple[str | int, ...]
    values: Callable[[np.ndarray], np.ndarray]
    to_si: Callable[[Any], Any]
    levels: int
    spread: str = "each"
    group: str = ""

    @property
    def label(self) -> str:
        """As on an axis: ``friction: per length [N/mm]``."""
        head, _, stem = self.column.rpartition(".")
        ending = self.name.removeprefix(self.column).removeprefix("_")
        unit = f" [{_SPELLED.get(ending) or _shown(ending)}]" if ending else ""
        return f"{head}: {stem}".replace("_", " ").replace(".", " ", 1) + unit


def _shown(ending: str) -> str:
    """A unit as on an axis, of the ending of a name: ``N/mm`` of ``N_per_mm``."""
    text = ending.removeprefix("per_")
    return ("1/" if text != ending else "") + text.replace("_per_", "/").replace("_", " ").replace("m2", "m²")


def factors_of(question: Any, document: dict, folder: Path) -> list[Factor]:
    """The factors of a question; ``document`` is the preset that they change, ``folder`` that of the study file.

    Raises InputError for a name that neither the model nor the motion has, or a distribution without its numbers.
    """
    found = [_factor(section, question, document, folder) for section in question.factor]
    for number, factor in enumerate(found):
        same = next((each for each in found[:number] if each.place == factor.place), None)
        if same is not None:
            limit = f"it is the same value as {same.name}"
            raise InputError("factor", repr(factor.name), limit, next_step="Keep one of the two.")
    return found


def _factor(section: Any, question: Any, document: dict, folder: Path) -> Factor:
    place, to_si_of_name, unit = _place(section.name, question, document)
    _check_keys(section)
    if section.distribution == "campaign":
        taken = _population(section.table, question, folder)[section.quantity]
        if taken.unit != unit:
            limit = f"{section.quantity} is in {taken.unit}, the factor in {unit}"
            raise InputError("factor", repr(section.name), limit, next_step="Give the quantity of this parameter.")
        values, count = _of_conditions(taken.values / to_si_of_name(1.0))
    else:
        values, count = _DISTRIBUTIONS[section.distribution](section)
    spread = {"uniform": "ends", "normal": "tails", "log-normal": "tails"}.get(section.distribution, "each")
    return Factor(
        name=section.name,
        column=section.name if place[0] == "model" else _column(section.name),
        place=place,
        values=values,
        to_si=to_si_of_name,
        levels=count if spread == "each" else section.levels or count,
        spread=spread,
        group=section.table if section.distribution == "campaign" else "",
    )


def _column(name: str) -> str:
    """The name of a factor without its unit."""
    ending = next((each for each in _ENDINGS if name.endswith(f"_{each}")), "")
    return name.removesuffix(f"_{ending}") if ending else name


def _check_keys(section: Any) -> None:
    """Raise InputError for a number that the distribution does not have."""
    known = {"name", "distribution", *_KEYS[section.distribution]}
    for key in section.__struct_fields__:
        if key not in known and getattr(section, key) not in (None, (), "", 0):
            limit = f"{section.distribution} has {', '.join(_KEYS[section.distribution])}"
            step = f"Remove {key}, or change the distribution."
            raise InputError(f"factor {section.name}", f"{key} is given", limit, next_step=step)


def factor_values(factors: list[Factor], rows: np.ndarray) -> dict[str, np.ndarray]:
    """The values (n,) of each factor in its own unit, of rows (n, columns) of numbers between 0 and 1."""
    column = {name: k for k, name in enumerate(dict.fromkeys(each.group or each.name for each in factors))}
    return {each.name: each.values(rows[:, column[each.group or each.name]]) for each in factors}


@dataclass(frozen=True, eq=False)
class Taken:
    """The values of a quantity in the conditions of a campaign, with their unit."""

    values: np.ndarray
    unit: str


def _population(name: str, question: Any, folder: Path) -> dict[str, Taken]:
    """For each quantity that factors take from a campaign's table, its values in the conditions that have them all
    identified."""
    import pandas

    path = folder / name
    wanted = [each.quantity for each in question.factor if each.distribution == "campaign" and each.table == name]
    if not (name and all(wanted)):
        limit = "the distribution campaign needs table and quantity"
        raise InputError("factor", "no table or quantity", limit, next_step="Add both.")
    step = "Give a table that campaign --table wrote."
    try:
        table = pandas.read_parquet(path) if path.suffix == ".parquet" else pandas.read_csv(path)
        known = table["file"].isna() & table["quantity"].isin(wanted) & (table["identifiable"].astype(str) == "True")
        pooled = table[known]
        fields = list(table.columns[: table.columns.get_loc("file")])
        found = pooled.set_index([*fields, "quantity"])["value"].unstack().reindex(columns=wanted).dropna()
        units = {quantity: str(pooled["unit"][pooled["quantity"] == quantity].iloc[0]) for quantity in found.columns}
    except (OSError, ValueError, KeyError, IndexError, ImportError) as error:
        raise InputError("table of a campaign", str(path), str(error), next_step=step) from None
    if len(found) < 2:
        limit = f"two conditions with {' and '.join(wanted)} identified are needed"
        raise InputError("table of a campaign", f"{len(found)} conditions", limit, str(path), step)
    return {quantity: Taken(found[quantity].to_numpy(float), units[quantity]) for quantity in wanted}


def _of_conditions(values: np.ndarray) -> tuple[Callable, int]:
    """The values of the conditions, each as often as the others."""
    return lambda u: values[np.minimum((u * len(values)).astype(int), len(values) - 1)], len(values)


def _place(name: str, question: Any, document: dict) -> tuple[tuple, Callable, str]:
    """Where a factor's value stands, its conversion to SI, and its unit in SI."""
    head, _, key = name.rpartition(".")
    if name == MODEL:
        return MODEL_PLACE, str, ""
    if head in ("motion", "bending"):
        known = MOTION_KEYS if head == "motion" else BENDING_KEYS
        if key not in known or (head == "bending" and question.bending is None):
            raise _unknown(name, [f"{head}.{each}" for each in known])
        factor, unit = known[key]
        return (head, key), lambda value: factor * float(value), unit
    section, place = _section(name, head, document)
    table = _table(name, place, section)
    for row in table:
        for written, factor in keys(row["name"], row["unit"]).items():
            if written == key:
                where = (*place, si_key(row["name"], row["unit"]))
                return where, lambda value, factor=factor: to_si(float(value), factor), row["unit"]
    raise _unknown(name, [f"{head}.{written}" for row in table for written in keys(row["name"], row["unit"])])


def _section(name: str, head: str, document: dict) -> tuple[dict, tuple]:
    """The section of the preset that a name begins with, and the way to it."""
    parts: list[str | int] = list(head.split("."))
    if layer := re.fullmatch(r"layer_([1-9]\d{0,2})", str(parts[0]), re.ASCII):
        parts = [*(["layers", int(layer[1]) - 2] if layer[1] != "1" else []), *parts[1:]]
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
    step = f"Known here are {', '.join(known[:30])}." if known else "That law has no parameters."
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
        limits = f"low {low:g}, high {high:g}"
        raise InputError(f"factor {section.name}", limits, "low is not below high", next_step="Exchange them.")
    return lambda u: low + (high - low) * u, 5


def _clipped(section: Any, middle: float, width: float, of_value: Callable, to_value: Callable) -> tuple[Callable, int]:
    """A distribution that is normal in ``of_value`` of the value, between the limits of its section, where it has
    them."""
    from scipy.stats import truncnorm

    low, high = (None if each is None else (of_value(each) - middle) / width for each in (section.low, section.high))
    low, high = -np.inf if low is None else low, np.inf if high is None else high
    if not low < high:
        limit = f"low {section.low}, high {section.high}"
        raise InputError(f"factor {section.name}", limit, "nothing between them", next_step="Give low below high.")
    tiny = np.finfo(float).eps
    return lambda u: to_value(truncnorm.ppf(np.clip(u, tiny, 1.0 - tiny), low, high, middle, width)), 5


def _normal(section: Any) -> tuple[Callable, int]:
    mean, sd = _numbers(section, "mean", "sd")
    _positive(section, "sd", sd)
    return _clipped(section, mean, sd, float, np.asarray)


def _log_normal(section: Any) -> tuple[Callable, int]:
    median, ratio = _numbers(section, "median", "ratio")
    _positive(section, "median", median)
    if not ratio > 1.0:
        limit = "the factor between median and one standard deviation above it is over 1"
        raise InputError(f"factor {section.name}", f"ratio {ratio:g}", limit, next_step="Give for example ratio = 1.3.")
    logarithm = lambda value: math.log(value) if value > 0.0 else -np.inf  # noqa: E731
    return _clipped(section, math.log(median), math.log(ratio), logarithm, np.exp)


def _positive(section: Any, what: str, value: float) -> None:
    if not value > 0.0:
        raise InputError(f"factor {section.name}", f"{what} {value:g}", "must be above 0", next_step="Change it.")


def _choices(section: Any) -> tuple[Callable, int]:
    if not section.choices:
        raise InputError(f"factor {section.name}", "no choices", "one at least", next_step="Add choices = […].")
    texts = any(isinstance(each, str) for each in section.choices)
    if texts and section.name != MODEL:
        step = "Give numbers in the unit of the name."
        raise InputError(f"factor {section.name}", repr(section.choices), "its choices are numbers", next_step=step)
    listed = np.array(section.choices, dtype=object if texts else float)
    return lambda u: listed[np.minimum((u * len(listed)).astype(int), len(listed) - 1)], len(listed)


_DISTRIBUTIONS = {
    "uniform": _uniform,
    "normal": _normal,
    "log-normal": _log_normal,
    "choices": _choices,
}
# distribution -> the keys that it has
_KEYS = {
    "uniform": ("low", "high", "levels"),
    "normal": ("mean", "sd", "low", "high", "levels"),
    "log-normal": ("median", "ratio", "low", "high", "levels"),
    "choices": ("choices",),
    "campaign": ("table", "quantity"),
}
