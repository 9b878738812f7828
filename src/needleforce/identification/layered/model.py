# SPDX-License-Identifier: Apache-2.0
"""What a layered fit states next to its values: the model for simulation and the rupture depths of its layers in every
run; warnings, assumptions and settings."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ... import core
from ...core import Needle
from ...display.quantities import counted
from ...models.model import Layer, Model
from ...models.parameter_units import UNITS
from ..estimates import Estimate
from ..models import LAYERED, UNKNOWN_TIP, half_angle
from ..one_layer.segmented_recording import SegmentedRecording
from ..recording_fit import RecordingFit
from ..settings import Evidence, FitSettings, LayeredSettings
from ..statistics.noise import SIGNIFICANT, TWO_SIDED, noise_of
from ..statistics.regression import independent_samples
from ..strokes import cycle_span
from .binned_cycle import without_outliers
from .known_stiffness import disagreements
from .model_selection import MIN_REPEATS, Candidate, as_good
from .parameters import MIN_INDENTATION_M, MM, NO_RELAXATION, NO_SATURATION, LayerRow, prefix
from .prediction import Ruptures
from .search import MAX_OVER_NOISE, Solved
from .uncertainty import OF_A_RUPTURE, absent

NAMES = {form: name for name, form in LAYERED.items()}
RELAXATION = {
    "as_fitted": core.laws.PronyAtRest,
    "passive": core.laws.Prony,
    "yielding": core.laws.PronyLocked,
}
MIN_SHARE = 1e-9  # [1] a smaller relaxing share is none
NO_SATURATION_SHARE = 0.99  # [of the largest saturation depth] beyond, the contact does not saturate
SCAN_STEP_MM = 0.02  # [mm] of the interval of a rupture
SCAN_RANGE_MM = 1.5  # [mm] on each side
NUMERICAL = 2.5e-4  # [of the peak] what the bins of the fit leave
NOT_IN_TABLE = "Nothing in these recordings determines {}: not in the table of parameters."
HIDDEN = "No puncture, a fall of the force, shows a rupture: {} are by the law and the whole cycle alone."
MAX_RESIDUAL_RATIO = 2.0  # over the median residual
MAX_RESIDUAL = 0.1  # [of the peak] repeats of one specimen differ by less


def model_of(solved: Solved, punctures: np.ndarray, needle: Needle | None = None, reference: str = "") -> Model:
    """The model that ruptures at ``punctures`` (layers,) [m] in the recordings' zero; InputError out of range."""
    form = solved.problem.form
    rows = [LayerRow(*row) for row in solved.problem.unknowns.rows(solved.x[None], punctures[None] / MM)[0].tolist()]
    depths = np.array([row.top for row in rows])
    # the simulation does not accept two layers with the same top: they are put a micrometre apart
    tops = np.maximum.accumulate(depths - depths[0] - MIN_INDENTATION_M * np.arange(len(rows)))
    layers = [
        _layer(row, float(top + MIN_INDENTATION_M * k), half_angle(needle), form)
        for k, (row, top) in enumerate(zip(rows, tops))
    ]
    first = {name: getattr(layers[0], name) for name in ("stiffness", "puncture", "friction", "cutting", "relaxation")}
    return Model(
        **first,
        deeper=tuple(layers[1:]),
        name=f"identified_{NAMES[form]}",
        summary="Identified from recordings.",
        reference=reference or "identified by needleforce",
        doubts=(UNKNOWN_TIP,) if needle is None or needle.tip is None else (),
        needle=needle,
    )


def _layer(row: LayerRow, top: float, angle: float, form: str) -> Layer:
    modulus = 0.5 * np.pi * row.stiffness_coefficient / np.tan(angle)
    radius = 2.0 * row.saturation_depth * np.tan(angle) / np.pi
    cone = row.saturation_depth >= NO_SATURATION_SHARE * np.exp(NO_SATURATION)
    return Layer(
        top=top,
        stiffness=core.laws.Cone(modulus, angle) if cone else core.laws.ConeCylinder(modulus, angle, radius),
        puncture=core.laws.PunctureDepth(row.puncture_depth - row.top),
        friction=_friction(row, form),
        cutting=core.laws.NoCutting(),
        relaxation=_relaxation(row, form),
    )


def _friction(row: LayerRow, form: str) -> Any:
    numbers = row.friction_per_length, row.tissue_stiffness, row.rupture_length, row.resting_surface
    if form == "yielding":
        return core.laws.YieldingTissue(*numbers, row.brittleness, withdrawal_ratio=row.withdrawal_ratio)
    law = core.laws.DraggedTissue if form == "passive" else core.laws.DraggedTissueAsFitted
    return law(*numbers, row.withdrawal_ratio)


def _relaxation(row: LayerRow, form: str) -> Any:
    if row.share_1 + row.share_2 < MIN_SHARE:
        return core.laws.NoRelaxation()
    return RELAXATION[form](row.share_1, row.time_1, row.share_2, row.time_2)


def own_ruptures(solved: Solved, run: int) -> dict[str, Estimate]:
    """Rupture depths of the layers in one run, with intervals between two depths instead of standard errors.

    An interval contains the depths that the noise of this run does not reject, with the other parameters held, and the
    width of the bin.
    """
    problem, cycle = solved.problem, solved.problem.cycles[run]
    own = problem.unknowns.punctures(solved.x)[run]
    noise = noise_of(problem.residuals(run, solved.x), len(cycle.depth))
    bin_width = float(np.ptp(cycle.depth)) / max((cycle.stroke == 0).sum(), 1) / MM
    found = {}
    for layer, place in enumerate(own):
        name = f"{prefix(layer)}puncture_depth"
        allowed = _allowed(solved, run, layer, TWO_SIDED**2 * noise.long_run)
        low, high = MM * (allowed.min() - 0.5 * bin_width), MM * (allowed.max() + 0.5 * bin_width)
        reached = place < cycle.deepest / MM
        high, source = (high, "layered fit") if reached else (np.inf, "layered fit: deeper than this run")
        found[name] = Estimate(
            name, MM * place, UNITS["puncture_depth"], low, high, identifiable=reached, source=source
        )
    return found


def _allowed(solved: Solved, run: int, layer: int, rise: float) -> np.ndarray:
    """Depths [mm] around a rupture where the sum of squares is at most ``rise`` above the least."""
    problem = solved.problem
    own = problem.unknowns.punctures(solved.x)[run]
    places = np.append(np.arange(own[layer] - SCAN_RANGE_MM, own[layer] + SCAN_RANGE_MM, SCAN_STEP_MM), own[layer])
    squares = problem.squares_by_puncture(run, layer, solved.x, places)
    return places[squares <= squares[-1] + rise]


def layers_in_words(solved: Solved) -> str:
    """How many layers, in words."""
    count = solved.problem.unknowns.layers
    return f"{count} layer" + ("s" if count > 1 else "")


@dataclass(frozen=True)
class Misfit:
    """Rms ``residual`` of the recordings [N], the ``noise`` of their free travel [N], and the ``limit`` of the ratio of
    the two, which a right model exceeds by chance in less than one of a thousand fits; NaN where no free travel shows
    the noise."""

    residual: float
    noise: float
    limit: float

    @property
    def found(self) -> bool:
        """Whether the residual is more than the noise."""
        return self.residual > self.limit * self.noise

    @property
    def sentence(self) -> str:
        """The residual over the noise, in words."""
        return (
            f"The residual is {self.residual / self.noise:.1f} times the noise ({1e3 * self.residual:.3g} of "
            f"{1e3 * self.noise:.3g} mN in the free travel): the tissue does not follow this law, or the search ended "
            "in another minimum. The values describe these recordings; no interval is known to hold that of the tissue."
        )


def misfit_of(solved: Solved, own: dict[SegmentedRecording, RecordingFit]) -> Misfit:
    """The residual of the recordings in the order of the runs, without outliers, over the noise."""
    squares, noises, known = [], [], 0.0
    for (single, each), cycle in zip(own.items(), solved.problem.cycles):
        free = cycle.zero.noise
        if not free.count or not len(each.residuals):
            continue
        used = without_outliers(single.recording, single.events)
        span, _ = cycle_span(single.strokes, single.events)
        squares.append(np.mean(each.residuals[span][used[span]] ** 2))
        noises.append(free.variance + single.force_step**2 / 12.0 + (NUMERICAL * cycle.peak) ** 2)
        known += independent_samples([free])
    if not noises:
        return Misfit(np.nan, np.nan, np.nan)
    limit = max(MAX_OVER_NOISE, 1.0 + SIGNIFICANT / np.sqrt(2.0 * known))
    return Misfit(float(np.sqrt(np.mean(squares))), float(np.sqrt(np.mean(noises))), float(limit))


def warnings_on(solved: Solved, recordings: tuple[RecordingFit, ...], misfit: Misfit) -> tuple[str, ...]:
    """Sentences on what limits the validity of the values."""
    cycles = solved.problem.cycles
    found = [misfit.sentence] if misfit.found else []
    residuals = [(each.file, each.quality.nrmse) for each in recordings if each.quality is not None]
    middle = float(np.median([residual for _, residual in residuals])) if residuals else 0.0
    if len(cycles) < MIN_REPEATS:
        found.append(
            f"The scatter between repeats is not known from {counted(len(cycles), 'recording')}: the "
            "intervals contain only the noise within each recording."
            + (" Give three or more." if middle <= MAX_RESIDUAL else " More repeats do not narrow its misfit.")
        )
    found += [*_other_zeros(recordings), *disagreements(solved.problem.known)]
    if middle > MAX_RESIDUAL:
        found.append(
            f"The residual is {100 * middle:.0f} % of the peak (median of {counted(len(residuals), 'recording')}): the "
            "model describes these recordings poorly. Identify them one by one: is each a repeat of the others?"
        )
    for file, residual in residuals:
        if residual > MAX_RESIDUAL_RATIO * middle and len(residuals) > 2:
            found.append(
                f"{file}: its residual is {100 * residual:.0f} % of its peak, the others' median {100 * middle:.0f} %: "
                "is it a repeat of the same condition?"
            )
    return tuple(found)


def _other_zeros(recordings: tuple[RecordingFit, ...]) -> list[str]:
    """Recordings whose contact is farther from the median contact than the insertions are deep."""
    with_contact = [each for each in recordings if each.events.contact is not None]
    contacts = np.array([each.events.contact.depth for each in with_contact])
    median = float(np.median(contacts))
    max_distance = float(np.median([each.recording.depth.max() for each in with_contact] - contacts))
    return [
        f"{each.file}: its contact at {contact / MM:.4g} mm is far from the median of its repeats, "
        f"{median / MM:.4g} mm: use one zero of the depth for all files."
        for each, contact in zip(with_contact, contacts)
        if abs(contact - median) > max_distance
    ]


def held_fixed(solved: Solved) -> tuple[str, ...]:
    """What was assumed and not identified."""
    times, unknowns = solved.problem.unknowns.times, solved.problem.unknowns
    held = ["embedded length: measured from the moving surface; a separate cutting force then tends to zero"]
    if unknowns.constants in unknowns.held and solved.x[unknowns.relaxing] > NO_RELAXATION:
        held.append(f"time constants of relaxation: {times[0]:.2g} s and {times[1]:.2g} s, from the decay in the hold")
    held += [f"{each.name}: {each.text}, in the fit as one measurement more" for each in solved.problem.known]
    without = sorted(name for name in absent(solved) if name.endswith("saturation_depth"))
    if without:
        held.append(f"{', '.join(without)}: not in the model, as the contact does not saturate before its rupture")
    if unknowns.speed not in unknowns.held:
        speed = f"{1e3 * solved.problem.speed:.3g} mm/s"
        held.append(
            f"speed: the parameters are those at {speed}; all forces are assumed to change with one power of it"
        )
    return tuple(held)


def behind_hidden(ruptures: Ruptures) -> list[str]:
    """Names of the parameters of ruptures that no puncture shows, and of what is behind them: where a load ends and
    friction begins, the law alone states then. Repeats that predict each other, with a puncture of one layer at least,
    show those of the others."""
    seen = [each.known for each in ruptures.scatter]
    predicted = any(seen) and ruptures.scatter[0].count >= MIN_REPEATS
    hidden = [] if predicted else [prefix(layer) for layer, known in enumerate(seen) if not known]
    return [start + name for start in hidden for name in ("puncture_depth", *OF_A_RUPTURE)]


def not_identified(
    solved: Solved, parameters: dict[str, Estimate], undetermined: tuple[str, ...], ruptures: Ruptures
) -> tuple[str, ...]:
    """What these recordings cannot identify."""
    found = [NOT_IN_TABLE.format(", ".join(undetermined))] if undetermined else []
    hidden = [name for name in behind_hidden(ruptures) if name in parameters]
    found += [HIDDEN.format(", ".join(hidden))] if hidden else []
    found += [
        "Moduli and Poisson ratio of the tissue: recordings identify the stiffness of the contact; a modulus needs "
        "the tip too.",
        "Stiffness coefficient, saturation depth and contact depth separately: their combination, the slope of the "
        "saturated contact (contact_stiffness), has a narrower interval.",
    ]
    deepest = max(cycle.deepest for cycle in solved.problem.cycles)
    for layer in range(solved.problem.unknowns.layers):
        if parameters[f"{prefix(layer)}puncture_depth"].value > deepest:
            found.append(
                f"Layer {layer + 1} ruptured in no recording: its puncture depth is more than {deepest / MM:.1f} mm, "
                "and its friction is not identified."
            )
    if "speed_exponent" not in parameters:
        found.append("Dependence on speed, and relaxation during motion: the recordings do not identify them.")
    return tuple(found)


def layered_settings(found: Candidate, tried: list[Candidate], settings: FitSettings) -> LayeredSettings:
    """The settings of any fit, and how the choice of layers was made."""
    by_prediction = "prediction of held-out repeats: the fewest layers within 2 % or a standard error of the best"
    by_bic = "BIC of the complete cycle, correlated samples counted as one: the fewest layers within 10 of the lowest"
    unknowns = found.solved.problem.unknowns
    return LayeredSettings(
        **vars(settings) | {"answering": unknowns.runs},
        parameters=int((unknowns.free < unknowns.shared).sum()),
        speed_m_s=found.solved.problem.speed,
        layers=unknowns.layers,
        chosen_by=by_prediction if len(found.held_out) else by_bic,
        evidence=tuple(_evidence(each, found) for each in tried),
    )


def _evidence(each: Candidate, found: Candidate) -> Evidence:
    return Evidence(
        choice=each.name,
        parameters=each.parameters,
        residual=each.residual,
        bic=each.bic,
        left_out=each.error if len(each.held_out) else None,
        ties=each is not found and as_good(each, found) and as_good(found, each),
        chosen=each is found,
    )
