# SPDX-License-Identifier: Apache-2.0
"""Identification of a layered model from repeats, and its result: in addition to that of one layer the rupture depths,
the uncertainty of the parameters, and the model for an insertion that was not recorded."""

import itertools
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...checks import random_seed
from ...errors import InputError
from ...models.model import Model
from ...recording import Recording
from ...segmentation import Events
from ...segmentation.strokes import cycles
from ...vocabulary import Phase, Status
from ..diagnostics import NO_MODEL, FitInputs, pooled_quality, quality, reference_of, settings_of, unfitted, warnings_of
from ..estimates import Correlations
from ..models import LAYERED, run_model, with_ruptures, with_stiffer_contact
from ..one_layer.segmented_recording import SegmentedRecording
from ..recording_fit import RecordingFit
from ..result import Fit, with_not_identifiable
from ..settings import Choice, LayeredSettings
from ..strokes import cycle_span, stroke_speed
from .binned_cycle import BETWEEN, COARSE, FINE, BinnedCycle, binned_cycles, recorded_punctures
from .known_stiffness import refined_with, with_known
from .model import (
    behind_hidden,
    held_fixed,
    layered_settings,
    layers_in_words,
    misfit_of,
    model_of,
    not_identified,
    own_ruptures,
    warnings_on,
)
from .model_selection import (
    Candidate,
    candidate,
    fewest_layers,
    fewest_mechanisms,
    removable,
    undecided_saturations,
    with_bic,
    without,
)
from .parameters import MM, TOP
from .prediction import Expectation, Path, Ruptures, expectation, ruptures, with_stiffness
from .search import Solved, grow, made_passive, on_all_cores, population_fit, refined
from .uncertainty import Uncertainty, uncertainty_of

MAX_LAYERS = 3


Grown = dict[tuple[str, tuple[int, ...]], Iterator[Solved]]
"""The fits with 1, 2, … layers, made when they are needed, by their form and the recordings' ids: the other forms start
from that as fitted."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class LayeredFit(Fit):
    """A layered model identified from complete cycles of repeats; all attributes of ``Fit``, and in addition:

    Attributes
    ----------
    ruptures : Ruptures
        Mean depths at which the layers rupture, and their scatter.
    expectation : Expectation or None
        The mean force over that scatter; None without a model.
    uncertainty : Uncertainty
        Covariance of the parameters and their scatter between repeats.
    population : Model or None
        The model for an insertion that was not recorded, with the scatter of the ruptures in its rupture length; None
        from one recording.
    population_contact : float
        Depth [m] of its surface in the recordings' zero.
    surface : float
        The same of ``model``, from which a ``contact_depth`` that is taken from one layer may differ.
    held_out : tuple of numpy.ndarray
        Force (n,) [N] along each recording with a fit, predicted by a fit to the others; empty with fewer than three.
    """

    settings: LayeredSettings
    ruptures: Ruptures
    expectation: Expectation | None = None
    uncertainty: Uncertainty | None = None
    population: Model | None = None
    population_contact: float = 0.0
    surface: float = 0.0
    held_out: tuple[np.ndarray, ...] = ()

    def _predicted(self, recording: Recording, events: Events | None) -> np.ndarray:
        """As of a ``Fit``: the mean force over the scatter of the rupture depths, which errs least.

        With ``events`` a layer ruptures at the puncture that plausibly is its own, by depth and drop, after a contact
        as stiff as the force there states; a layer without one keeps its scatter. Forces change with the power
        ``speed_exponent`` of the insertion's speed if it was identified.
        """
        if self.expectation is None:
            return self._speed_factor(recording) * super()._predicted(recording, events)
        shift = self.ruptures.shift(events)
        own = () if events is None else self.ruptures.assigned(recorded_punctures(events, recording), shift)
        return self.expectation.force(_path(recording), own, shift, self._speed_factor(recording))

    def new_insertion(self, recording: Recording) -> np.ndarray | None:
        """As ``predict``; None from one recording."""
        return None if self.population is None else self.predict(recording)

    def placed(self, recording: Recording, events: Events | None = None) -> tuple[Model, float]:
        """As ``Fit.placed``; without ``events`` the population model. Forces at another speed are not scaled."""
        model, surface = self.model, self.surface
        if self.population is not None and (events is None or not events.punctures):
            return self.population, self.population_contact + self.ruptures.shift(events)
        if events is None:
            return model, surface
        shift = self.ruptures.shift(events)
        own = self.ruptures.assigned(recorded_punctures(events, recording), shift)
        model = with_ruptures(model, self.ruptures.depths(own, shift) - surface - shift)
        stiffer = self.expectation.stiffer(_path(recording), own, shift, self._speed_factor(recording))
        for layer, times in enumerate(stiffer):
            model = with_stiffer_contact(model, layer, float(times))
        return model, surface + shift

    def document(self) -> dict:
        """As of a ``Fit``, with the rupture depths in the recordings' zero and the population model."""
        from ..export import preset_document

        found, model = self.ruptures, self.population
        ruptures = {"depth_m": found.depth, "past_peak_m": found.past_peak, "contact_depth_m": found.contact}
        population = {"contact_depth_m": self.population_contact, "preset": preset_document(model)}
        return super().document() | {"ruptures": ruptures, "population": None if model is None else population}

    @property
    def shared_contact(self) -> float | None:
        """Depth [m] of the surface, which all recordings share."""
        return self.parameters["contact_depth"].value if "contact_depth" in self.parameters else None

    @property
    def correlations(self) -> Correlations | None:
        """Correlations of the errors within the runs."""
        return None if self.uncertainty is None else self.uncertainty.correlations()

    def draws(self, count: int = 4000, seed: int = 0) -> Any:
        """Draws of the parameters that the repeats share, not of single recordings. See ``Uncertainty.draws``."""
        from ..statistics.draws import Draws, checked_count

        random = np.random.default_rng(random_seed(seed))
        return Draws(self.uncertainty.draws(checked_count(count), random), {}, (), ("layered fit",))

    def _speed_factor(self, recording: Recording) -> float:
        """Factor of the model's forces at the speed of a recording's insertion."""
        exponent, strokes = self.parameters.get("speed_exponent"), cycles(recording.time, recording.depth)
        if exponent is None or not strokes:
            return 1.0
        inwards = slice(strokes[0].start, strokes[0].stop)
        speed = stroke_speed(recording.time[inwards], recording.depth[inwards])
        return (speed / self.settings.speed_m_s) ** exponent.value


def identify_layered(
    singles: list[SegmentedRecording],
    name: str,
    given: FitInputs,
    layers: int | None,
    progress: Callable | None = None,
    grown: Grown | None = None,
) -> Fit:
    """The layered fit of segmented recordings; ``layers`` is their number, None selects it by the evidence.

    ``progress(iterable, text)`` wraps the stages. Recordings without contact keep their status and are not fitted. A
    puncture is not needed: a withdrawal shows as much. Calls with the same recordings may share ``grown``. A
    stiffness that is ``given`` needs ``layers``.
    """
    usable = [single for single in singles if single.events.contact is not None]
    if not any(single.events.punctures or single.events.spans(Phase.extraction) for single in usable):
        return _without_model(singles, name)
    pairs, form = [(single.recording, single.events) for single in usable], LAYERED[name]
    grown, count = {} if grown is None else grown, layers or MAX_LAYERS
    work = _searched(usable, form, count, grown)
    solved = list(_watched(work, count, progress, "layer by layer"))
    tried, best = _evidence([with_known(solved[-1], given.stiffness)] if layers else solved, progress)
    work = _watched(_ended(best.solved, pairs), 2, progress, "with short bins")
    ended, population = next(work), next(work)
    found = ruptures(ended)
    own = {single: _recording(single, run, ended, given) for run, single in enumerate(usable)}
    misfit, undecided = misfit_of(ended, own), undecided_saturations(best.solved)
    known = replace(uncertainty_of(ended), undecided=undecided)
    parameters = known.estimates()
    model, trouble = _model(ended, found, given, usable)
    recordings = tuple(own.get(single) or unfitted(single) for single in singles)
    fit = LayeredFit(
        recordings=recordings,
        parameters=parameters,
        identified_model=model,
        quality=pooled_quality(recordings),
        warnings=(*warnings_of(singles, model), *trouble, *warnings_on(ended, recordings, misfit)),
        held_fixed=held_fixed(ended),
        unknown=(
            *not_identified(ended, parameters, known.undetermined, found),
            *(() if misfit.found else known.correlations().sentences()),  # of intervals that hold nothing
        ),
        choice=tuple(Choice(each.name, each.bic) for each in sorted(tried, key=lambda each: each.bic)),
        settings=layered_settings(best, tried, settings_of("cone_cylinder", given.needle, singles)),
        ruptures=found,
        expectation=None if model is None else with_stiffness(expectation(ended, found, population), ended),
        uncertainty=known,
        population=None if population is None else _model(population, None, given, usable)[0],
        population_contact=MM * float((population or ended).x[TOP]),
        surface=MM * float(ended.x[TOP]),
        held_out=tuple(_held_out(*each) for each in zip(best.others, best.solved.problem.cycles, usable)),
    )
    # without misfit, all but what only the law states; with it, no interval is known to hold that of the tissue
    unknown = parameters if misfit.found else behind_hidden(found)
    return with_not_identifiable(fit, [each for each in unknown if each not in known.known])


def _searched(usable: list[SegmentedRecording], form: str, count: int, grown: Grown) -> Iterator[Solved]:
    """The fits with 1, 2, … ``count`` layers in a form, of which ``grown`` keeps each."""
    ids = tuple(map(id, usable))
    if (form, ids) not in grown:
        cycles = binned_cycles([(single.recording, single.events) for single in usable], COARSE[form])
        if form == "as_fitted":
            grown[form, ids] = grow(cycles, count)
        else:
            grown[form, ids] = made_passive(_searched(usable, "as_fitted", count, grown), count, form, cycles)
    grown[form, ids], found = itertools.tee(grown[form, ids])
    return found


def _ended(solved: Solved, pairs: list[tuple[Recording, Events]]) -> Iterator[Solved | None]:
    """The fit with short bins, then the population fit, for which at least two runs are needed."""
    fine, between = (binned_cycles(pairs, bins) for bins in (FINE, BETWEEN))
    ended = refined_with(solved, fine) if solved.problem.known else refined(solved, fine, between)
    yield ended
    yield population_fit(ended) if len(fine) > 1 else None


def _held_out(others: Solved, cycle: BinnedCycle, single: SegmentedRecording) -> np.ndarray:
    """Force (n,) [N] along a recording by the fit to the others; ``cycle`` has its speed."""
    return expectation(others).force(_path(single.recording), factor=others.problem.speed_factor(cycle, others.x))


def _path(recording: Recording) -> Path:
    """Depths (n,) [m] of a recording and the steps (n,) [s] before them."""
    dt = np.diff(recording.time, prepend=recording.time[0] - 1.0 / recording.rate)
    return np.ascontiguousarray(recording.depth, float), dt


def _watched(work: Iterable, count: int, progress: Callable | None, text: str) -> Iterator:
    """Work that is done lazily, with a progress bar for a known count."""
    items = iter(work)
    for _ in progress(range(count), text) if progress else range(count):
        yield next(items)


def _evidence(solved: list[Solved], progress: Callable | None) -> tuple[list[Candidate], Candidate]:
    """Every candidate, and the chosen one: first the number of layers, then mechanisms that can be removed."""
    work = on_all_cores(lambda each: candidate(layers_in_words(each), each), solved)
    tried = list(_watched(work, len(solved), progress, "predicting held-out repeats"))
    best = fewest_layers(with_bic(tried))
    less, count = removable(best.solved.problem.unknowns), len(tried)
    without_one = lambda item: candidate(f"{best.name}, {item[0]}", without(best.solved, item[1]))  # noqa: E731
    work = on_all_cores(without_one, less.items())
    tried = with_bic([*tried, *_watched(work, len(less), progress, "removing mechanisms")])
    complete = next(each for each in tried if each.name == best.name)
    return tried, fewest_mechanisms(complete, tried[count:])


def _model(
    solved: Solved, found: Ruptures | None, given: FitInputs, usable: list[SegmentedRecording]
) -> tuple[Model | None, tuple[str, ...]]:
    """The model with the mean ruptures, or None and the reason."""
    depth = MM * solved.problem.unknowns.punctures(solved.x).mean(axis=0) if found is None else found.depth
    try:
        return model_of(solved, depth, given.needle, reference_of(usable)), ()
    except InputError as error:
        return None, (NO_MODEL.format(error),)


def _recording(single: SegmentedRecording, run: int, solved: Solved, given: FitInputs) -> RecordingFit:
    """The result of one recording with its own ruptures along its own motion."""
    base, own = unfitted(single), own_ruptures(solved, run)
    punctures = np.array([estimate.value for estimate in own.values()])
    own["force_offset"] = zero = solved.problem.zero(run, solved.x)
    try:
        model = model_of(solved, punctures, given.needle)
    except InputError as error:
        return replace(base, parameters=own, notes=(*base.notes, str(error)))
    surface = MM * float(solved.x[TOP])
    problem, cycle = solved.problem, solved.problem.cycles[run]
    factor = (cycle.speed / problem.speed) ** solved.x[problem.unknowns.speed]
    predicted = factor * run_model(model, single.recording, surface, single.depth)
    predicted += zero.value + cycle.zero.drift.at(single.recording)
    cycle, _ = cycle_span(single.strokes, single.events)
    residual = quality(single.recording.force[cycle], predicted[cycle])
    return replace(base, parameters=own, quality=residual, predicted=predicted)


def _without_model(singles: list[SegmentedRecording], name: str) -> Fit:
    note = f"The model {name} needs a puncture or a withdrawal in at least one recording."
    recordings = tuple(
        replace(each, notes=(*each.notes, note)) if each.status in (Status.no_puncture, Status.incomplete) else each
        for each in map(unfitted, singles)
    )
    settings = settings_of("cone_cylinder", None, singles)
    return Fit(recordings=recordings, warnings=warnings_of(singles, None), settings=settings)
