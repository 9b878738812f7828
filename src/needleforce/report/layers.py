# SPDX-License-Identifier: Apache-2.0
"""The layers of an identified model: the force of each, and the choice of layers and mechanisms."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from ..display.markup import Markup, element, table
from ..display.quantities import DASH
from ..identification.layered.result import Evidence, LayeredFit, LayeredSettings
from ..identification.models import run_model, with_ruptures
from ..identification.result import Fit
from ..models.model import Layer, Model
from .canvas import MEASURED, MEDIUM, QUIET, SECOND, SLATE, THIN, Labels, Sheet, axis_names, panels
from .curves import DrawnRepeat
from .figures import DEPTH, FORCE, cut_free_travel, line, zero_line

COLOURS = (SECOND, "#a3428a", "#00735c")
EVIDENCE = (
    *("choice", "parameters", "residual / peak", "BIC above the lowest", "error on held-out repeats / peak"),
    "verdict",
)


def layer_forces(fit: LayeredFit, one: DrawnRepeat) -> list[np.ndarray]:
    """Force (n,) [N] of each layer along the recording of ``one``, with its own ruptures; their sum is its model.

    All forces may scale with one power of the speed: this factor between the layers' sum and the model is applied.
    """
    contact = fit.parameters["contact_depth"].value
    own = [e.value - contact for name, e in one.fit.parameters.items() if name.endswith("puncture_depth")]
    layers = with_ruptures(fit.model, own).layers
    forces = np.array(
        [run_model(_single_layer_model(layer), one.fit.recording, contact + layer.top) for layer in layers]
    )
    total = forces.sum(axis=0)
    factor = total @ one.model / (total @ total) if total.any() else 1.0
    return list(factor * forces)


def _single_layer_model(layer: Layer) -> Model:
    """A model of one layer only."""
    stiffness, puncture, friction, cutting, relaxation = layer.parts
    return Model(stiffness, puncture, friction, cutting, relaxation=relaxation)


def population_force(fit: Fit, one: DrawnRepeat) -> np.ndarray | None:
    """Predicted force (n,) [N] of a new insertion along the recording of ``one``, or None without a prediction."""
    known = isinstance(fit, LayeredFit) and fit.population is not None
    return fit.predict(one.fit.recording) if known else None


def layer_force_figure(figure: Figure, sheet: Sheet, one: DrawnRepeat, forces: Sequence[np.ndarray]) -> None:
    """The force of each layer and the measured force over indentation, in both strokes."""
    axes = panels(figure, sheet)[0, 0]
    curves = [line(axes, one.indentation, one.measured, sheet.columns, color=MEASURED, lw=THIN)]
    for force, colour in zip(forces, COLOURS):
        curves.append(line(axes, one.indentation, force, sheet.columns, color=colour, lw=MEDIUM))
    axes.axhline(0.0, color=QUIET, lw=0.6)
    axes.margins(x=0.01, y=0.06)
    cut_free_travel(axes, [one])
    axis_names(axes, DEPTH, FORCE)
    labels = Labels(axes, [*curves, zero_line(axes)])
    labels.on("measured", *curves[0], SLATE)
    for k, (curve, colour) in enumerate(zip(curves[1:], COLOURS), 1):
        labels.on(f"layer {k}", *curve, colour)


def evidence_rows(evidence: Sequence[Evidence]) -> list[tuple[str, ...]]:
    """Every choice tried as text under ``EVIDENCE``, with its BIC above the lowest."""
    lowest = min(row.bic for row in evidence)
    return [
        (row.choice, str(row.parameters), percent(row.residual), f"{row.bic - lowest:.0f}", percent(row.left_out),
         "chosen" if row.chosen else "ties" if row.ties else "")
        for row in evidence
    ]  # fmt: skip


def evidence_table(evidence: Sequence[Evidence]) -> Markup:
    """The choices as an HTML table; the word ``chosen`` is in bold."""
    rows = [
        (*row[:-1], element("strong", row[-1]) if row[-1] == "chosen" else row[-1]) for row in evidence_rows(evidence)
    ]
    return table(EVIDENCE, rows, class_="cards numbers tight")


def evidence_words(settings: LayeredSettings) -> str:
    """The criterion of the choice, and what a tie is."""
    by_bic = (
        "With fewer than three repeats the choice with the lowest BIC is taken; those within 10 of it tie. BIC is over "
        "the complete cycle and counts correlated samples as one."
    )
    by_repeats = (
        "Of the choices that predict held-out repeats as well as the best, within one standard error or 2 % "
        "(geometric mean over the repeats), the one with the fewest parameters is chosen. A choice ties if its "
        "error differs from that of the chosen one by no more than the noise between repeats: these recordings do "
        "not distinguish the two. BIC, over the complete cycle and counting correlated samples as one, is shown for "
        "comparison and may favour fewer parameters."
    )
    given = sum("," not in row.choice for row in settings.evidence) == 1
    fixed = " The number of layers was given." if given else ""
    return (by_repeats if settings.evidence[0].left_out is not None else by_bic) + fixed


def evidence_note(settings: LayeredSettings) -> Markup:
    """The criterion, and what the rows of the table are, as a note under it."""
    each = (
        "A choice with a comma omits one mechanism from the chosen number of layers. Parameters are all that are "
        "fitted."
    )
    return element("p", f"{evidence_words(settings)} {each}", class_="note")


def percent(share: float | None) -> str:
    """A share of the peak in per cent, with one decimal."""
    return DASH if share is None else f"{100.0 * share:.1f}\N{NO-BREAK SPACE}%"
