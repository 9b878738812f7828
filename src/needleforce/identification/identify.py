# SPDX-License-Identifier: Apache-2.0
"""From recordings to an identified model."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..recording import Recording
from ..vocabulary import Status
from .bench_tests import needle_estimate, tissue_estimate
from .derived import derived
from .estimates import Estimate, Quality, estimates_of
from .fit import Fit, RecordingFit, run_model
from .laws_from_log import MODELS, UNKNOWN_TIP, model_of, needle_saturation, stiffness_law
from .limits import crossed, lateral_ratio
from .peak import measured_peak
from .pooling import mean_estimate, pool
from .single import Single, fit_single
from .subtraction import subtract
from .turning import presliding_of

Progress = Callable[[Any, str], Any]
TWO_PASS = "second insertion at the same site"


def identify(
    recordings: Recording | Sequence[Recording],
    *,
    second_pass: Sequence[Recording] | Recording = (),
    model: str | None = None,
    needle=None,
    bending=None,
    tension=None,
    progress: Progress | None = None,
) -> Fit:
    """Identifies one condition from one recording or from several repeats of it. No starting values.

    ``second_pass`` holds, in the same order, the second insertion at each site: friction then comes from it and
    cutting from the subtraction, as in the paper. ``model`` is a name that ``MODELS`` lists; None takes the one with
    the lower BIC. With ``needle`` (and its tip) the reduced modulus follows. ``bending`` and ``tension`` are CSV
    tables of the paper's two bench tests: the needle's modulus (needs ``needle``) and the tissue's.
    ``progress(iterable, text)`` wraps the work over recordings.

    A recording that cannot answer is kept with its status and does not stop the rest. Raises InputError for an unknown
    model or second passes that do not pair with the recordings.
    """
    recordings, seconds = _listed(recordings), _listed(second_pass)
    _paired(recordings, seconds)
    bench = _bench(bending, tension, needle)
    if "needle_young_modulus" in bench:
        needle = needle.replace(young_modulus=bench["needle_young_modulus"].value)
    laws = tuple(MODELS.values()) if model is None else (stiffness_law(model),)
    saturation = needle_saturation(needle)
    watched = progress(recordings, "identifying") if progress else recordings
    singles = [fit_single(each, laws, saturation) for each in watched]
    choice = _choice(singles, laws)
    law = choice[0][0] if choice else laws[0]
    return _assemble(singles, law, choice, seconds, needle, saturation, bench)


def _assemble(singles, law, choice, seconds, needle, saturation, bench) -> Fit:
    answering = [single for single in singles if law in single.fits]
    own = [_own(single, law) for single in answering]
    parameters, two_pass = pool(own), None
    if seconds and answering:
        pairs = [second for single, second in zip(singles, seconds, strict=True) if law in single.fits]
        two_pass, replaced = _two_pass(answering, own, pairs)
        parameters |= replaced
    if parameters:
        parameters |= derived(parameters, needle, bench.get("tissue_young_modulus")) | bench
    model = _model(parameters, law, saturation, needle, singles)
    fits = iter(own)
    told = tuple(_recording_fit(single, next(fits) if law in single.fits else {}, needle) for single in singles)
    return Fit(
        told,
        parameters,
        model,
        _pooled_quality(told),
        _warnings(singles, model),
        _held_fixed(needle, law, saturation),
        _unknown(needle, bench, bool(seconds)),
        choice,
        _settings(law, needle, singles),
        two_pass,
    )


def _own(single: Single, law: str) -> dict[str, Estimate]:
    """The estimates of one recording; its puncture force is the measured one."""
    fit, strokes = single.fits[law], single.strokes
    before, puncture = fit.samples_before_puncture, fit.values["puncture_depth"]
    peak = measured_peak(strokes.depth_in, strokes.force_in, before, fit.left_out, puncture)
    found = estimates_of(fit, len(strokes.depth_out) > 0) | ({} if peak is None else {"puncture_force": peak})
    return found | ({} if strokes.turning is None else {"presliding": presliding_of(strokes.turning)})


def _listed(recordings) -> list[Recording]:
    return [recordings] if isinstance(recordings, Recording) else list(recordings)


def _paired(recordings: list, seconds: list) -> None:
    from ..errors import InputError

    if not recordings:
        raise InputError("recordings", "none", "nothing to identify", next_step="Give at least one recording.")
    if seconds and len(seconds) != len(recordings):
        raise InputError(
            "second passes",
            len(seconds),
            f"do not pair with {len(recordings)} recordings",
            next_step="Give one second pass for each recording, in the same order.",
        )


def _bench(bending, tension, needle) -> dict[str, Estimate]:
    from ..errors import InputError

    if bending is not None and needle is None:
        raise InputError(
            "needle", "missing", "the bending test needs its section and length", next_step="Give the needle."
        )
    found = [needle_estimate(bending, needle)] if bending is not None else []
    found += [tissue_estimate(tension)] if tension is not None else []
    return {estimate.name: estimate for estimate in found}


def _choice(singles: list[Single], laws: tuple[str, ...]) -> tuple[tuple[str, float], ...]:
    """Each law with the BIC of its loading curves, summed over the recordings that all laws fit, the best first."""
    common = [single for single in singles if set(laws) <= set(single.fits)]
    if not common:
        present = [law for law in laws if any(law in single.fits for single in singles)]
        return tuple((law, float("nan")) for law in present)
    return tuple(sorted(((law, float(sum(s.bic[law] for s in common))) for law in laws), key=lambda pair: pair[1]))


def _two_pass(answering, own, seconds):
    contact = [estimates["contact_depth"].value for estimates in own]
    puncture = [estimates["puncture_indentation"].value for estimates in own]
    two_pass = subtract(answering, seconds, contact, puncture)
    friction = mean_estimate(
        "friction_per_length",
        [site.friction_slope for site in two_pass.sites],
        "N/m",
        f"{TWO_PASS}, least squares with intercept",
    )
    cutting = mean_estimate(
        "cutting_force",
        [site.cutting for site in two_pass.sites],
        "N",
        f"first minus {TWO_PASS}" + (", an upper bound" if two_pass.upper_bound else ""),
    )
    cutting = dataclasses.replace(cutting, identifiable=not two_pass.upper_bound)
    return two_pass, {"friction_per_length": friction, "cutting_force": cutting}


def _model(parameters, law, saturation, needle, singles):
    """The pooled model; None where a value lies outside what a law takes."""
    from ..errors import InputError

    if not parameters:
        return None
    values = {name: estimate.value for name, estimate in parameters.items()}
    if law == "cone_cylinder" and saturation is not None:
        values["saturation_depth"] = saturation
    sources = ", ".join(single.recording.card.source for single in singles[:3]) + (" ..." if len(singles) > 3 else "")
    try:
        return model_of(values, needle, name=f"identified_{law}", reference=f"identified by needleforce from {sources}")
    except InputError:
        return None


def _recording_fit(single: Single, own: dict[str, Estimate], needle) -> RecordingFit:
    from ..errors import InputError

    notes = single.notes + tuple(note.message for note in single.recording.notes)
    base = RecordingFit(single.recording.card.source, single.status, single.recording, single.events, own, notes=notes)
    if not own:
        return base
    try:
        model = model_of({name: estimate.value for name, estimate in own.items()}, needle)
    except InputError as error:
        return dataclasses.replace(base, notes=(*notes, f"These values make no model: {error}"))
    predicted = run_model(model, single.recording, own["contact_depth"].value)
    inside = single.strokes.mask(len(predicted))
    return dataclasses.replace(
        base, predicted=predicted, quality=_quality(single.recording.force[inside], predicted[inside])
    )


def _quality(force: np.ndarray, predicted: np.ndarray) -> Quality:
    residual = float(np.mean((force - predicted) ** 2))
    rmse = float(np.sqrt(residual))
    return Quality(rmse, rmse / float(np.max(np.abs(force))), 1.0 - residual / float(np.var(force)))


def _pooled_quality(recordings: tuple[RecordingFit, ...]) -> Quality | None:
    known = [each.quality for each in recordings if each.quality is not None]
    if not known:
        return None
    return Quality(
        float(np.sqrt(np.mean([q.rmse_N**2 for q in known]))),
        float(np.sqrt(np.mean([q.nrmse**2 for q in known]))),
        float(np.mean([q.r2 for q in known])),
    )


def _warnings(singles: list[Single], model) -> tuple[str, ...]:
    found = [sentence for single in singles for sentence in crossed(single)]
    found += [] if model is None else list(model.warnings)
    return tuple(dict.fromkeys(found))


def _held_fixed(needle, law: str, saturation: float | None) -> tuple[str, ...]:
    if needle is None or needle.tip is None:
        return (UNKNOWN_TIP,)
    held = [f"tip: a cone of half angle {np.degrees(needle.tip.half_angle):.3g} degrees, as given"]
    if law == "cone_cylinder":
        held.append(f"saturation depth: {1e3 * saturation:.3g} mm, from tip and shank radius")
    return tuple(held)


def _unknown(needle, bench: dict, two_pass: bool) -> tuple[str, ...]:
    """What these logs cannot tell, whatever their number."""
    said = ["Poisson ratio of the tissue: a log tells only the reduced modulus, and that only with the tip's angle."]
    if needle is None:
        said.append("Reduced modulus: a log tells its product with the tangent of the tip's half angle.")
    if "tissue_young_modulus" not in bench:
        said.append(
            "Friction coefficient: it needs the tissue's modulus and the needle's section; a log tells "
            "friction per length."
        )
    if not two_pass:
        said.append(
            "Cutting force apart from the depth at which embedded length begins: both shift the force by a constant."
        )
    return tuple(said)


def _settings(law: str, needle, singles: list[Single]) -> dict[str, object]:
    ratios = [lateral_ratio(single) for single in singles]
    known = [ratio for ratio in ratios if np.isfinite(ratio)]
    return {
        "stiffness_law": law,
        "needle": None if needle is None else repr(needle),
        "repeats": len(singles),
        "answering": sum(single.status in (Status.ok, Status.incomplete) and bool(single.fits) for single in singles),
        "lateral_over_axial_force": float(np.median(known)) if known else None,
    }
