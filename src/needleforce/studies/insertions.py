# SPDX-License-Identifier: Apache-2.0
"""The insertions of a study: from a row of factors to a model, a motion, a simulated run and its recording; a block of
rows is one task."""

import copy
import hashlib
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .. import core
from ..errors import InputError
from ..models.flexible_insertion import FlexibleInsertion
from ..models.model import Insertion, Model, solid_engine
from ..models.simulation import Motion
from ..preset_files.presets import preset_of
from ..rig.sensor import COUNTS, Sensor
from ..vocabulary import Status
from .factors import BENDING_KEYS, MOTION_KEYS, Factor, factor_values, factors_of
from .outputs import Output, Run
from .posterior import Posterior
from .question import MotionSection, Question, RecordingsSection

MAX_SAMPLES = 1_000_000  # of one insertion
MAX_LABELLED = 8  # punctures of a recording whose depths are kept


@dataclass(frozen=True, eq=False)
class Setting:
    """What the insertions of a study share: the question, the preset that its factors change, the posterior of its fit,
    and the folder of its file."""

    question: Question
    document: dict
    posterior: Posterior | None
    folder: Path

    @property
    def factors(self) -> list[Factor]:
        """The factors in the order of the file."""
        return factors_of(self.question, self.document, self.folder)


@dataclass(frozen=True, eq=False)
class Block:
    """Rows of a study that are one task; ``first`` is the number of the first row."""

    setting: Setting
    first: int
    rows: np.ndarray


def simulated(block: Block) -> dict[str, np.ndarray]:
    """The columns of a block: number, motion, factors in SI, outputs in SI, why an insertion has no outputs, and its
    recordings where the question asks for them."""
    setting = block.setting
    question, factors = setting.question, setting.factors
    values, solid = factor_values(factors, block.rows), _solid(setting)
    found = []
    for k, row in enumerate(block.rows):
        changes = {factor.place: factor.to_si(values[factor.name][k]) for factor in factors}
        shown = {factor.column: changes[factor.place] for factor in factors}
        for number, (name, section) in enumerate(zip(question.motions, question.motion)):
            outcome, run = _outcome(setting, row, changes, section, solid)
            known = {"number": block.first + k, "motion": name, **shown, **outcome}
            if question.recordings is None:
                found.append(known)
            for repeat in range(question.recordings.repeats if question.recordings else 0):
                seed = (question.study.seed, block.first + k, number, repeat)
                found.append(known | {"repeat": repeat} | _recorded(question, run, section.rate_hz, seed))
    return {name: np.array([each[name] for each in found]) for name in found[0]}


def _recorded(question: Question, run: Run | None, rate: float, seed: tuple[int, ...]) -> dict[str, Any]:
    """The columns of one recording in a learning set, as a sensor shows it: the part of the set to which its specimen
    belongs, its rate, depth [m], force [N] and phase (samples,), and the depths of its punctures.

    ``seed`` makes bias, noise and drift: the same recording for the same insertion. One that failed has no values.
    """
    section = question.recordings
    shown, nothing = np.float64(np.nan), np.full(section.samples, np.nan, np.float32)
    depth, force, phase, punctures = nothing, nothing, np.zeros(section.samples, np.int8), np.full(MAX_LABELLED, np.nan)
    if run is not None:
        kept = np.rint(np.linspace(0, len(run.depth) - 1, section.samples)).astype(int)
        shown = np.float64(rate * (section.samples - 1) / (len(run.depth) - 1))
        depth, phase = run.depth[kept].astype(np.float32), run.columns["phase"][kept].astype(np.int8)
        force = _measured(section, run.force, rate, np.random.default_rng(seed))[kept].astype(np.float32)
        found = run.punctures[:MAX_LABELLED]
        punctures[: len(found)] = run.depth[found]
    split = _split_of(section, seed[1], seed[0])
    return {"split": split, "rate": shown, "depth": depth, "force": force, "phase": phase, "puncture_depths": punctures}


def _measured(section: RecordingsSection, force: np.ndarray, rate: float, random: np.random.Generator) -> np.ndarray:
    """The force [N] as a sensor shows it."""
    sensor = Sensor(filter_length=section.filter_length, noise=section.noise_N, bias=section.bias_N)
    drift = section.drift_N_per_s * random.uniform(-1.0, 1.0) * np.arange(len(force)) / rate
    step = max(section.rounding_N, 1.0 / COUNTS["force"] / section.filter_length)
    return step * np.rint(sensor.record({"force": force + drift}, random)["force"] / step)


def _split_of(section: RecordingsSection, specimen: int, seed: int) -> str:
    """The part of a learning set to which a specimen belongs, with all its insertions."""
    share = int.from_bytes(hashlib.sha256(f"{seed} {specimen}".encode()).digest()[:8], "big") / 2.0**64
    if share < section.train:
        return "train"
    return "validation" if share < section.train + section.validation else "test"


def _outcome(
    setting: Setting, row: np.ndarray, changes: dict, section: MotionSection, solid: Any
) -> tuple[dict[str, Any], Run | None]:
    """The outputs of one insertion, or NaN for each and the reason, and its run."""
    outputs = setting.question.outputs
    nothing = {each.name: np.full(each.points, np.nan) if each.is_curve else np.nan for each in outputs}
    try:
        model = model_of_row(setting, row, changes)
        run, _ = run_of(setting, model, changes, section, solid)
        return {each.name: _value(setting.question, each, model, run) for each in outputs} | {"why": ""}, run
    except InputError as error:
        return nothing | {"why": str(error).split("\n")[0]}, None


def run_of(
    setting: Setting, model: Model, changes: dict, section: MotionSection, solid: Any = None
) -> tuple[Run, float]:
    """The run of a model along a motion, and the time between two samples [s]. Raises InputError if a sample has no
    force."""
    dt, depth, velocity = sampled_motion(section, changes)
    run, status = _run(setting.question, model, changes, depth=depth, velocity=velocity, dt=dt, solid=solid)
    if np.any(status):
        words, place = list(Status), int(np.flatnonzero(status)[0])
        number = int(status[place])
        word = words[number] if number < len(words) else "no force"
        raise InputError("insertion", f"{word} at depth {1e3 * depth[place]:.2f} mm", "a sample has no force")
    return run, dt


def _value(question: Question, output: Output, model: Model, run: Run) -> Any:
    if output.quantity != "rests":
        return output.kind.value(run, output)
    from ..control import Device, rest_in_loop
    from ..control.rest import RESTS

    given = question.device
    device = Device(
        mass=1e-3 * given.mass_g,
        damping=given.damping_N_s_per_m,
        stiffness=given.stiffness_N_per_m,
        rate=given.rate_hz,
    )
    depth = None if given.depth_mm is None else 1e-3 * given.depth_mm
    return float(rest_in_loop(model, device, depth=depth).verdict == RESTS)


def model_of_row(setting: Setting, row: np.ndarray, changes: dict) -> Model:
    """The model of one row. Raises InputError for a value outside the range of its law."""
    document = setting.document
    if setting.posterior is not None:
        document = setting.posterior.document(row[len(row) - setting.posterior.size :])
    if ("model", "preset") in changes:
        document = preset_table(changes["model", "preset"], setting.folder)
    document = copy.deepcopy(document)
    for place, value in changes.items():
        if place[0] not in ("motion", "bending", "model"):
            _assign(document, place, value)
    return preset_of(document)


def preset_table(name: str, folder: Path) -> dict:
    """The tables of a shipped preset or a preset file next to the study."""
    from ..files import decode_toml, read_bytes
    from ..preset_files.presets import FOLDER, presets

    path = FOLDER / f"{name}.toml" if name in presets() else folder / name
    if path.suffix != ".toml":
        raise InputError("preset", repr(name), "unknown", next_step=f"Give a .toml file, or {', '.join(presets())}.")
    return decode_toml(read_bytes(path, "preset"), "preset")


def _assign(document: dict, place: tuple, value: float) -> None:
    """Put a value in SI at its place, in place of what is there in any unit."""
    section: Any = document
    for part in place[:-1]:
        section = section[part]
    stem = place[-1]
    for key in [key for key in section if key == stem or _same_parameter(key, stem)]:
        del section[key]
    section[stem] = value


def _same_parameter(key: str, si: str) -> bool:
    """Whether two keys are one parameter in different units."""
    from ..preset_files.schema import ENDINGS

    return any(
        si.endswith(f"_{next(iter(endings))}")
        and any(key == si.removesuffix(f"_{next(iter(endings))}") + f"_{ending}" for ending in endings)
        for endings in ENDINGS.values()
    )


def sampled_motion(section: MotionSection, changes: dict) -> tuple[float, np.ndarray, np.ndarray]:
    """The motion with its factors: the time between two samples [s], and depth [m] and velocity [m/s] (n,)."""
    given = {
        key.rpartition("_")[0].removesuffix("_mm"): changes.get(("motion", key), factor * getattr(section, key))
        for key, (factor, _) in MOTION_KEYS.items()
    }
    motion = Motion.insert(**given, withdraw=section.withdraw)
    count = math.floor(motion.duration * section.rate_hz) + 1
    if not 2 <= count <= MAX_SAMPLES:
        step = "Change rate_hz, speed_mm_s or hold_s."
        raise InputError("samples of an insertion", count, f"outside 2 to {MAX_SAMPLES}", next_step=step)
    depth, velocity = motion.at(np.arange(count) / section.rate_hz)
    return 1.0 / section.rate_hz, depth, velocity


def _run(
    question: Question,
    model: Model,
    changes: dict,
    *,
    depth: np.ndarray,
    velocity: np.ndarray,
    dt: float,
    solid: Any,
) -> tuple[Run, np.ndarray]:
    """The run along a motion, and the status of each sample."""
    steps = np.full(len(depth), dt)
    if question.bending is None:
        engine = Insertion(model, max_speed=np.inf) if solid is None else None
        columns = engine.run(depth, velocity, steps) if solid is None else solid_engine(model, solid).run(depth, steps)
        return Run(depth, columns), columns["status"]
    given = {
        key: changes.get(("bending", key), factor * getattr(question.bending, key))
        for key, (factor, _) in BENDING_KEYS.items()
    }
    if model.needle is None:
        raise InputError("needle", "none", "a needle that bends has one", next_step="Add [needle] to the preset.")
    bevel = core.Bevel(
        half_angle=given["bevel_half_angle_deg"],
        friction_coefficient=given["bevel_friction"],
        face_share=given["bevel_face_share"],
    )
    guide = question.bending.guide_distance_mm
    engine = FlexibleInsertion(
        model,
        model.needle,
        lateral=given["foundation_kPa"],
        tissue=solid,
        guide_distance=math.inf if guide is None else 1e-3 * guide,
        bevel=bevel,
        elements=question.bending.elements,
        max_speed=math.inf,
    )
    columns = dict(engine.run(depth, dt=steps)) | {"target_mm": question.bending.target_mm}
    return Run(depth, columns), columns["status"]


def _solid(setting: Setting) -> Any:
    """The condensed solid of the question, or None."""
    if setting.question.solid is None:
        return None
    from ..fe import load_condensed

    return load_condensed(setting.folder / setting.question.solid.file)
