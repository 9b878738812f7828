# SPDX-License-Identifier: Apache-2.0
"""From repeats to an identified layered model."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

import numpy as np

from ...errors import InputError
from ...models.model import Model
from ...vocabulary import Status
from ..diagnostics import NO_MODEL, FitInputs, pooled_quality, quality, reference_of, settings_of, warnings_of
from ..models import LAYERED, run_model
from ..one_layer.fit_recording import SegmentedRecording
from ..recording_fit import RecordingFit
from ..result import Choice, Fit
from ..strokes import cycle_span
from . import diagnostics
from .binned_cycle import COARSE, FINE, BinnedCycle, binned_cycles
from .model import Ruptures, model_of, own_ruptures, ruptures
from .model_selection import Candidate, candidate, chosen, removable, with_bic, without
from .parameters import MM, TOP
from .result import LayeredFit
from .search import Solved, grow, made_passive, of_the_population, refined
from .uncertainty import uncertainty_of

MAX_LAYERS = 3


def identify_layered(
    singles: list[SegmentedRecording], name: str, given: FitInputs, layers: int | None, progress: Callable | None = None
) -> Fit:
    """The layered law from recordings that are segmented; ``layers`` fixes their number, None asks the evidence.

    ``progress(iterable, text)`` wraps the stages. Recordings without contact keep their status and take no part; one
    that never punctures takes part where others do.
    """
    usable = [single for single in singles if single.events.contact is not None]
    pierced = any(single.events.punctures for single in usable)
    if not pierced:
        return _without_model(singles, name)
    coarse, fine = (binned_cycles([(s.recording, s.events) for s in usable], bins) for bins in (COARSE, FINE))
    solved = list(_watched(grow(coarse, layers or MAX_LAYERS), layers or MAX_LAYERS, progress, "layer by layer"))
    if LAYERED[name]:
        solved = list(made_passive(solved))
    tried, best = _evidence(solved[-1:] if layers else solved, progress)
    work = _watched(_ended(best.solved, fine), 2, progress, "in short steps")
    ended, population = next(work), next(work)
    found, known = ruptures(ended), uncertainty_of(ended)
    parameters = known.estimates()
    model, trouble = _model(ended, found, given, usable)
    own = {single: _recording(single, run, ended, given) for run, single in enumerate(usable)}
    recordings = tuple(own.get(single) or _without_values(single) for single in singles)
    return LayeredFit(
        recordings=recordings,
        parameters=parameters,
        model=model,
        quality=pooled_quality(recordings),
        warnings=(*warnings_of(singles, model, one_layer=False), *trouble, *diagnostics.warnings(ended, recordings)),
        held_fixed=diagnostics.held_fixed(ended),
        unknown=(*diagnostics.unknown(ended, parameters), *known.correlations().sentences()),
        choice=tuple(Choice(each.name, each.bic) for each in sorted(tried, key=lambda each: each.bic)),
        settings=diagnostics.settings_of(best, tried, settings_of("cone_cylinder", given.needle, singles)),
        ruptures=found,
        uncertainty=known,
        population=None if population is None else _model(population, ruptures(population), given, usable)[0],
        population_contact=MM * float((population or ended).x[TOP]),
    )


def _ended(solved: Solved, fine: tuple[BinnedCycle, ...]) -> Iterator[Solved | None]:
    """The fit in short steps, then that of the population, for which two runs at least are needed."""
    ended = refined(solved, fine)
    yield ended
    yield of_the_population(ended) if len(fine) > 1 else None


def _watched(work: Iterable, count: int, progress: Callable | None, text: str) -> Iterator:
    """Work that is done as it is asked for, behind a bar that knows its count."""
    items = iter(work)
    for _ in progress(range(count), text) if progress else range(count):
        yield next(items)


def _evidence(solved: list[Solved], progress) -> tuple[list[Candidate], Candidate]:
    """Every candidate, and the one taken: first the number of layers, then what can be left away."""
    shown = progress or (lambda work, _: work)
    tried = [candidate(diagnostics.layers(each), each) for each in shown(solved, "leaving repeats out")]
    best = chosen(with_bic(tried))
    less = removable(best.solved.problem.unknowns)
    for what, values in shown(list(less.items()), "leaving mechanisms out"):
        tried.append(candidate(f"{best.name}, {what}", without(best.solved, values)))
    tried = with_bic(tried)
    return tried, chosen(tried)


def _model(
    solved: Solved, found: Ruptures, given: FitInputs, usable: list[SegmentedRecording]
) -> tuple[Model | None, tuple[str, ...]]:
    """The model at the mean ruptures, or None and why."""
    try:
        return model_of(solved, found.depth, given.needle, reference_of(usable)), ()
    except InputError as error:
        return None, (NO_MODEL.format(error),)


def _without_values(single: SegmentedRecording) -> RecordingFit:
    """One recording as it was segmented, without parameters."""
    notes = single.notes + tuple(note.message for note in single.recording.notes)
    return RecordingFit(
        file=single.recording.card.source,
        status=single.status,
        recording=single.recording,
        events=single.events,
        notes=notes,
    )


def _recording(single: SegmentedRecording, run: int, solved: Solved, given: FitInputs) -> RecordingFit:
    """One recording's outcome with its own ruptures along its own motion."""
    base, own = _without_values(single), own_ruptures(solved, run)
    punctures = np.array([estimate.value for estimate in own.values()])
    try:
        model = model_of(solved, punctures, given.needle)
    except InputError as error:
        return replace(base, parameters=own, notes=(*base.notes, str(error)))
    surface = MM * float(solved.x[TOP])
    problem, cycle = solved.problem, solved.problem.cycles[run]
    factor = (cycle.speed / problem.speed) ** solved.x[problem.unknowns.speed]
    predicted = factor * run_model(model, single.recording, surface)
    cycle, _ = cycle_span(single.strokes, single.events)
    residual = quality(single.recording.force[cycle], predicted[cycle])
    return replace(base, parameters=own, quality=residual, predicted=predicted)


def _without_model(singles: list[SegmentedRecording], name: str) -> Fit:
    said = f"The model {name} needs a puncture in one recording at least."
    recordings = tuple(
        replace(each, notes=(*each.notes, said)) if each.status is Status.no_puncture else each
        for each in map(_without_values, singles)
    )
    settings = settings_of("cone_cylinder", None, singles)
    return Fit(recordings=recordings, warnings=warnings_of(singles, None), settings=settings)
