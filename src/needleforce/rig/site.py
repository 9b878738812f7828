# SPDX-License-Identifier: Apache-2.0
"""Where on the phantom: what differs from site to site, drawn."""

from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError
from .paper import PAPER
from .specimen import Specimen


@dataclass(frozen=True)
class Scatter:
    """Standard deviations between sites. The first three are the paper's; it gives none for friction and the surface.

    ``puncture_force`` [N] and ``puncture_depth`` [m] are drawn independently and the modulus is derived from them:
    modulus and depth drawn independently would scatter the peak by more than the paper's 0.0105 N. ``cutting_force``
    and ``friction_per_length`` are shares of the mean; ``surface`` [m] is where the surface is in the rig's zero.
    """

    puncture_force: float = PAPER["puncture_force"][1]
    puncture_depth: float = PAPER["puncture_indentation"][1]
    cutting_force: float = PAPER["cutting_force"][1] / PAPER["cutting_force"][0]
    friction_per_length: float = 0.05
    surface: float = 0.2e-3

    def __post_init__(self):
        for quantity, value in vars(self).items():
            if not (np.isfinite(value) and value >= 0.0):
                raise InputError(f"scatter.{quantity}", value, "must be at least 0")


@dataclass(frozen=True)
class Site:
    """One site as drawn: its specimen, where its surface is in the rig's depth [m], and its lateral force.

    ``lateral`` are Fx and Fy as shares of the axial force, 2 to 5 % together (assumed): the paper calls them relatively
    small and neglects them.
    """

    speed: float
    number: int
    specimen: Specimen
    surface: float
    lateral: tuple[float, float]


def draw_site(mean: Specimen, scatter: Scatter, speed: float, number: int, random: np.random.Generator) -> Site:
    """A site around ``mean``. Every quantity takes its draw in a fixed order, so that changing one moves no other."""
    peak, depth, cutting, friction, surface = random.standard_normal(5)
    share, direction = random.uniform(0.02, 0.05), random.uniform(0.0, 2.0 * np.pi)
    specimen = replace(
        mean,
        puncture_force=mean.puncture_force + scatter.puncture_force * float(peak),
        puncture_depth=mean.puncture_depth + scatter.puncture_depth * float(depth),
        cutting_force=mean.cutting_force * max(0.0, 1.0 + scatter.cutting_force * float(cutting)),
        friction_per_length=mean.friction_per_length * max(0.0, 1.0 + scatter.friction_per_length * float(friction)),
    )
    lateral = (float(share * np.cos(direction)), float(share * np.sin(direction)))
    return Site(speed, number, specimen, scatter.surface * float(surface), lateral)
