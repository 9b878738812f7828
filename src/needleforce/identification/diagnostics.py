# SPDX-License-Identifier: Apache-2.0
"""What an identification reports next to its values: quality, warnings, exceeded limits, noise, what was held fixed,
what cannot be identified."""

import dataclasses
import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from .. import core
from ..core import Needle
from ..errors import InputError
from ..mechanics.buckling import equivalent_half_angle
from ..models.model import Model
from ..models.validity import FRICTION_LIMIT
from ..segmentation import Events
from ..segmentation.doubtful import SATURATED
from ..segmentation.strokes import white_noise
from ..vocabulary import Phase
from .estimates import Estimate, Quality
from .models import UNKNOWN_TIP, model_of, run_model
from .one_layer.fit_recording import peak_force
from .one_layer.loading_curves import FITS
from .one_layer.segmented_recording import SegmentedRecording
from .recording_fit import RecordingFit
from .repeats import differing_repeats
from .settings import FitSettings
from .statistics.noise import SIGNIFICANT, noise_words
from .timing import late_words

NO_MODULUS = "Modulus and Poisson ratio of the tissue: the law {} has no modulus. Give --model paper, or cone_cylinder."
NO_MODEL = "No model can be made of the identified values: {}"
MAX_LATERAL_RATIO = 0.1  # [of the axial force] beyond, the paper's neglect of lateral forces is not justified
ACROSS = ("fx", "fy", "tx", "ty", "tz")
REPEATS = 69  # values in a row of an axis that does not repeat two of three: one in 10^12
MAX_RESIDUAL = 0.05  # [of the peak force] beyond, the misfit is in every number
MAX_RELAXATION = 0.1  # [of the force early in the hold] beyond, the tissue is viscous
MAX_SMEARING = 0.02  # [of the indentation] travel within the filter's length; beyond, the loading curve is rounded
MAX_NOISE_RATIO = 1.2  # of a residual: beyond, the model is in error too
MIN_HOLD_S = 1.0  # [s] a shorter hold is the reversal between the strokes
TIMING = (
    "Force and depth of a recording are not of the same instant, or its filter is not the declared one: see its notes. "
    "The intervals of a model of one layer hold the values with and without that."
)
SYSTEMATIC = (
    "Narrower intervals by more repeats: most of these intervals is systematic, an error that the repeats share and "
    "that stays in their mean: {}."
)
MODEL_ERRORS = {
    "law": "the choice of the loading law",
    "lag": "a lag between force and depth",
    "shorter lag": "a lag between force and depth",
    "filter": "a filter that is not declared",
    "slow misfit": "slow misfit below the puncture",
    "slower misfit": "slow misfit below the puncture",
    "insertion": "strokes that disagree",
    "withdrawal": "strokes that disagree",
    "time": "friction or a gain that changes with time",
    "bend": "a bent insertion",
    "drop": "a puncture off the fall of the force",
    "rounding": "the rounding of the zero",
    "stiffer machine": "the machine stiffness",
    "softer machine": "the machine stiffness",
    "machine": "a machine in series that may be there",
}
NO_CAUSE = "steps of depth, force or time"


@dataclass(frozen=True, eq=False)
class FitInputs:
    """Inputs in addition to the recordings: the needle, its saturation depth [m] or None, bench tests by name, and the
    stiffnesses of layers that are known beforehand."""

    needle: Needle | None
    saturation: float | None
    bench: dict[str, Estimate]
    stiffness: tuple = ()


def reference_of(singles: list[SegmentedRecording]) -> str:
    """Reference of a model: the file names of the first recordings."""
    sources = ", ".join(single.recording.name for single in singles[:3])
    return f"identified by needleforce from {sources}" + (" ..." if len(singles) > 3 else "")


def unfitted(single: SegmentedRecording) -> RecordingFit:
    """One recording as it was segmented, without parameters."""
    return RecordingFit(
        file=single.recording.place,
        status=single.status,
        recording=single.recording,
        events=single.events,
        notes=single.notes + tuple(note.message for note in single.recording.notes),
    )


def recording_fit(
    single: SegmentedRecording, own: dict[str, Estimate], law: str, needle: Needle | None, refused: str
) -> RecordingFit:
    """The result of one recording with its own model along its own motion; ``refused`` is a note on its second pass."""
    of_law = single.law_notes.get(law, ())
    notes = (
        *(single.notes + of_law if own else of_law + single.notes),  # the reason first
        *((refused,) if refused else ()),
        *(note.message for note in single.recording.notes),
    )
    base = dataclasses.replace(unfitted(single), parameters=own, notes=notes)
    if not own:
        return base
    base = dataclasses.replace(base, cycle=single.fits[law], strokes=single.strokes)
    try:
        model = model_of({name: estimate.value for name, estimate in own.items()}, law, needle)
    except InputError as error:
        return dataclasses.replace(base, notes=(*notes, NO_MODEL.format(error)))
    zero = own["force_offset"].value + single.drift.at(single.recording)
    predicted = run_model(model, single.recording, own["contact_depth"].value, single.depth) + zero
    inside = single.strokes.mask(len(predicted))
    residual = quality(single.recording.force[inside], predicted[inside], single.strokes.reversing(inside))
    return dataclasses.replace(base, predicted=predicted, quality=residual)


def quality(force: np.ndarray, predicted: np.ndarray, reversing: np.ndarray | None = None) -> Quality:
    """Residual of the predicted force against the measured one, (n,) [N] each, also by whether friction is
    ``reversing`` (n,)."""
    left, about = force - predicted, force - force.mean()
    residual, variance = core.product(left, left) / len(force), core.product(about, about) / len(force)
    rmse, peak = math.sqrt(residual), max(float(force.max()), -float(force.min()))
    found = Quality(rmse, rmse / peak, 1.0 - residual / variance)
    if reversing is None or not reversing.any() or reversing.all():
        return found
    turning = left[reversing]
    squares = core.product(turning, turning)
    sliding = math.sqrt(max(residual * len(left) - squares, 0.0) / (len(left) - len(turning)))
    return dataclasses.replace(found, sliding_N=sliding, reversal_N=math.sqrt(squares / len(turning)))


def misfit_warning(found: Quality | None) -> tuple[str, ...]:
    """A sentence if the residual is more than 5 % of the peak force."""
    if found is None or not found.nrmse > MAX_RESIDUAL:
        return ()
    peak = found.rmse_N / found.nrmse
    if found.sliding_N <= MAX_RESIDUAL * peak:
        return (
            f"The residual is {found.nrmse:.0%} of the peak force, but {found.sliding_N / peak:.1%} without the "
            "reversal of friction at the start of the withdrawal: presliding is not that of these recordings.",
        )
    return (
        f"The residual is {found.nrmse:.0%} of the peak force (R² {found.r2:.2f}): the model does not describe these "
        "recordings well, and the intervals do not include its errors.",
    )


def pooled_quality(recordings: tuple[RecordingFit, ...]) -> Quality | None:
    """Root mean square of the recordings' residuals, mean of R²; None where no recording has a model."""
    known = [each.quality for each in recordings if each.quality is not None]
    if not known:
        return None
    names = ("rmse_N", "nrmse", "sliding_N", "reversal_N")
    pooled = {name: float(np.sqrt(np.mean([getattr(each, name) ** 2 for each in known]))) for name in names}
    return Quality(r2=float(np.mean([each.r2 for each in known])), **pooled)


def warnings_of(singles: list[SegmentedRecording], model: Model | None, law: str = "") -> tuple[str, ...]:
    """Limits that a recording or the model exceeds, each once; some apply only to a model of one layer, with a
    ``law``."""
    found = [*differing_repeats(singles)]
    found += [sentence for single in singles for sentence in exceeded_limits(single, law)]
    found += [] if model is None else list(model.warnings)
    return tuple(dict.fromkeys(found))


def held_fixed(given: FitInputs, law: str, parameters: dict[str, Estimate]) -> tuple[str, ...]:
    """What was assumed and not identified."""
    if not parameters:
        return ()
    held = [
        "embedded length: measured from the undeformed surface, as in the paper; another origin would change the "
        "cutting force"
    ]
    held.append("unloading of the cutting force: over the travel in which friction reverses")
    if not FITS[law].gives_modulus:
        return tuple(held)
    if given.needle is None or given.needle.tip is None:
        return (UNKNOWN_TIP, *held)
    angle = np.degrees(equivalent_half_angle(given.needle.tip))
    held.insert(0, f"tip: a cone of half angle {angle:.3g} degrees, as given")
    if "saturation_depth" in parameters:
        held.append(f"saturation depth: {1e3 * given.saturation:.3g} mm, from tip and shank radius")
    return tuple(held)


def modulus_note(needle: Needle | None, law: str, parameters: dict[str, Estimate]) -> tuple[str, ...]:
    """A sentence that the law has no modulus though the tip is given; or with the modulus by each reading of a bevel as
    a cone, which recordings cannot tell apart."""
    modulus, tip = parameters.get("reduced_modulus"), None if needle is None else needle.tip
    if tip is not None and parameters and not FITS[law].gives_modulus:
        return (NO_MODULUS.format(law),)
    if modulus is None or "equivalence" not in getattr(tip, "parts", ()):
        return ()
    slopes = {word: math.tan(equivalent_half_angle(tip.replace(equivalence=word))) for word in core.tips.equivalences}
    scale = 1e-3 * modulus.value * slopes[tip.equivalence]
    moduli = ", ".join(f"{word} {scale / slope:.4g} kPa" for word, slope in slopes.items())
    return (f"The modulus depends on which cone the bevel is read as, here {tip.equivalence}: {moduli}.",)


def unknown(given: FitInputs, law: str, two_pass: bool) -> tuple[str, ...]:
    """What more recordings of this kind would not identify either."""
    sentences = [
        "Poisson ratio of the tissue: recordings identify only the reduced modulus, and that only if the tip's angle "
        "is known."
    ]
    if not FITS[law].gives_modulus:
        sentences = [NO_MODULUS.format(law)]
    elif given.needle is None:
        sentences.append(
            "Reduced modulus: only its product with the tangent of the tip's half angle is identified. Give the needle "
            "with its tip."
        )
    if "tissue_young_modulus" not in given.bench:
        sentences.append(
            "Friction coefficient: recordings identify friction per length; the coefficient also needs the needle's "
            "section and the tissue's modulus from a tension test."
        )
    if not two_pass:
        sentences.append(
            "Cutting force separately from the depth where the embedded length begins: both shift the force by a "
            "constant. A second insertion at the same site gives the cutting force."
        )
    return tuple(sentences)


def not_narrowed(parameters: dict[str, Estimate], recordings: Iterable[RecordingFit]) -> tuple[str, ...]:
    """A sentence on the estimates whose interval more repeats would not narrow, with the errors of the model that are
    in it."""
    causes = [cause for each in recordings if each.cycle is not None for cause in each.cycle.causes.items()]
    found: dict[str, list[str]] = {}
    for name, estimate in parameters.items():
        if estimate.systematic_share == "most":
            by = dict.fromkeys(MODEL_ERRORS[cause] for cause, moved in causes if moved.get(name))
            found.setdefault(" and ".join(by) or NO_CAUSE, []).append(name)
    named = "; ".join(f"{', '.join(names)} ({by})" for by, names in found.items())
    return (SYSTEMATIC.format(named),) if named else ()


def settings_of(law: str, needle: Needle | None, singles: list[SegmentedRecording]) -> FitSettings:
    """How the identification was run: its law, its recordings, and the noise model of the intervals."""
    known = [ratio for ratio in map(lateral_ratio, singles) if np.isfinite(ratio)]
    return FitSettings(
        stiffness_law=FITS[law].law.name,
        needle=None if needle is None else repr(needle),
        repeats=len(singles),
        answering=sum(bool(single.fits) for single in singles),
        lateral_over_axial_force=float(np.median(known)) if known else None,
        noise=noise_words(
            noise for single in singles if law in single.fits for noise in single.fits[law].residuals.noises
        ),
    )


def exceeded_limits(single: SegmentedRecording, law: str = "") -> list[str]:
    """A sentence for each limit that one recording exceeds; a layered model, without a ``law``, includes layers,
    relaxation and what is deep."""
    found = [_saturated(single), _frozen(single), _lateral(single)]
    found += [late_words(single.timing.late)] if single.timing.late else []
    found += [TIMING] if single.timing.notes else []
    found += [_deep(single, law), _smeared(single, law)] if law in single.fits else []
    found += [_layers(single.events), _relaxation(single)] if law else []
    return [sentence for sentence in found if sentence]


def is_saturated(events: Events) -> bool:
    """Whether the force stands at its maximum where the travel would have raised it further."""
    return any(note.endswith(SATURATED) for note in events.notes)


def _saturated(single: SegmentedRecording) -> str:
    if not is_saturated(single.events):
        return ""
    return (
        f"{single.recording.name}: its force is cut off at {peak_force(single):.4g} N, the sensor may be saturated: a "
        "larger force is a lower bound there, and what is pooled with it is too low. Leave it out of the repeats."
    )


def _layers(events: Events) -> str:
    if len(events.punctures) < 2:
        return ""
    return (
        "There is more than one puncture, so the specimen has layers: a one-layer model does not describe the force "
        "below the first. Use the model layered."
    )


def _relaxation(single: SegmentedRecording) -> str:
    holds = single.events.spans(Phase.hold)
    peak = peak_force(single)
    if not holds or peak <= 0 or holds[0].end - holds[0].start < MIN_HOLD_S:
        return ""
    force = single.recording.force[holds[0].first : holds[0].last]
    tenth = max(len(force) // 10, 1)
    # the ends of a hold belong to the braking before it and to the start of the withdrawal
    early, late = force[tenth : 2 * tenth], force[-3 * tenth : -2 * tenth]
    fall = 1.0 - float(np.mean(late)) / float(np.mean(early) or np.nan)
    if not fall > MAX_RELAXATION:
        return ""
    return "The force relaxes by more than 10 % during the hold: the tissue is viscous, which this model omits."


def _smeared(single: SegmentedRecording, law: str) -> str:
    recording = single.recording
    if recording.card.filter_length == 1:
        return ""
    travel = float(np.abs(recording.velocity).max()) * recording.card.filter_length / recording.rate
    if travel <= MAX_SMEARING * single.fits[law].values["puncture_indentation"]:
        return ""
    return (
        "The average filter smears the force over more than 2 % of the indentation: its delay is corrected, its "
        "rounding of the loading curve is not, so the intervals of contact and stiffness are too narrow."
    )


def _frozen(single: SegmentedRecording) -> str:
    """A sentence on the axis across the needle that repeats one value more often than its noise in the free travel
    explains: normal noise of half a step repeats two of three values at most, wherever between two steps it is."""
    contact = single.events.contact
    for name in [each for each in ACROSS if contact is not None and each in single.recording.axes]:
        steps = np.abs(np.diff(single.recording.axes[name]))
        free = steps[: contact.low]
        step = float(free[free > 0.0].min(initial=np.inf))
        if len(free) < REPEATS or not float(np.mean(free**2)) > 0.5 * step**2:
            continue
        ends = np.flatnonzero(np.concatenate(([1.0], steps, [1.0])))
        counts = np.diff(ends)
        longest = int(counts.argmax())
        if counts[longest] * np.count_nonzero(free) > REPEATS * len(free):  # an axis may be logged more slowly
            since = float(single.recording.time[ends[longest]])
            return (
                f"{single.recording.name}: {name} has one value {counts[longest]} times from {since:.2f} s on: "
                "it froze, and the force across the needle is not known. The axial force is used."
            )
    return ""


def _lateral(single: SegmentedRecording) -> str:
    if not lateral_ratio(single) > MAX_LATERAL_RATIO:
        return ""
    return (
        "The lateral forces exceed 10 % of the axial force: they bend the needle, and the paper's model neglects them."
    )


def lateral_ratio(single: SegmentedRecording) -> float:
    """Largest lateral force over the largest axial one, both as the 99th percentile of the strokes; NaN without fx,
    fy."""
    axes = single.recording.axes
    if "fx" not in axes or "fy" not in axes:
        return float("nan")
    inside = single.strokes.mask(len(single.recording))
    lateral = np.hypot(axes["fx"], axes["fy"])[inside]
    axial = np.abs(single.recording.force)[inside]
    return float(np.percentile(lateral, 99) / np.percentile(axial, 99)) if len(axial) else float("nan")


def _deep(single: SegmentedRecording, law: str) -> str:
    fit = single.fits[law]
    beyond = single.strokes.depth_in - fit.values["contact_depth"] > FRICTION_LIMIT
    residual = fit.residuals.insertion
    free = residual[single.strokes.depth_in < fit.low["contact_depth"]]
    noise = max(float(np.std(free)) if len(free) else 0.0, white_noise(single.strokes.force_in))
    chance = 1.0 + SIGNIFICANT / math.sqrt(2.0 * max(np.count_nonzero(beyond), 1))
    if not beyond.any() or not math.sqrt(np.mean(residual[beyond] ** 2)) > max(MAX_NOISE_RATIO, chance) * noise:
        return ""
    return (
        "The needle goes deeper than 12 mm: there the friction measured in the paper is no longer linear in depth, and "
        "the residual is larger than the noise. Compare the model with cubic_foundation, hyperbolic_foundation and "
        "tanh_foundation."
    )
