# SPDX-License-Identifier: Apache-2.0
"""What each layer of an identified model carries of the force, and the law for insertions not seen yet."""

from collections.abc import Sequence

import numpy as np

from ..identification.result import run_model, with_ruptures
from ..models.model import Model
from .canvas import MEASURED, MEDIUM, QUIET, SECOND, SLATE, THIN, axis_names, panels
from .figures import DEPTH, FORCE, line
from .labels import Labels

COLOURS = (SECOND, "#a3428a", "#00735c")


def layer_forces(fit, one) -> list[np.ndarray]:
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


def population_force(fit, one) -> np.ndarray | None:
    """Force (n,) [N] along the recording of ``one`` of the law for insertions not seen yet, or None."""
    return None if fit.population is None else fit.predict(one.fit.recording)


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
