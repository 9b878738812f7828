# SPDX-License-Identifier: Apache-2.0
"""Layers of an identified model: what each carries of the force, and why the fit has them."""

from collections.abc import Sequence

import numpy as np

from ..display.markup import Markup, element, table
from ..display.quantities import DASH
from ..identification.layered.result import Evidence, LayeredFit, LayeredSettings
from ..identification.models import run_model, with_ruptures
from ..identification.result import Fit
from ..models.model import Model
from .canvas import MEASURED, MEDIUM, QUIET, SECOND, SLATE, THIN, Labels, axis_names, panels
from .curves import DrawnRepeat
from .figures import DEPTH, FORCE, line

COLOURS = (SECOND, "#a3428a", "#00735c")
EVIDENCE = (
    *("choice", "parameters", "residual / peak", "BIC, more than the best", "error on repeats left out / peak"),
    "verdict",
)


def layer_forces(fit: LayeredFit, one: DrawnRepeat) -> list[np.ndarray]:
    """Force (n,) [N] of each layer along the recording of ``one``, with its own ruptures; they add up to its model.

    All forces may go by one power of the speed: the layers' sum is the model up to this one factor.
    """
    contact = fit.parameters["contact_depth"].value
    own = [e.value - contact for name, e in one.fit.parameters.items() if name.endswith("puncture_depth")]
    layers = with_ruptures(fit.model, own).layers
    forces = np.array([run_model(_alone(layer), one.fit.recording, contact + layer.top) for layer in layers])
    whole = forces.sum(axis=0)
    factor = whole @ one.model / (whole @ whole) if whole.any() else 1.0
    return list(factor * forces)


def _alone(layer) -> Model:
    stiffness, puncture, friction, cutting, relaxation = layer.parts
    return Model(stiffness, puncture, friction, cutting, relaxation=relaxation)


def population_force(fit: Fit, one: DrawnRepeat) -> np.ndarray | None:
    """Force (n,) [N] along the recording of ``one`` of the law for insertions that were not recorded, or None."""
    known = isinstance(fit, LayeredFit) and fit.population is not None
    return fit.predict(one.fit.recording) if known else None


def shares(figure, sheet, one, forces: Sequence[np.ndarray]) -> None:
    """Each layer's force over indentation, in and out, beside the measured sum."""
    axes = panels(figure, sheet)[0, 0]
    curves = [line(axes, one.indentation, one.measured, sheet.columns, color=MEASURED, lw=THIN)]
    for force, colour in zip(forces, COLOURS):
        curves.append(line(axes, one.indentation, force, sheet.columns, color=colour, lw=MEDIUM))
    axes.axhline(0.0, color=QUIET, lw=0.6)
    axes.margins(x=0.01, y=0.06)
    axis_names(axes, DEPTH, FORCE)
    labels = Labels(axes, curves)
    labels.on("measured", *curves[0], SLATE)
    for k, (curve, colour) in enumerate(zip(curves[1:], COLOURS), 1):
        labels.on(f"layer {k}", *curve, colour)


def evidence_rows(evidence: Sequence[Evidence]) -> list[tuple[str, ...]]:
    """Every choice that was tried as text, with what it loses in BIC, under ``EVIDENCE``."""
    least = min(row.bic for row in evidence)
    return [
        (row.choice, str(row.parameters), percent(row.residual), f"{row.bic - least:.0f}", percent(row.left_out),
         "chosen" if row.chosen else "ties" if row.ties else "")
        for row in evidence
    ]  # fmt: skip


def evidence_table(evidence: Sequence[Evidence]) -> Markup:
    """The same as a table, the chosen one in bold."""
    rows = [
        (*row[:-1], element("strong", row[-1]) if row[-1] == "chosen" else row[-1]) for row in evidence_rows(evidence)
    ]
    return table(EVIDENCE, rows, class_="cards numbers tight")


def evidence_words(settings: LayeredSettings) -> str:
    """By what the choice was made, and what a tie is."""
    by_bic = (
        "With fewer than three repeats the least BIC is chosen, over the whole cycle, samples that are alike counting "
        "as one; those within 10 of it tie."
    )
    by_repeats = (
        "Of the choices that foretell each repeat from the others as well as the best, within one standard "
        "error or 2 % (geometric mean over the repeats), the one of the fewest numbers is chosen. What ties "
        "has another error by no more than the noise between repeats: these recordings do not tell it from "
        "the chosen one. BIC, over the whole cycle, samples that are alike counting as one, is shown beside "
        "it and may ask for less."
    )
    given = sum("," not in row.choice for row in settings.evidence) == 1
    fixed = " The number of layers was given." if given else ""
    return (by_repeats if settings.evidence[0].left_out is not None else by_bic) + fixed


def evidence_note(settings: LayeredSettings) -> Markup:
    """The same under the table, and what the choices are."""
    each = (
        "A choice with a comma leaves a mechanism of the chosen number of layers away. Numbers are those sought in all."
    )
    return element("p", f"{evidence_words(settings)} {each}", class_="note")


def percent(share: float | None) -> str:
    """A share of the peak in per cent, two digits or three."""
    return DASH if share is None else f"{100.0 * share:.1f}\N{NO-BREAK SPACE}%"
