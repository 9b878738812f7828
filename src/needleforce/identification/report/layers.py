# SPDX-License-Identifier: Apache-2.0
"""The force of each layer of an identified model."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib.figure import Figure as Drawing

from ...display.axes import FORCE, INDENTATION
from ...display.canvas import MEASURED, MEDIUM, QUIET, SECOND, SLATE, THIN, Labels, Sheet, axis_names, line, panels
from ...display.page import Figure
from ...models.model import Layer, Model
from ..models import run_model, with_ruptures
from .curves import DrawnRepeat
from .figures import cut_free_travel, zero_line
from .words import IN_TABLES

COLOURS = (SECOND, "#a3428a", "#00735c")


def layers_figure(model: Model, contact: float, one: DrawnRepeat) -> Figure:
    """The force of each of several layers along one recording."""
    caption = f"Force of each layer along the motion of recording {one.number}; their sum is the model. Grey: measured."
    draw = partial(layer_force_figure, one=one, forces=layer_forces(model, contact, one))
    title = "Force of each layer"
    alt = f"{title}. {IN_TABLES}"
    return Figure(name="layers", title=title, caption=caption, alt=alt, draw=draw, heights=(260, 240))


def layer_forces(model: Model, contact: float, one: DrawnRepeat) -> list[np.ndarray]:
    """Force (n,) [N] of each layer along the recording of ``one``, with its own ruptures; their sum is its model.

    ``contact`` is the depth of the surface [m]. All forces may scale with one power of the speed: this factor between
    the layers' sum and the model is applied.
    """
    own = [e.value - contact for name, e in one.fit.parameters.items() if name.endswith("puncture_depth")]
    layers = with_ruptures(model, own).layers
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


def layer_force_figure(figure: Drawing, sheet: Sheet, one: DrawnRepeat, forces: Sequence[np.ndarray]) -> None:
    """The force of each layer and the measured force over indentation, in both strokes."""
    axes = panels(figure, sheet)[0, 0]
    curves = [line(axes, one.indentation, one.measured, sheet.columns, color=MEASURED, lw=THIN)]
    for force, colour in zip(forces, COLOURS):
        curves.append(line(axes, one.indentation, force, sheet.columns, color=colour, lw=MEDIUM))
    axes.axhline(0.0, color=QUIET, lw=0.6)
    axes.margins(x=0.01, y=0.06)
    cut_free_travel(axes, [one])
    axis_names(axes, INDENTATION, FORCE)
    labels = Labels(axes, [*curves, zero_line(axes)])
    labels.on("measured", *curves[0], SLATE)
    for k, (curve, colour) in enumerate(zip(curves[1:], COLOURS), 1):
        labels.on(f"layer {k}", *curve, colour)
