# SPDX-License-Identifier: Apache-2.0
"""A question as data: the model, the factors with their distributions, the motions, the outputs and the method, as a
study file states them."""

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from ..errors import InputError
from ..files import as_type, decode_toml, read_bytes
from .outputs import OUTPUTS, Output, output_of

METHODS = ("sample", "sensitivity", "grid", "robust", "design")
MAX_ROWS = 100_000_000
MAX_FACTORS = 100
WHAT = "study file"
RESERVED = ("number", "motion", "why", "split", "repeat", "rate", "depth", "force", "phase", "puncture_depths")
"""Names of columns that no output may have."""

Finite = Annotated[float, Meta(ge=-1e12, le=1e12)]
Positive = Annotated[float, Meta(gt=0.0, le=1e9)]
NotNegative = Annotated[float, Meta(ge=0.0, le=1e9)]
Force = Annotated[float, Meta(ge=0.0, le=100.0)]
Share = Annotated[float, Meta(ge=0.0, le=1.0)]
Count = Annotated[int, Meta(ge=1, le=10_000)]


class Section(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A table of a study file, whose unknown keys are refused."""


class Method(Section):
    """How the space of the factors is covered, and what is made of it."""

    method: Literal[METHODS] = "sample"
    samples: Annotated[int, Meta(ge=1, le=MAX_ROWS)] = 1024
    seed: Annotated[int, Meta(ge=0, le=2**32 - 1)] = 0
    sampler: Literal["sobol", "latin hypercube"] = "sobol"
    analysis: Literal["sobol", "morris", "delta"] = "sobol"
    interactions: bool = False
    name: str = "study"


class Base(Section):
    """The model that the factors change: a shipped preset or a preset file, or the JSON of a fit."""

    preset: str = ""
    fit: str = ""


class FactorSection(Section):
    """A factor: a value of the model or the motion, and how it is distributed."""

    name: str
    distribution: Literal["uniform", "normal", "log-normal", "choices", "campaign"] = "uniform"
    low: Finite | None = None
    high: Finite | None = None
    mean: Finite | None = None
    sd: Finite | None = None
    median: Finite | None = None
    ratio: Finite | None = None
    choices: tuple[Finite | str, ...] = ()
    table: str = ""
    quantity: str = ""
    levels: Annotated[int, Meta(ge=0, le=10_000)] = 0


class MotionSection(Section):
    """An insertion, a hold and a withdrawal."""

    name: str = ""
    start_mm: Finite = -5.0
    speed_mm_s: Positive = 3.0
    depth_mm: Finite = 20.0
    hold_s: NotNegative = 0.0
    withdraw: bool = True
    acceleration_mm_s2: Positive = 10.0
    rate_hz: Annotated[float, Meta(gt=0.0, le=1e6)] = 500.0


class OutputSection(Section):
    """A quantity of each insertion; ``low`` and ``high`` are limits in the unit in which it is printed."""

    quantity: Literal[tuple(OUTPUTS)]
    name: str = ""
    depth_mm: Finite | None = None
    points: Count = 100
    low: Finite | None = None
    high: Finite | None = None


class BendingSection(Section):
    """A needle that bends on a foundation, driven by its bevel."""

    foundation_kPa: Positive
    bevel_half_angle_deg: Annotated[float, Meta(gt=0.0, le=90.0)] = 90.0
    bevel_friction: NotNegative = 0.0
    bevel_face_share: Share = 1.0
    guide_distance_mm: NotNegative | None = None
    elements: Annotated[int, Meta(ge=1, le=100)] = 40
    target_mm: tuple[Finite, Finite, Finite] | None = None


class SolidSection(Section):
    """A condensed solid that the needle drags along."""

    file: str


class DeviceSection(Section):
    """A device that holds the needle."""

    mass_g: Positive
    damping_N_s_per_m: NotNegative = 0.0
    stiffness_N_per_m: NotNegative = 0.0
    rate_hz: Positive = 1000.0
    depth_mm: Positive | None = None


class RecordingsSection(Section):
    """A learning set: what a sensor shows of each insertion, and how the specimens are split."""

    samples: Annotated[int, Meta(ge=2, le=100_000)] = 400
    repeats: Annotated[int, Meta(ge=1, le=100)] = 1
    filter_length: Count = 10
    noise_N: Force = 1.0 / 320.0
    bias_N: Force = 2e-3
    drift_N_per_s: Force = 0.0
    rounding_N: Force = 0.0
    train: Share = 0.8
    validation: Share = 0.1
    format: Literal["parquet", "hdf5"] = "parquet"


class DesignSection(Section):
    """Experiments to compare: every motion with every noise and number of repeats, identified as a user would."""

    parameters: Annotated[tuple[str, ...], Meta(min_length=1)]
    noise_N: Annotated[tuple[Force, ...], Meta(min_length=1)] = (1.0 / 320.0,)
    repeats: Annotated[tuple[Annotated[int, Meta(ge=1, le=100)], ...], Meta(min_length=1)] = (1, 3)
    experiments: Count = 20
    identify_as: str | None = None


class Question(Section):
    """All that a study depends on: two studies with equal questions have equal results."""

    study: Method = Method()
    model: Base = Base(preset="paper")
    factor: tuple[FactorSection, ...] = ()
    posterior: bool = False
    motion: Annotated[tuple[MotionSection, ...], Meta(min_length=1, max_length=100)] = (MotionSection(),)
    output: Annotated[tuple[OutputSection, ...], Meta(min_length=1, max_length=100)] = (
        OutputSection(quantity="peak_force"),
    )
    bending: BendingSection | None = None
    solid: SolidSection | None = None
    device: DeviceSection | None = None
    recordings: RecordingsSection | None = None
    design: DesignSection | None = None

    @property
    def outputs(self) -> tuple[Output, ...]:
        """The outputs in SI."""
        return tuple(output_of(each) for each in self.output)

    @property
    def motions(self) -> tuple[str, ...]:
        """The name of each motion."""
        return tuple(each.name or f"motion {number}" for number, each in enumerate(self.motion, 1))

    def document(self) -> dict:
        """The question as a study file states it."""
        return msgspec.to_builtins(self)


def read_question(source: str | os.PathLike | Mapping) -> Question:
    """The question of a study file, or of a mapping with the same keys.

    Raises InputError, with the path inside the file, for a key that is unknown, a value that is missing or contradicts
    another.
    """
    if isinstance(source, Mapping):
        return _checked(as_type(_listed(dict(source)), Question, WHAT, "Correct the value at this place."))
    path = Path(source)
    try:
        document = decode_toml(read_bytes(path, WHAT), WHAT)
        return _checked(as_type(_listed(document), Question, WHAT, "Correct the file at this place."))
    except InputError as error:
        raise error.at(path.name) from None


def _listed(document: dict) -> dict:
    """The document with a single ``[motion]``, ``[factor]`` or ``[output]`` as a list of one."""
    single = {key: [document[key]] for key in ("motion", "factor", "output") if isinstance(document.get(key), Mapping)}
    return document | single


def _checked(question: Question) -> Question:
    method, names = question.study, [each.name for each in question.factor]
    if not names and not question.posterior:
        step = "Add [[factor]] with name, distribution and its numbers, or posterior = true with the JSON of a fit."
        raise InputError("factors", "none", "a study varies one at least", next_step=step)
    for repeated in {name for name in names if names.count(name) > 1}:
        raise InputError("factor", repr(repeated), "given twice", next_step="Keep one of the two.")
    if len(names) > MAX_FACTORS:
        raise InputError("factors", len(names), f"more than {MAX_FACTORS}", next_step="Fix those that matter less.")
    if len(set(question.motions)) < len(question.motions):
        raise InputError("motion", ", ".join(question.motions), "a name is given twice", next_step="Name them apart.")
    if method.method == "design" and question.design is None:
        step = 'Add [design] with parameters = ["friction_per_length"].'
        raise InputError("design", "missing", "the method design needs it", next_step=step)
    _check_model(question)
    _check_outputs(question)
    return question


def _check_model(question: Question) -> None:
    if bool(question.model.preset) == bool(question.model.fit):
        step = 'Give preset = "paper", a preset file, or fit = "fit.json".'
        raise InputError("model", "preset and fit", "one of the two is needed", "$.model", step)
    if question.posterior and not question.model.fit:
        step = 'Give [model] fit = "fit.json", as identify --json writes it.'
        raise InputError("posterior", "without a fit", "it is that of a fit", "$.model", step)
    dependent = question.posterior or any(each.distribution == "campaign" for each in question.factor)
    if dependent and question.study.method == "sensitivity" and question.study.analysis != "delta":
        limit = f"{question.study.analysis} takes factors as independent, which those of a fit or a campaign are not"
        raise InputError("study.analysis", repr(question.study.analysis), limit, next_step='Use analysis = "delta".')


def _check_outputs(question: Question) -> None:
    outputs = question.outputs
    for each, section in zip(outputs, question.output):
        for needed in each.kind.needs:
            if getattr(question, needed) is None:
                limit = f"it needs a table [{needed}]"
                raise InputError("output", repr(each.quantity), limit, "$.output", f"Add [{needed}] to the file.")
        if each.quantity.endswith("at_depth") != (section.depth_mm is not None):
            limit = "depth_mm is that of force_at_depth, which needs it"
            raise InputError("output", repr(each.quantity), limit, "$.output", "Add depth_mm = 10, or remove it.")
        if each.quantity == "force_at_depth" and not _reached(question, section.depth_mm):
            limit = f"no motion reaches {section.depth_mm:g} mm"
            raise InputError("output", repr(each.name), limit, "$.output", "Give another depth_mm or motion.")
        if each.quantity == "target_error" and question.bending.target_mm is None:
            step = "Add target_mm = [x, y, z]."
            raise InputError("output", repr(each.quantity), "it needs target_mm", "$.bending", step)
        if None not in (each.low, each.high) and each.low > each.high:
            raise InputError("limits", each.name, "low is above high", "$.output", "Exchange them.")
        if each.is_curve and (each.low is not None or each.high is not None):
            raise InputError("limits", each.name, "a curve has none", "$.output", "Use peak_force or force_at_depth.")
        if not re.fullmatch(r"[A-Za-z][\w ]*", each.name) or each.name in RESERVED:
            limit = f"a name of letters, digits and _ that is none of {', '.join(RESERVED)}"
            raise InputError("name of the output", repr(each.name), limit, "$.output", "Give another name.")
    names = [each.name for each in outputs]
    for repeated in {name for name in names if names.count(name) > 1}:
        raise InputError("output", repr(repeated), "given twice", "$.output", 'Name them apart: name = "…".')
    limited = [each for each in outputs if each.low is not None or each.high is not None]
    if question.study.method == "robust" and not limited:
        step = "Add low or high to an output, in the unit of the output."
        raise InputError("limits", "none", "robust counts the insertions within limits", "$.output", step)


def _reached(question: Question, depth_mm: float) -> bool:
    """Whether a motion reaches a depth, also where the depth of motions is a factor."""
    varies = any(each.name == "motion.depth_mm" for each in question.factor)
    return varies or any(each.start_mm <= depth_mm <= each.depth_mm for each in question.motion)
