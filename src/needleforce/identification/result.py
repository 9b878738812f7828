# SPDX-License-Identifier: Apache-2.0
"""The outcome of an identification: estimates with intervals, what was held fixed, and how well the model did."""

import dataclasses
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .. import core
from ..errors import InputError
from ..models.model import Insertion, Model
from ..recording import Recording
from ..segmentation import Events
from ..segmentation.strokes import cycles
from ..vocabulary import Status
from .estimates import Estimate, Quality
from .one_layer.cycle_estimates import CycleFit
from .statistics.correlations import Correlations, correlations_of
from .strokes import Strokes, stroke_speed
from .two_pass.result import TwoPass


@dataclass(frozen=True, eq=False)
class RecordingFit:
    """What one recording gave. ``predicted`` (n,) [N] is the model along its motion; empty where there is no model.

    ``cycle`` is the fit of ``strokes`` that the estimates come from, None where there is none: draws are made of it.
    """

    file: str
    status: Status
    recording: Recording | None
    events: Events
    parameters: dict[str, Estimate] = field(default_factory=dict)
    quality: Quality | None = None
    predicted: np.ndarray = field(default_factory=lambda: np.empty(0))
    notes: tuple[str, ...] = ()
    cycle: CycleFit | None = None
    strokes: Strokes | None = None


@dataclass(frozen=True, eq=False)
class Fit:
    """The identification of one condition from one or more repeats: own and pooled parameters, and the model they make.

    ``model`` is None where no recording could answer. ``warnings`` say in plain words which limits were crossed,
    ``held_fixed`` what was taken and not identified, ``unknown`` what these logs cannot tell. ``choice`` lists the
    stiffness laws compared, by BIC.
    """

    recordings: tuple[RecordingFit, ...]
    parameters: dict[str, Estimate]
    model: Model | None
    quality: Quality | None
    warnings: tuple[str, ...] = ()
    held_fixed: tuple[str, ...] = ()
    unknown: tuple[str, ...] = ()
    choice: tuple[tuple[str, float], ...] = ()
    settings: dict[str, object] = field(default_factory=dict)
    two_pass: TwoPass | None = None
    ruptures: Any = None
    """Of a layered fit: where its layers give way."""
    spread: Any = None
    """Of a layered fit: covariance and scatter of its numbers."""
    population: Model | None = None
    """Of a layered fit to repeats: the law for an insertion not seen yet, its ruptures spread over their scatter."""
    population_contact: float = 0.0
    """[m], in the recordings' zero."""

    def predict(self, recording: Recording, events: Events | None = None) -> np.ndarray:
        """Force (n,) [N] of the identified model along the motion of ``recording``.

        Punctures are at the mean depths of the fit, of a layered one those of its ``population``; with ``events`` (as
        from ``segment(recording)``) contact and punctures are the recording's own where they were seen, a replay.
        Raises InputError for a fit without a model.
        """
        model, surface = self.placed(recording, events)
        return self._speed_factor(recording) * run_model(model, recording, surface)

    def _speed_factor(self, recording: Recording) -> float:
        """By which the speed of a recording's insertion multiplies the forces of the model."""
        exponent, strokes = self.parameters.get("speed_exponent"), cycles(recording.time, recording.depth)
        if exponent is None or not strokes:
            return 1.0
        inwards = slice(strokes[0].start, strokes[0].stop)
        speed = stroke_speed(recording.time[inwards], recording.depth[inwards])
        return (speed / self.settings["speed_m_s"]) ** exponent.value

    def placed(self, recording: Recording, events: Events | None = None) -> tuple[Model, float]:
        """The model that ``predict`` runs along a recording, to run in a loop instead, and the depth [m] of its
        surface in the recording's zero.

        ``nf.Insertion(model)`` takes the recording's depth less that of the surface. Forces at another speed than that
        of the fit are not scaled. Raises InputError for a fit without a model.
        """
        model = self._identified()
        contact = self.parameters["contact_depth"].value
        if self.population is not None and (events is None or not events.punctures):
            own = self.ruptures.of(events, recording)[0] if events is not None else 0.0
            return self.population, self.population_contact + own
        if self.ruptures is not None and events is not None:
            shift, depths = self.ruptures.of(events, recording)
            return with_ruptures(model, depths - contact - shift), contact + shift
        if events is not None and events.contact is not None:
            contact = events.contact.depth
        if events is not None and events.punctures:
            model = with_ruptures(model, [events.punctures[0].depth - contact])
        return model, contact

    @property
    def correlations(self) -> Correlations | None:
        """What trades off within a recording; None where no recording answers."""
        return correlations_of(self.recordings) if self.spread is None else self.spread.correlations()

    def draws(self, count: int = 4000, seed: int = 0):
        """Independent draws of what was identified, as ``Draws``; see ``draws_of``."""
        from .statistics.draws import draws_of

        return draws_of(self, count, seed)

    def to_arviz(self, draws: int = 4000, seed: int = 0):
        """The draws as ArviZ takes them; see ``inference_data``. Raises InputError without ArviZ."""
        from .export import inference_data

        return inference_data(self.draws(draws, seed))

    def to_csv(self, path) -> None:
        """Writes every estimate, pooled and of each recording, as a CSV table; see ``write_estimates``."""
        from .export import write_estimates

        write_estimates(self, path)

    def to_json(self) -> str:
        """The fit as JSON text, in the form of ``needleforce identify --json``."""
        from .export import as_json

        return as_json(self)

    def report(self, path) -> None:
        """Writes one HTML file that opens offline."""
        from ..report import write_report

        write_report(self, path)

    def save(self, path) -> None:
        """Writes the identified model as a preset file."""
        from ..preset_files.writing import save

        save(self._identified(), path)

    def _identified(self) -> Model:
        if self.model is None:
            said = "; ".join(note for each in self.recordings for note in each.notes[:1]) or "there was no recording"
            raise InputError(
                "fit", "without a model", said, next_step="See the notes of fit.recordings and fit.warnings."
            )
        return self.model


def with_ruptures(model: Model, depths) -> Model:
    """The model whose layers, from the surface down, give way at ``depths`` [m] below the undeformed surface."""
    first, *others = (
        core.laws.PunctureDepth(max(float(depth) - layer.top, 0.0)) for depth, layer in zip(depths, model.layers)
    )
    deeper = [dataclasses.replace(layer, puncture=law) for layer, law in zip(model.deeper, others)]
    return dataclasses.replace(model, puncture=first, deeper=tuple(deeper))


def run_model(model: Model, recording: Recording, contact_depth: float) -> np.ndarray:
    """Force (n,) [N] of ``model`` along a recording whose surface is at ``contact_depth`` [m] in its own zero."""
    dt = np.diff(recording.time, prepend=recording.time[0] - 1.0 / recording.rate)
    return Insertion(model, max_speed=np.inf).run(recording.depth - contact_depth, None, dt)["force"]


def with_unreadable(fit: Fit | None, unread: list[tuple[str, InputError]]) -> Fit:
    """``fit`` with one entry for each (file, error); None is a fit of nothing."""
    fit = fit or Fit((), {}, None, None)
    entries = tuple(
        RecordingFit(file, Status.unreadable, None, Events(status=Status.unreadable), notes=(str(error),))
        for file, error in unread
    )
    return dataclasses.replace(fit, recordings=fit.recordings + entries)
