# SPDX-License-Identifier: Apache-2.0
"""Needles that the page steers: each a flexible insertion whose values the page and the planner take from here."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .. import core
from ..models.flexible_insertion import FlexibleInsertion
from ..preset_files.presets import preset
from ..rig.steering import SteeringPhantom


@dataclass(frozen=True, kw_only=True)
class SteeringPreset:
    """A needle that bends, its tissue, and what the page begins with.

    Parameters
    ----------
    title, summary : str
        What the reader chooses, and what it is.
    axial : str
        Preset of the laws along the needle.
    needle : Needle
        The needle.
    lateral : tuple of LateralLayer
        Tissue across, from the surface down.
    depth : float
        To which the page inserts [m].
    target : (float, float, float)
        From the point of entry [m].
    obstacles : tuple
        Spheres, each x, y, z and radius [m].
    bevel : core.Bevel, optional
        Of the tip.
    options : mapping of str to float
        Of ``FlexibleInsertion``, by the names that ``needleforce.mjs`` has too.
    tissue : CondensedTissue, optional
        The solid that the needle drags along its axis.
    """

    title: str
    summary: str
    axial: str
    needle: core.Needle
    lateral: tuple[core.LateralLayer, ...]
    depth: float
    target: tuple[float, float, float]
    obstacles: tuple[tuple[float, float, float, float], ...] = ()
    bevel: core.Bevel | None = None
    options: Mapping[str, float] = field(default_factory=dict)
    tissue: Any = None

    def insertion(self) -> FlexibleInsertion:
        """The needle before its first contact."""
        return FlexibleInsertion(
            preset(self.axial), self.needle, lateral=self.lateral, tissue=self.tissue, bevel=self.bevel, **self.options
        )

    def entry(self) -> dict[str, Any]:
        """The same as ``needleforce.mjs`` takes it, in SI."""
        kept = ("title", "summary", "axial", "depth", "target", "obstacles")
        bevel = {} if self.bevel is None else {f"bevel_{row['name']}": self.bevel for row in self.bevel.table()}
        return {key: getattr(self, key) for key in kept} | {
            "radius": 0.5 * self.needle.outer_diameter,
            "settings": {name: getattr(each, name.removeprefix("bevel_")) for name, each in bevel.items()},
            "bending": {
                "lateral": [{**layer.parameters(), "form": str(layer.form)} for layer in self.lateral],
                "sections": [{"stiffness": self.needle.bending_stiffness}],
                "needle_length": self.needle.length,
                **self.options,
            },
        }


def steering_presets() -> dict[str, SteeringPreset]:
    """The needles in layers by name, the first of which the page opens with."""
    return {"bevel": _bevel(), "rig": _rig(), "hub": _hub()}


def _bevel() -> SteeringPreset:
    needle = preset("paper").needle
    assert needle is not None
    half_angle = np.radians(20.0)
    layer = core.LateralLayer
    return SteeringPreset(
        title="Polymer with a bevel, two layers",
        summary="0.7 mm, E = 14.1 GPa, bevel of 20°, guided 20 mm above the surface; 20 kPa, below 25 mm 60 kPa.",
        axial="paper",
        needle=needle,
        lateral=(layer(modulus=20e3), layer(top=25e-3, modulus=60e3)),
        depth=50e-3,
        target=(4e-3, 2e-3, 45e-3),
        obstacles=((-3e-3, 2e-3, 30e-3, 2.5e-3),),
        bevel=core.Bevel(half_angle=half_angle, friction_coefficient=0.1, face_share=0.5),
        options={"guide_distance": 20e-3, "bevel_length": needle.outer_diameter / np.tan(half_angle)},
    )


def _rig() -> SteeringPreset:
    phantom = SteeringPhantom(unevenness=0.0)
    return SteeringPreset(
        title="Steel, gel of the steering rig",
        summary="1.27 mm, gel that yields sideways, as in needleforce steer simulate, but even.",
        axial="paper",
        needle=phantom.needle,
        lateral=tuple(phantom.layers(np.random.default_rng(0))[:2]),
        depth=90e-3,
        target=(4e-3, -2e-3, 80e-3),
        options={
            "guide_distance": phantom.guide_distance,
            "rotational_compliance": phantom.rotational_compliance,
            "bevel_length": 2.0 * phantom.needle.outer_diameter,
            "tip_memory": 5e-3,
            "path_spacing": 2e-4,
            "max_slope": 1.0,
        },
    )


def _hub() -> SteeringPreset:
    return SteeringPreset(
        title="Nitinol, held at its hub",
        summary="1 mm, E = 60 GPa, 100 mm long, no guide: the hub moves and tilts; 15 kPa, force of 0.05 N on the tip.",
        axial="paper",
        needle=core.Needle(1e-3, 0.0, 100e-3, 60e9, 0.33),
        lateral=(core.LateralLayer(modulus=15e3, tip_force=0.05),),
        depth=60e-3,
        target=(2e-3, 3e-3, 55e-3),
        options={"bevel_length": 5e-3},
    )
