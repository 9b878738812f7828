# SPDX-License-Identifier: Apache-2.0
"""An identified steered needle as a TOML file: parameters, covariance, and the insertions that predictions weigh."""

import json
import os
from pathlib import Path

import msgspec
import numpy as np

from ..checks import Range, in_range
from ..errors import InputError, did_you_mean
from ..files import MAX_RESULT_BYTES, as_type, atomic_write, check_count, decode_toml, read_bytes
from ..preset_files.build import make_needle, needle_lines
from ..preset_files.schema import NeedleSection
from .steering_model import SteeringModel, identified_model
from .steering_parameters import ALIGNED, MODELS, SHAPE_MODELS, WRENCH_MODELS
from .tip_paths import MAX_INSERTIONS, RANGES, TipPath
from .tissue_prior import RESPONSES, Spread, TissuePrior

_KNOWN = {p.name: p for models in (MODELS, WRENCH_MODELS, SHAPE_MODELS) for group in models.values() for p in group}
# of how the needle is held, and of the tracker
_OPTIONAL = {"guide_distance", "rotational_compliance", "pivot_stiffness", "lever", *ALIGNED}
_DEVIATION = Range(-100.0, 100.0, "", "a mean over tissues is not a hundred times what was known before")
_COVARIANCE = Range(-100.0, 100.0, "", "an error is not ten times what was known before")
_NEXT = "Give a file that fit.save or needleforce steer identify --save wrote."


class InsertionRows(msgspec.Struct, forbid_unknown_fields=True):
    """One insertion of the fit, its compared rows: base (n, 2), tip (n, 3) [m], slope (n, 2), roll (n,) [rad]."""

    name: str
    start: float
    base: list[list[float]]
    tip: list[list[float]]
    roll: list[float]
    slope: list[list[float]] = []


class PriorRows(msgspec.Struct, forbid_unknown_fields=True):
    """What other tissues had shown: of the identified parameters (p,), (p, p), and of the response to the base."""

    tissues: int
    mean: list[float]
    covariance: list[list[float]]
    response: list[float]
    response_covariance: list[list[float]]


class SteeringFile(msgspec.Struct, forbid_unknown_fields=True):
    """The sections of a steering file, all in SI units."""

    steering: str
    needle: NeedleSection
    values: dict[str, float]
    identified: list[str]
    covariance: list[list[float]]
    insertions: list[InsertionRows] = []
    prior: PriorRows | None = None


def save(model: SteeringModel, path: str | os.PathLike) -> None:
    """Write an identified model as a file that ``load`` reads as an equal one. Raises InputError if the model was not
    identified, or the file cannot be written."""
    if not model.identified or model.predictor.covariance is None:
        raise InputError("model", model.form, "not identified", next_step="Save the values of your insertion yourself.")
    names = [parameter.name for parameter in model.predictor.parameters]
    head = [
        f'steering = "{model.form}"',
        f"identified = {json.dumps(names)}",
        f"covariance = {_rows(model.predictor.covariance)}",
    ]
    values = ["[values]", *(f"{name} = {float(value)!r}" for name, value in model.values.items())]
    sections = [head, needle_lines(model.needle), values]
    if prior := model.predictor.prior:
        sections.append(_prior_lines(prior))
    sections += [_insertion(path) for path in model.predictor.insertions]
    with atomic_write(path) as file:
        file.write("\n\n".join("\n".join(lines) for lines in sections) + "\n")


def load(path: str | os.PathLike) -> SteeringModel:
    """Read an identified model.

    Parameters
    ----------
    path : path
        As ``save`` wrote it.

    Returns
    -------
    SteeringModel

    Raises
    ------
    InputError
        With the place in the file, if a section is missing, unknown or has values of another shape.
    """
    what, file = "steering file", Path(path)
    text = read_bytes(file, what, MAX_RESULT_BYTES)
    try:
        found: SteeringFile = as_type(decode_toml(text, what, next_step=_NEXT), SteeringFile, what, _NEXT)
        return _model(found)
    except InputError as error:
        raise error.at(file.name) from None


def _model(found: SteeringFile) -> SteeringModel:
    _check_values(found)
    parameters = tuple(_KNOWN[name] for name in found.identified)
    needle = make_needle(found.needle)
    assert needle is not None
    shape = (len(parameters), len(parameters))
    covariance = in_range("covariance", found.covariance, _COVARIANCE, _NEXT, shape)
    _check(found, covariance)
    check_count("insertions", len(found.insertions), MAX_INSERTIONS, "$.insertions")
    insertions = tuple(_tip_path(each, f"$.insertions[{k}], {each.name}") for k, each in enumerate(found.insertions))
    return identified_model(
        found.steering,
        needle,
        ALIGNED | found.values,
        parameters=parameters,
        covariance=covariance,
        insertions=insertions,
        prior=_prior(found),
    )


def _prior(found: SteeringFile) -> TissuePrior | None:
    rows = found.prior
    if rows is None:
        return None
    spread = _spread(rows.mean, rows.covariance, len(found.identified))
    response = _spread(rows.response, rows.response_covariance, RESPONSES)
    if not 1 <= rows.tissues <= MAX_INSERTIONS:
        raise InputError("tissues of a prior", rows.tissues, f"must be 1 to {MAX_INSERTIONS}", "$.prior", _NEXT)
    return TissuePrior(found.steering, tuple(found.identified), spread, response, rows.tissues)


def _spread(mean: list[float], covariance: list[list[float]], count: int) -> Spread:
    try:
        numbers = in_range("mean of a prior", mean, _DEVIATION, _NEXT, (count,))
        matrix = in_range("covariance of a prior", covariance, _COVARIANCE, _NEXT, (count, count))
        _check_covariance(matrix)
    except InputError as error:
        raise error.at("$.prior") from None
    return Spread(numbers, matrix)


def _check(found: SteeringFile, covariance: np.ndarray) -> None:
    """Raises InputError for another model, a value that it needs and does not have, or no covariance."""
    groups = [group[found.steering] for group in (MODELS, WRENCH_MODELS, SHAPE_MODELS) if found.steering in group]
    if not groups:
        limit = f"must be {' or '.join(MODELS)}"
        raise InputError("steering", repr(found.steering), limit, "$.steering", _NEXT)
    needed = [[p.name for p in group if p.name not in _OPTIONAL] for group in groups]
    if not any(set(names) <= set(found.values) for names in needed):
        missing = next(name for name in needed[0] if name not in found.values)
        raise InputError("values", ", ".join(found.values), f"{missing} is missing", "$.values", _NEXT)
    _check_covariance(covariance)


def _check_covariance(covariance: np.ndarray) -> None:
    if len(covariance) and not (
        np.allclose(covariance, covariance.T, rtol=1e-6) and np.linalg.eigvalsh(covariance)[0] > 0.0
    ):
        limit = "must be symmetric with eigenvalues above 0"
        raise InputError("covariance", "not one of errors", limit, "$.covariance", _NEXT)


def _check_values(found: SteeringFile) -> None:
    """Raises InputError for an unknown parameter, one named twice, or a value outside its range."""
    for k, name in enumerate(found.identified):
        if name not in found.values or name in found.identified[:k]:
            limit = "named twice" if name in found.values else "has no value"
            raise InputError("identified", name, limit, f"$.identified[{k}]", _NEXT)
    for name, value in found.values.items():
        if name not in _KNOWN:
            raise InputError("parameter", name, "unknown", "$.values", f"{did_you_mean(name, _KNOWN)}{_NEXT}")
        known = _KNOWN[name]
        allowed = Range(known.low, known.high, known.unit, known.meaning)
        in_range(name, value, allowed, "Correct the value.", (), place=lambda _: "$.values")


def _prior_lines(prior: TissuePrior) -> list[str]:
    return [
        "[prior]", f"tissues = {prior.tissues}", f"mean = {_rows(prior.spread.mean)}",
        f"covariance = {_rows(prior.spread.covariance)}", f"response = {_rows(prior.response.mean)}",
        f"response_covariance = {_rows(prior.response.covariance)}",
    ]  # fmt: skip


def _tip_path(rows: InsertionRows, place: str) -> TipPath:
    n = len(rows.roll)
    shapes = {"base": (n, 2), "tip": (n, 3), "slope": (n, 2), "roll": (n,)}
    try:
        if not n:
            raise InputError("rows", 0, "an insertion has some", next_step=_NEXT)
        columns = {
            name: in_range(name, getattr(rows, name), RANGES[name], _NEXT, shape)
            for name, shape in shapes.items()
            if name != "slope" or rows.slope
        }
        return TipPath(rows.name, start=rows.start, **{"slope": None} | columns)
    except InputError as error:
        raise error.at(place) from None


def _insertion(path: TipPath) -> list[str]:
    rows = path.compared
    lines = [
        "[[insertions]]", f"name = {json.dumps(path.name, ensure_ascii=False)}", f"start = {float(path.start)!r}",
        f"base = {_rows(path.base[rows])}", f"tip = {_rows(path.tip[rows])}", f"roll = {_rows(path.roll[rows])}",
    ]  # fmt: skip
    return lines if path.slope is None else [*lines, f"slope = {_rows(path.slope[rows])}"]


def _rows(values: np.ndarray) -> str:
    return json.dumps(np.asarray(values, dtype=float).tolist())
