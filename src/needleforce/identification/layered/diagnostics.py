# SPDX-License-Identifier: Apache-2.0
"""Warnings, assumptions and settings of a layered fit."""

import numpy as np

from ...display.quantities import counted
from ..estimates import Estimate
from ..recording_fit import RecordingFit
from ..settings import Evidence, FitSettings, LayeredSettings
from .known_stiffness import disagreements
from .model_selection import MIN_REPEATS, Candidate, as_good
from .parameters import MM, NO_RELAXATION, prefix
from .search import Solved
from .uncertainty import absent

MAX_RESIDUAL_RATIO = 2.0  # over the median residual
MAX_RESIDUAL = 0.1  # [of the peak] repeats of one specimen differ by less


def layers(solved: Solved) -> str:
    """How many layers, in words."""
    count = solved.problem.unknowns.layers
    return f"{count} layer" + ("s" if count > 1 else "")


def warnings(solved: Solved, recordings: tuple[RecordingFit, ...]) -> tuple[str, ...]:
    """Sentences on what limits the validity of the values."""
    cycles = solved.problem.cycles
    found = []
    if len(cycles) < MIN_REPEATS:
        found.append(
            f"The scatter between repeats is not known from {counted(len(cycles), 'recording')}: the "
            "intervals contain only the noise within each recording. Give three or more."
        )
    found += [*_other_zeros(recordings), *disagreements(solved.problem.known)]
    residuals = [(each.file, each.quality.nrmse) for each in recordings if each.quality is not None]
    middle = float(np.median([residual for _, residual in residuals])) if residuals else 0.0
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
    if solved.x[unknowns.relaxing] > NO_RELAXATION:
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


def unknown(solved: Solved, parameters: dict[str, Estimate]) -> tuple[str, ...]:
    """What these recordings cannot identify."""
    found = [
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


def settings_of(found: Candidate, tried: list[Candidate], settings: FitSettings) -> LayeredSettings:
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
