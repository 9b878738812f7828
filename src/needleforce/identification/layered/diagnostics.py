# SPDX-License-Identifier: Apache-2.0
"""What a layered fit says beside its numbers."""

import numpy as np

from ..estimates import Estimate
from ..result import RecordingFit
from .model_selection import ENOUGH, Candidate, ties
from .parameters import MM, NO_FADING, prefix
from .search import Solved

ODD = 2.0  # times the median residual
POOR = 0.1  # of the peak: repeats of one specimen differ by less


def layers(solved: Solved) -> str:
    """How many layers, in words."""
    count = solved.problem.unknowns.layers
    return f"{count} layer" + ("s" if count > 1 else "")


def counted(recordings: int) -> str:
    """So many recordings."""
    return f"{recordings} recording" + ("s" if recordings > 1 else "")


def warnings(solved: Solved, recordings: tuple[RecordingFit, ...]) -> tuple[str, ...]:
    """What a reader should know before believing the numbers."""
    cycles = solved.problem.cycles
    said = []
    if len(cycles) < ENOUGH:
        said.append(
            f"The scatter between repeats is not told by {counted(len(cycles))}: the intervals hold the noise within "
            "runs alone; give three or more."
        )
    said += _other_zeros(recordings)
    residuals = [(each.file, each.quality.nrmse) for each in recordings if each.quality is not None]
    middle = float(np.median([residual for _, residual in residuals])) if residuals else 0.0
    if middle > POOR:
        said.append(
            f"The residual is {100 * middle:.0f} % of the peak (median of {counted(len(residuals))}): the numbers "
            "describe these recordings poorly. Identify them one by one: is each a repeat of the others?"
        )
    for file, residual in residuals:
        if residual > ODD * middle and len(residuals) > 2:
            said.append(
                f"{file}: its residual is {100 * residual:.0f} % of its peak, the others' median {100 * middle:.0f} %: "
                "is it a repeat of the same condition?"
            )
    return tuple(said)


def _other_zeros(recordings: tuple[RecordingFit, ...]) -> list[str]:
    """Recordings whose contact lies farther from the median contact than the insertions are deep."""
    touching = [each for each in recordings if each.events.contact is not None]
    contacts = np.array([each.events.contact.depth for each in touching])
    usual = float(np.median(contacts))
    long = float(np.median([each.recording.depth.max() for each in touching] - contacts))
    return [
        f"{each.file}: its contact at {contact / MM:.4g} mm lies far from the median of its repeats, {usual / MM:.4g} "
        "mm: count the depth of all files from one zero."
        for each, contact in zip(touching, contacts)
        if abs(contact - usual) > long
    ]


def held_fixed(solved: Solved) -> tuple[str, ...]:
    """What was taken and not identified."""
    times, unknowns = solved.problem.unknowns.times, solved.problem.unknowns
    said = ["embedded length: counted from the moving surface; with it a separate cutting force tends to zero"]
    if solved.x[unknowns.fading] > NO_FADING:
        said.append(f"time constants of relaxation: {times[0]:.2g} s and {times[1]:.2g} s, by the length of the hold")
    if unknowns.speed not in unknowns.held:
        speed = f"{1e3 * solved.problem.speed:.3g} mm/s"
        said.append(f"speed: the numbers hold at {speed}; all forces are taken to go by one power of it")
    return tuple(said)


def unknown(solved: Solved, parameters: dict[str, Estimate]) -> tuple[str, ...]:
    """What these logs cannot tell."""
    said = [
        "Moduli and Poisson ratio of the tissue: a log tells the contact's stiffness; a modulus needs the tip.",
        "Stiffness coefficient, saturation depth and contact depth one by one: they are known together; the slope "
        "of the saturated contact, contact_stiffness, is known better.",
    ]
    deepest = max(cycle.deepest for cycle in solved.problem.cycles)
    for layer in range(solved.problem.unknowns.layers):
        if parameters[f"{prefix(layer)}puncture_depth"].value > deepest:
            said.append(
                f"Layer {layer + 1} gave way in no run: its puncture depth is more than {deepest / MM:.1f} mm, and "
                "friction in it is not known."
            )
    if "speed_exponent" not in parameters:
        said.append("Dependence on speed: the recordings do not tell it, nor how relaxation goes on in motion.")
    return tuple(said)


def settings(found: Candidate, tried: list[Candidate]) -> dict[str, object]:
    """How the choice was made."""
    rule = (
        "repeats left out, fewest numbers within 2 %"
        if len(found.left_out)
        else "BIC, whole cycle, correlated samples as one"
    )
    rows = [
        {
            "choice": each.name,
            "numbers": each.numbers,
            "residual": each.residual,
            "bic": each.bic,
            "left_out": None if not len(each.left_out) else each.error,
            "ties": each is not found and ties(each, found),
            "chosen": each is found,
        }
        for each in tried
    ]
    unknowns = found.solved.problem.unknowns
    return {
        "answering": unknowns.runs,
        "numbers": int((unknowns.free < unknowns.shared).sum()),
        "speed_m_s": found.solved.problem.speed,
        "layers": unknowns.layers,
        "chosen_by": rule,
        "evidence": rows,
    }
