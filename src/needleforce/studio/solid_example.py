# SPDX-License-Identifier: Apache-2.0
"""A needle in a cup of gelatin: the solid condensed onto the needle's path, and how far its section moves for a unit
force at each node of the path."""

import base64
import json
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import core
from ..files import json_safe
from .steering_presets import SteeringPreset

if TYPE_CHECKING:
    from ..fe import NeedlePath, Tissue

SOLID = "solid"  # its name among the needles of the page
SOLID_FILE = "solid.json"
SOLID_TITLE = "Polymer in gelatin, a solid"
_RADIUS, _DEPTH, _NEEDLE_DEPTH, _SPACING = 15e-3, 28e-3, 20e-3, 2e-3  # [m] of the cup, and of the path
_MODULUS = 12e3  # [Pa] of the gelatin
_ACROSS, _DOWN = 13, 27  # places of the section


@dataclass(frozen=True, eq=False, kw_only=True)
class SolidExample:
    """The needle in its solid, and what draws the solid.

    Attributes
    ----------
    preset : SteeringPreset
        As the needles in layers.
    compliance : ndarray, shape (n, n)
        Across, between the nodes of the path [m/N].
    across, down : ndarray, shape (c,), (r,)
        Places of the section to the right of the needle [m].
    along, aside : ndarray, shape (n, r, c, 2)
        Displacement of these places, across and down, for a unit force at each node along the needle, and across it
        to the right [m/N].
    """

    preset: SteeringPreset
    compliance: np.ndarray
    across: np.ndarray
    down: np.ndarray
    along: np.ndarray
    aside: np.ndarray

    def text(self) -> bytes:
        """As JSON for the page; the displacements as 32-bit floats in base64."""
        tissue, compact = self.preset.tissue, [self.along, self.aside]
        entry = self.preset.entry()
        solid = {"spacing": tissue.spacing, "compliance": tissue.compliance}
        field = {
            "compliance": self.compliance,
            "across": self.across,
            "down": self.down,
            **dict(zip(("along", "aside"), map(_packed, compact))),
        }
        whole = entry | {"bending": entry["bending"] | {"tissue": solid}, "solid": solid, "field": field}
        return json.dumps(json_safe(whole), separators=(",", ":")).encode()


def _packed(values: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode()


@cache
def solid_example() -> SolidExample:
    """The example, which takes some seconds. Raises InputError without the extra ``fe``."""
    from .. import fe

    needle = core.Needle(1.4e-3, 0.0, 100e-3, 2e9, 0.3)
    radius = 0.5 * needle.outer_diameter
    cup = fe.cylinder(_RADIUS, _DEPTH, radius, needle_depth=_NEEDLE_DEPTH)
    gelatin = fe.Tissue(cup, fe.Elastic(_MODULUS), supports={"bottom": "fixed", "sides": "fixed"})
    path = fe.NeedlePath(depth=_NEEDLE_DEPTH, spacing=_SPACING, radius=radius)
    across = fe.lateral_foundation(gelatin, path, needle.bending_stiffness)
    places = np.linspace(0.0, 0.97 * _RADIUS, _ACROSS) ** 2 / (0.97 * _RADIUS), np.linspace(0.0, _DEPTH, _DOWN)
    return SolidExample(
        preset=SteeringPreset(
            title=SOLID_TITLE,
            summary="1.4 mm, E = 2 GPa, in gelatin of 12 kPa, condensed onto the needle's path and drawn as it moves.",
            axial="paper",
            needle=needle,
            lateral=tuple(across.layers),
            depth=19e-3,
            target=(0.5e-3, 0.0, 17e-3),
            options={"guide_distance": 10e-3},
            tissue=gelatin.condense(path),
        ),
        across=places[0],
        down=places[1],
        **_fields(gelatin, path, places),
    )


def _fields(tissue: "Tissue", path: "NeedlePath", places: tuple[np.ndarray, np.ndarray]) -> dict[str, Any]:
    """Displacements of the places for unit forces, and the compliance across."""
    x, z = np.meshgrid(*places)
    points = np.column_stack([x.ravel(), np.zeros(x.size), z.ravel()])
    values, found = tissue.values_at(points), {}
    for name, direction in (("along", None), ("aside", np.eye(3)[0])):
        loads = path.loads(tissue, direction)
        solutions = tissue.solve(loads.toarray())
        moved = (values @ solutions).reshape(3, *x.shape, -1)[[0, 2]]
        found[name] = np.moveaxis(moved, (3, 0), (0, 3))
        compliance = loads.T @ solutions
    return found | {"compliance": 0.5 * (compliance + compliance.T)}
