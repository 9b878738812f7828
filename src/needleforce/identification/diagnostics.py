# SPDX-License-Identifier: Apache-2.0
"""What an identification reports next to its values: quality, warnings, limits crossed, noise, what was held fixed,
what cannot be known."""

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core import Needle
from ..errors import InputError
from ..mechanics.buckling import equivalent_half_angle
from ..models.model import Model
from ..models.validity import FRICTION_LIMIT
from ..segmentation import Events
from ..vocabulary import Phase
from .estimates import Estimate, Quality
from .models import UNKNOWN_TIP, model_of, run_model
from .one_layer.fit_recording import SegmentedRecording, peak_force
from .one_layer.loading_curves import CURVES
from .recording_fit import RecordingFit
from .result import FitSettings
from .statistics.noise import Noise

NO_MODEL = "The identified values make no model: {}"
SMALL_LATERAL = 0.1
RELAXED = 0.1
SMEARED = 0.02  # of the indentation, travelled within the filter's length
LEAST_HOLD = 1.0  # [s]; what is shorter is the turn between the strokes
WHITE = "white"
FADING = "fading over {}: long-run variance of a first-order autoregression"
WINDOWED = "correlated over {}: flat-top long-run variance"
LONG = "correlated over {}, an eighth of the stroke or more: too few independent stretches, intervals may be too narrow"


@dataclass(frozen=True, eq=False)
class FitInputs:
    """What was given beside the recordings: the needle, its saturation depth [m] or None, and bench tests by name."""

    needle: Needle | None
    saturation: float | None
    bench: dict[str, Estimate]


def reference_of(singles: list[SegmentedRecording]) -> str:
    """Where a model comes from: the first recordings by name, wherever they lie."""
    sources = ", ".join(Path(single.recording.card.source).name for single in singles[:3])
    return f"identified by needleforce from {sources}" + (" ..." if len(singles) > 3 else "")


def recording_fit(
    single: SegmentedRecording, own: dict[str, Estimate], law: str, needle: Needle | None, refused: str
) -> RecordingFit:
    """One recording's outcome with its own model along its own motion; ``refused`` is about its second pass."""
    notes = single.notes + ((refused,) if refused else ()) + tuple(note.message for note in single.recording.notes)
    base = RecordingFit(
        file=single.recording.card.source,
        status=single.status,
        recording=single.recording,
        events=single.events,
        parameters=own,
        notes=notes,
    )
    if not own:
        return base
    base = dataclasses.replace(base, cycle=single.fits[law], strokes=single.strokes)
    try:
        model = model_of({name: estimate.value for name, estimate in own.items()}, law, needle)
    except InputError as error:
        return dataclasses.replace(base, notes=(*notes, f"These values make no model: {error}"))
    predicted = run_model(model, single.recording, own["contact_depth"].value)
    inside = single.strokes.mask(len(predicted))
    residual = quality(single.recording.force[inside], predicted[inside])
    return dataclasses.replace(base, predicted=predicted, quality=residual)


def quality(force: np.ndarray, predicted: np.ndarray) -> Quality:
    """Residual of the force predicted beside the one measured, (n,) [N] each."""
    residual = float(np.mean((force - predicted) ** 2))
    rmse = float(np.sqrt(residual))
    return Quality(rmse, rmse / float(np.max(np.abs(force))), 1.0 - residual / float(np.var(force)))


def pooled_quality(recordings: tuple[RecordingFit, ...]) -> Quality | None:
    """Root mean square of the recordings' residuals, mean of R squared; None where none has a model."""
    known = [each.quality for each in recordings if each.quality is not None]
    if not known:
        return None
    rmse, nrmse = (float(np.sqrt(np.mean([x**2 for x in xs]))) for xs in zip(*((q.rmse_N, q.nrmse) for q in known)))
    return Quality(rmse, nrmse, float(np.mean([q.r2 for q in known])))


def warnings_of(singles: list[SegmentedRecording], model: Model | None, one_layer: bool = True) -> tuple[str, ...]:
    """Limits crossed by any recording or by the model, each once; some hold for a model of one layer alone."""
    found = [sentence for single in singles for sentence in crossed(single, one_layer)]
    found += [] if model is None else list(model.warnings)
    return tuple(dict.fromkeys(found))


def held_fixed(given: FitInputs, law: str, parameters: dict[str, Estimate]) -> tuple[str, ...]:
    """What was taken and not identified."""
    if not parameters:
        return ()
    held = [
        "embedded length: counted from the undeformed surface, the paper's origin; it trades against the cutting force"
    ]
    held.append("unloading of the cutting force: over the travel in which friction turns round")
    if not CURVES[law].gives_modulus:
        return tuple(held)
    if given.needle is None or given.needle.tip is None:
        return (UNKNOWN_TIP, *held)
    angle = np.degrees(equivalent_half_angle(given.needle.tip))
    held.insert(0, f"tip: a cone of half angle {angle:.3g} degrees, as given")
    if "saturation_depth" in parameters:
        held.append(f"saturation depth: {1e3 * given.saturation:.3g} mm, from tip and shank radius")
    return tuple(held)


def unknown(given: FitInputs, law: str, two_pass: bool) -> tuple[str, ...]:
    """What these logs cannot tell, whatever their number."""
    said = ["Poisson ratio of the tissue: a log tells only the reduced modulus, and that only with the tip's angle."]
    if not CURVES[law].gives_modulus:
        said = [f"Moduli and Poisson ratio of the tissue: the law {law} describes its curve and knows no modulus."]
    elif given.needle is None:
        said.append("Reduced modulus: a log tells its product with the tangent of the tip's half angle.")
    if "tissue_young_modulus" not in given.bench:
        said.append(
            "Friction coefficient: it needs the tissue's modulus and the needle's section; a log tells "
            "friction per length."
        )
    if not two_pass:
        said.append(
            "Cutting force apart from the depth at which embedded length begins: both shift the force by a constant."
        )
    return tuple(said)


def settings_of(law: str, needle: Needle | None, singles: list[SegmentedRecording]) -> FitSettings:
    """How the identification was run: its law, its recordings, and how the intervals took the noise."""
    known = [ratio for ratio in map(lateral_ratio, singles) if np.isfinite(ratio)]
    return FitSettings(
        stiffness_law=law,
        needle=None if needle is None else repr(needle),
        repeats=len(singles),
        answering=sum(bool(single.fits) for single in singles),
        lateral_over_axial_force=float(np.median(known)) if known else None,
        noise=noise_words(noise for single in singles if law in single.fits for noise in single.fits[law].noises),
    )


def crossed(single: SegmentedRecording, one_layer: bool = True) -> list[str]:
    """Every limit that one recording crosses; a layered model knows layers and relaxation."""
    said = [_lateral(single), _deep(single), _smeared(single)]
    said += [_layers(single.events), _relaxation(single)] if one_layer else []
    return [sentence for sentence in said if sentence]


def _layers(events: Events) -> str:
    if len(events.punctures) < 2:
        return ""
    return (
        "There is more than one puncture: the specimen has layers, and a one-layer model cannot "
        "follow what lies below the first."
    )


def _relaxation(single: SegmentedRecording) -> str:
    holds = single.events.spans(Phase.hold)
    peak = peak_force(single)
    if not holds or peak <= 0 or holds[0].end - holds[0].start < LEAST_HOLD:
        return ""
    force = single.recording.force[holds[0].first : holds[0].last]
    tenth = max(len(force) // 10, 1)
    # the ends of a hold belong to the braking before it and to the start of the withdrawal
    early, late = force[tenth : 2 * tenth], force[-3 * tenth : -2 * tenth]
    fall = 1.0 - float(np.mean(late)) / float(np.mean(early) or np.nan)
    if not fall > RELAXED:
        return ""
    return "The force relaxes by more than a tenth during the hold: the tissue is viscous, the model is not."


def _smeared(single: SegmentedRecording) -> str:
    recording = single.recording
    if not single.fits or recording.card.filter_length == 1:
        return ""
    travel = float(np.abs(recording.velocity).max()) * recording.card.filter_length / recording.rate
    if travel <= SMEARED * next(iter(single.fits.values())).values["puncture_indentation"]:
        return ""
    return (
        "The average filter smears the force over more than a fiftieth of the indentation: its delay is undone, "
        "its bending of the loading curve is not, and the intervals of contact and stiffness are too narrow."
    )


def _lateral(single: SegmentedRecording) -> str:
    axes = single.recording.axes
    if "fx" not in axes or "fy" not in axes:
        return ""
    if not lateral_ratio(single) > SMALL_LATERAL:
        return ""
    return (
        "The lateral forces are not small beside the axial one (over a tenth): the paper neglects "
        "them, and the needle bends."
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


def _deep(single: SegmentedRecording) -> str:
    if not single.fits or len(single.strokes.depth_in) == 0:
        return ""
    contact = next(iter(single.fits.values())).values["contact_depth"]
    if single.strokes.depth_in.max() - contact <= FRICTION_LIMIT:
        return ""
    return "The needle goes deeper than 12 mm, beyond which the paper sees friction leave the line in depth."


def noise_words(noises: Iterable[Noise]) -> str:
    """One phrase for each kind of noise among the strokes (n,), with the reach of its correlation in samples."""
    reaches: dict[str, list[int]] = {}
    for noise in noises:
        if noise.count:
            reaches.setdefault(_kind(noise), []).append(noise.reach)
    return "; ".join(kind.format(_samples(reach)) for kind, reach in reaches.items())


def _kind(noise: Noise) -> str:
    if not noise.reach:
        return WHITE
    if noise.fades:
        return FADING
    return LONG if 8 * noise.reach >= noise.count - 8 else WINDOWED


def _samples(reaches: list[int]) -> str:
    low, high = min(reaches), max(reaches)
    return f"{low} samples" if low == high else f"{low} to {high} samples"
