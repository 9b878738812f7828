# SPDX-License-Identifier: Apache-2.0
"""What is expected of a tissue before the needle moves: from a model, from recordings of such tissue, or nothing."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from .. import core
from ..errors import InputError
from ..identification import Fit
from ..identification.statistics.noise import TWO_SIDED, student_quantile
from ..models.model import Layer, Model
from ..recording import Recording

FACTOR = 3.0  # of each parameter of a model: what another specimen of a tissue may have
NOTHING = (0.0, 0.0)
NAMES = ("modulus", "cutting", "friction", "top", "puncture", "remainder")
GENERIC = core.tips.Cone(math.pi / 4)  # by which fits without a tip state their stiffness
NO_SHANK = 0.1  # [m]
MAX_LAYERS = 8
USUAL_SCATTER, WORTH = 0.05, 3  # between repeats over the peak, and how many repeats this knowledge is worth
POINTS = 161  # of the force of earlier insertions, as the core has them
EVENT_SETTINGS = {row["name"] for row in core.EventSettings.table()}

Expected = tuple[float, float]  # mean and standard deviation


@dataclass(frozen=True, kw_only=True)
class Prior:
    """What is expected.

    Attributes
    ----------
    layers : tuple of dict
        Of each layer mean and standard deviation of what is known: ``modulus`` [Pa], ``cutting`` [N], ``friction``
        [N/m], ``top`` and ``puncture`` [m] below the contact, ``remainder``, the share of the force after a puncture.
    same_tissue : bool
        Whether recordings of this tissue gave it, instead of a model of another specimen.
    complete : bool
        Whether no further layer is expected.
    tip, radius : tip, float
        Shape of the contact, and the radius [m] where it stops growing.
    tip_known : bool
        False where the tip stands for a stiffness coefficient alone.
    earlier : list of (float, float)
        Mean and standard deviation [N] of the force of earlier insertions every ``spacing`` below their contact.
    spacing : float
        That distance [m]; 0 without any.
    model : Model or None
        What gives the laws that are not learnt.
    source : str
        Where it is from, in words.
    """

    layers: tuple[dict[str, Expected], ...] = ()
    same_tissue: bool = False
    complete: bool = False
    tip: Any = GENERIC
    radius: float = NO_SHANK
    tip_known: bool = False
    earlier: list[Expected] = field(default_factory=list)
    spacing: float = 0.0
    model: Model | None = None
    source: str = "nothing"

    @property
    def punctures(self) -> int:
        """How many are expected; 0 if that is unknown."""
        return sum("puncture" in layer for layer in self.layers) if self.complete else 0

    def rows(self) -> list[list[Expected]]:
        """The layers for the core."""
        return [[layer.get(name, NOTHING) for name in NAMES] for layer in self.layers]


def prior_of(given: Any) -> Prior:
    """The prior that a model, a fit, recordings or None stand for; InputError for anything else."""
    if given is None:
        return Prior()
    if isinstance(given, Prior):
        return given
    if isinstance(given, Model):
        return _of_model(given)
    if isinstance(given, Fit):
        return _of_fit(given)
    if isinstance(given, Mapping) and given:
        return _of_specimens({name: _recordings(name, each) for name, each in given.items()})
    recordings = tuple(given) if isinstance(given, Iterable) else ()
    if recordings and all(isinstance(each, Recording) for each in recordings):
        return _of_recordings(recordings, Prior())
    step = "Give nf.preset(…), fit.model, a fit, recordings of the same tissue, {specimen: recordings}, or nothing."
    raise InputError("prior", type(given).__name__, "not a model, a fit or recordings", next_step=step)


def core_identifier(prior: Prior, **settings: float) -> core.OnlineIdentifier:
    """The core's identifier with a prior."""
    events = {key: settings.pop(key) for key in tuple(settings) if key in EVENT_SETTINGS}
    return core.OnlineIdentifier(
        layers=prior.rows(),
        count=prior.punctures,
        same_tissue=prior.same_tissue,
        radius=prior.radius,
        tip=prior.tip,
        earlier=prior.earlier,
        spacing=prior.spacing,
        settings=core.OnlineSettings(**settings),
        watched=core.EventSettings(**events),
    )


def _of_model(model: Model) -> Prior:
    """Every parameter within a factor of three."""
    tip, radius = _shape(model.stiffness)
    known = model.needle is not None and model.needle.tip is not None
    base = Prior(tip=tip, radius=radius, complete=True, tip_known=known, model=model)
    layers = tuple(_of_layer(layer, base) for layer in model.layers)
    return replace(base, layers=layers, source=f"model {model.name}, within a factor of {FACTOR:g}")


def _shape(law: Any) -> tuple[Any, float]:
    if hasattr(law, "tip"):
        return law.tip, law.radius
    if hasattr(law, "half_angle"):
        return core.tips.Cone(law.half_angle), getattr(law, "radius", NO_SHANK)
    return GENERIC, NO_SHANK


def _of_layer(layer: Layer, base: Prior) -> dict[str, Expected]:
    """The parameters that the law has, and the modulus with which the contact has its force at the puncture."""
    alone = Model(layer.stiffness, layer.puncture, layer.friction, layer.cutting)
    depth = alone.puncture_depth
    known: dict[str, Expected] = {}
    if layer.top > 0.0:
        known["top"] = (layer.top, 0.25 * layer.top)
    if math.isfinite(depth) and depth > 0.0:
        force = float(alone.force([depth * (1.0 - 1e-9)])[0])
        known["modulus"] = _wide(force / unit_force(base, depth))
        known["puncture"] = _wide(layer.top + depth)
    slides = [getattr(layer.friction, name, 0.0) for name in ("per_length", "coulomb")]
    for name, value in (("friction", max(slides)), ("cutting", getattr(layer.cutting, "force", 0.0))):
        if value > 0.0:
            known[name] = _wide(value)
    return known


def _wide(value: float) -> Expected:
    """Within a factor of ``FACTOR``: as far above as that."""
    return value, (FACTOR - 1.0) / TWO_SIDED * abs(value)


def unit_force(prior: Prior, depth: float) -> float:
    """Force of the contact over its reduced modulus [m²] at a depth [m]."""
    from ..mechanics.contact import contact

    options = {} if prior.radius >= NO_SHANK else {"shank_radius": prior.radius}
    return float(contact(prior.tip, depth=depth, reduced_modulus=1.0, **options).force)


def _of_fit(fit: Fit) -> Prior:
    """From the recordings of the fit, each read as it would be online; the model alone where there are none."""
    model = fit.identified_model
    recordings = [each.recording for each in fit.recordings if each.recording is not None]
    base = Prior() if model is None else replace(_of_model(model), layers=(), complete=False)
    if len(recordings) == 0:
        return _of_model(fit.model)
    return _of_recordings(recordings, base)


def _of_recordings(recordings: Sequence[Recording], base: Prior) -> Prior:
    """Of each parameter the mean over the recordings, and what another insertion may have."""
    insertions = [each for each in (_learnt(recording, base) for recording in recordings) if each]
    count = max(map(len, insertions), default=0)
    layers = []
    for k in range(count):
        rows = [each[k] for each in insertions if len(each) > k]
        if 2 * len(rows) <= len(insertions):
            break
        layers.append(_next_layer(rows))
    source = f"{len(insertions)} recordings of the same tissue"
    base = _with_forces(base, recordings)
    return replace(base, layers=tuple(layers), complete=bool(layers), same_tissue=bool(layers), source=source)


def _recordings(specimen: Any, given: Any) -> tuple[Recording, ...]:
    found = tuple(given) if isinstance(given, Iterable) else ()
    if found and all(isinstance(each, Recording) for each in found):
        return found
    step = "Give a list of nf.read(…) for each specimen."
    raise InputError(f"prior, specimen {specimen}", type(given).__name__, "without recordings", next_step=step)


def _of_specimens(specimens: Mapping[Any, Sequence[Recording]]) -> Prior:
    """Of another specimen of the population: between them its parameters scatter, and within each as its insertions do.
    Their forces along the depth are those of other tissue, and not compared."""
    priors = [prior for each in specimens.values() if (prior := _of_recordings(each, Prior())).layers]
    count = max((len(prior.layers) for prior in priors), default=0)
    layers = []
    for k in range(count):
        rows = [prior.layers[k] for prior in priors if len(prior.layers) > k]
        if 2 * len(rows) <= len(priors):
            break
        known = {name: [row[name] for row in rows if name in row] for name in NAMES}
        layers.append({name: _of_population(each) for name, each in known.items() if 2 * len(each) > len(rows)})
    source = f"{len(priors)} other specimens"
    return Prior(layers=tuple(layers), complete=bool(layers), source=source)


def _of_population(specimens: list[Expected]) -> Expected:
    """Of an insertion into another specimen: scatter between specimens and, of one insertion, within one."""
    mean, between = _next(specimens)
    return mean, math.hypot(between, math.sqrt(float(np.mean([sd**2 for _, sd in specimens]))))


def _with_forces(base: Prior, recordings: Sequence[Recording]) -> Prior:
    """The prior with the force of these insertions below their contact, as far as most of them are known."""
    found = [each for each in map(_below_contact, recordings) if each is not None]
    if not found:
        return base
    deepest = float(np.median([indentation[-1] for indentation, _ in found]))
    grid = np.linspace(0.0, deepest, POINTS)
    forces = np.array([np.interp(grid, *each) for each in found if each[0][-1] > 0.9 * deepest])
    mean, n = forces.mean(axis=0), len(forces)
    usual = USUAL_SCATTER * float(np.abs(mean).max())
    square = _smooth(forces.var(axis=0, ddof=1)) if n > 1 else 0.0
    sd = np.sqrt((WORTH * usual**2 + (n - 1) * square) / (WORTH + n - 1) * (1.0 + 1.0 / n))
    return replace(base, earlier=list(zip(mean.tolist(), sd.tolist())), spacing=deepest / (POINTS - 1))


def _smooth(square: np.ndarray) -> np.ndarray:
    """The largest within a thirtieth of the travel: falls do not come at one depth."""
    wide = np.pad(square, 5, mode="edge")
    return np.array([wide[i : i + 11].max() for i in range(len(square))])


def _below_contact(recording: Recording) -> tuple[np.ndarray, np.ndarray] | None:
    """Indentation [m], increasing, and force [N] of an insertion; None without a contact."""
    watch, steps = core.EventDetector(), np.diff(recording.time, prepend=recording.time[0])
    for force, depth, dt in zip(recording.force, recording.depth, steps):
        event = watch.step(force, depth, dt)
        if event is not None and event.kind == "contact":
            break
    else:
        return None
    deepest = int(np.argmax(recording.depth)) + 1
    depth, force = recording.depth[:deepest], recording.force[:deepest]
    new = np.flatnonzero(np.diff(np.maximum.accumulate(depth), prepend=-np.inf) > 0.0)
    return depth[new] - event.depth, force[new] - watch.zero


def _next_layer(rows: list[dict[str, Expected]]) -> dict[str, Expected]:
    """What most of the insertions have."""
    values = {name: [row[name] for row in rows if name in row] for name in NAMES}
    return {name: _next(known) for name, known in values.items() if 2 * len(known) > len(rows)}


def _next(values: list[Expected]) -> Expected:
    """What the next insertion has: the mean, with the scatter between insertions and their own errors."""
    means, errors = np.array(values).T
    n = len(means)
    if n == 1:
        return float(means[0]), max(_wide(means[0])[1], float(errors[0]))
    scatter = max(float(means.std(ddof=1)), 0.05 * abs(float(means.mean())))
    return float(means.mean()), scatter * math.sqrt(1.0 + 1.0 / n) * float(student_quantile(n - 1)) / TWO_SIDED


def _learnt(recording: Recording, base: Prior) -> list[dict[str, Expected]]:
    """The layers of one recording, read sample by sample from nothing."""
    online, done = core_identifier(base), None
    for force, depth, dt in zip(recording.force, recording.depth, np.diff(recording.time, prepend=recording.time[0])):
        event = online.step(force, depth, dt)
        if event is not None and event.kind == "reversal" and online.regime == "reversing":
            done = online.copy()  # before the withdrawal
    done = online if done is None else done
    if done is None or not done.layer(0)["touched"]:
        return []
    return [_layer_learnt(done, k) for k in range(done.pierced)]


def _layer_learnt(online: Any, k: int) -> dict[str, Expected]:
    layer, surface = online.layer(k), online.surface[0]
    found = {
        "puncture": (layer["puncture_depth"] - surface, 0.0),
        "remainder": (layer["remaining"], 0.0),
        **{name: (layer[name][0], layer[name][1]) for name in ("modulus", "cutting", "friction")},
    }
    return found
