# SPDX-License-Identifier: Apache-2.0
"""A layered fit as a model of the engine."""

import numpy as np

from ... import core
from ...models.model import Layer, Model
from ..models import UNKNOWN_TIP, half_angle
from .parameters import BARE, LEAST_INDENTATION, MM
from .search import Solved

LEAST_SHARE = 1e-9  # below, nothing fades
NEVER = 0.99  # of the largest saturation depth: the contact does not saturate


def model_of(solved: Solved, punctures: np.ndarray, needle=None, reference: str = "") -> Model:
    """The model that gives way at ``punctures`` (layers,) [m] in the recordings' zero; InputError out of range."""
    passive, rows = solved.problem.passive, solved.problem.unknowns.rows(solved.x[None], punctures[None] / MM)[0]
    # two layers that begin at the same place are one to the engine: it takes them a micrometre apart
    tops = np.maximum.accumulate(rows[:, 2] - rows[0, 2] - LEAST_INDENTATION * np.arange(len(rows)))
    layers = [
        _layer(row, float(top + LEAST_INDENTATION * k), half_angle(needle), passive)
        for k, (row, top) in enumerate(zip(rows, tops))
    ]
    first = {name: getattr(layers[0], name) for name in ("stiffness", "puncture", "friction", "cutting", "relaxation")}
    return Model(
        **first,
        deeper=tuple(layers[1:]),
        name="identified_layered" if passive else "identified_layered_as_fitted",
        summary="Identified from recordings.",
        reference=reference or "identified by needleforce",
        doubts=(UNKNOWN_TIP,) if needle is None or needle.tip is None else (),
        needle=needle,
    )


def _layer(row: np.ndarray, top: float, angle: float, passive: bool) -> Layer:
    c, saturation, place, puncture, grip, stiffness, rupture, resting = map(float, row[:8])
    friction = core.laws.DraggedTissue if passive else core.laws.DraggedTissueAsFitted
    modulus, radius = 0.5 * np.pi * c / np.tan(angle), 2.0 * saturation * np.tan(angle) / np.pi
    bare = saturation >= NEVER * np.exp(BARE)
    return Layer(
        top=top,
        stiffness=core.laws.Cone(modulus, angle) if bare else core.laws.ConeCylinder(modulus, angle, radius),
        puncture=core.laws.PunctureDepth(puncture - place),
        friction=friction(grip, stiffness, rupture, resting),
        cutting=core.laws.NoCutting(),
        relaxation=_fading(row[8:], passive),
    )


def _fading(numbers: np.ndarray, passive: bool):
    share_1, time_1, share_2, time_2 = map(float, numbers)
    if share_1 + share_2 < LEAST_SHARE:
        return core.laws.NoRelaxation()
    return (core.laws.Prony if passive else core.laws.PronyAtRest)(share_1, time_1, share_2, time_2)
