# SPDX-License-Identifier: Apache-2.0
"""One place in the phantom: what differs from site to site, and the force along the needle, with effects that the
identified model omits."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from .. import core
from ..errors import InputError
from ..models.model import Insertion, Model
from .paper import PAPER

RADIUS = 0.35e-3  # [m] paper, sec. 1
HALF_ANGLE = math.radians(15.0)  # paper, sec. 2.1: the bevel's angle, taken as a cone's
HOLD = 1.0  # [s] at the deepest point
PRESLIDING = 20e-6  # [m] of travel from nothing to sliding
# Opening a slit to the needle's radius in plane strain: pi/4 E' R^2 = 0.0149 N, with E = 116 kPa and an incompressible
# tissue. It is the energy a length of slit takes, after Azar and Hayward 2008.
SPREADING = 0.25 * math.pi * PAPER["tissue_young_modulus"][0] / (1.0 - 0.5**2) * RADIUS**2


@dataclass(frozen=True)
class Unmodelled:
    """What happens at the needle and is in neither the paper's model nor its procedure; sizes are assumed but for two.

    ``dimple`` [m]: the surface stays pushed in by so much on the first pass, not on the second, so that less shaft is
    embedded while the hole is cut; on the first pass the needle leaves the tissue there too. ``spreading_force`` [N]
    opens the hole on both passes while the tip advances, growing with the square of the tip's radius at the surface.
    Beyond ``straight_to`` [m] of depth the needle is no longer straight (the paper's 12 mm, where friction departs):
    friction per length grows by the share ``friction_growth`` [1/m] times the depth beyond, the force with its
    square.
    ``second_friction_ratio``: friction of the second pass over that of the first.
    """

    dimple: float = 0.8e-3
    spreading_force: float = SPREADING
    straight_to: float = 12e-3
    friction_growth: float = 150.0
    second_friction_ratio: float = 1.0

    def __post_init__(self):
        for quantity, value in vars(self).items():
            if not (np.isfinite(value) and value >= 0.0):
                raise InputError(f"specimen.{quantity}", value, "must be at least 0")


NOTHING_UNMODELLED = Unmodelled(dimple=0.0, spreading_force=0.0, friction_growth=0.0)
_PAPER = Unmodelled()


@dataclass(frozen=True)
class Specimen:
    """A site with its own values; the defaults are the paper's means (sec. 2.1-2.3, at 3 mm/s).

    ``puncture_force`` [N] at ``puncture_depth`` [m] give the modulus through the contact that stops growing at the
    needle's radius. ``friction_per_length`` [N/m]; ``cutting_force`` [N] is handed to ``cutting``, which makes the law
    of it, ``cutting(force=…)``: give another one where the force of cutting is no constant.
    """

    puncture_force: float = PAPER["puncture_force"][0]
    puncture_depth: float = PAPER["puncture_indentation"][0]
    friction_per_length: float = PAPER["friction_per_length"][0]
    cutting_force: float = PAPER["cutting_force"][0]
    unmodelled: Unmodelled = _PAPER
    cutting: Callable = core.laws.ConstantCutting

    @property
    def reduced_modulus(self) -> float:
        """The modulus [Pa] with which the saturated contact has the peak force at the puncture depth."""
        unit = core.laws.ConeCylinder(reduced_modulus=1.0, half_angle=HALF_ANGLE, radius=RADIUS)
        return self.puncture_force / unit.force(self.puncture_depth)

    def model(self, second: bool = False) -> Model:
        """The compiled laws of the first or the second pass; what is unmodelled is not all in them."""
        dimple = 0.0 if second else self.unmodelled.dimple
        ratio = self.unmodelled.second_friction_ratio if second else 1.0
        return Model(
            stiffness=core.laws.ConeCylinder(self.reduced_modulus, HALF_ANGLE, RADIUS),
            puncture=core.laws.PunctureDepth(self.puncture_depth),
            friction=core.laws.Coulomb(self.friction_per_length * ratio, PRESLIDING, dimple / self.puncture_depth),
            cutting=self.cutting(force=self.cutting_force),
            name="specimen",
        )

    def parts(self, depth: np.ndarray, *, hole: float = 0.0, dt: float = 1e-3) -> dict[str, np.ndarray]:
        """The parts of the axial force (n,) [N] along ``depth`` (n,) [m], past the undeformed surface.

        One insertion: in, perhaps a hold, and out, in steps of ``dt`` [s]. ``hole`` [m] is the depth of the hole an
        earlier pass left, 0 for fresh tissue: down to it nothing deforms, punctures or is cut. ``spreading`` and
        ``bending``, the friction of the needle no longer straight, are unmodelled.
        """
        depth = np.ascontiguousarray(depth, dtype=float)
        second = hole != 0.0
        step = float(np.abs(np.diff(depth)).max()) if second else 0.0
        insertion = self.pierced(hole, min(depth[0], 0.0), step, dt) if second else Insertion(self.model())
        columns = insertion.run(depth, None, np.full(len(depth), dt))
        _check(columns["status"])
        parts = {part: columns[part] for part in ("stiffness", "friction", "cutting")}
        return parts | self._unmodelled_parts(depth, second)

    def force(self, depth: np.ndarray, *, hole: float = 0.0, dt: float = 1e-3) -> np.ndarray:
        """The axial force (n,) [N], + opposes insertion: the sum of ``parts``."""
        return sum(self.parts(depth, hole=hole, dt=dt).values())

    def pierced(self, hole: float, outside: float, step: float, dt: float) -> Insertion:
        """The second pass at its start, ``outside`` <= 0 [m], after a first one to ``hole`` [m] and out again.

        That one goes in steps of ``step`` [m] and ``dt`` [s], with a hold: how deep the crack stands depends on both.
        """
        if not hole > self.puncture_depth:
            raise InputError("hole", hole, f"must be deeper than the puncture at {self.puncture_depth:.4g} m")
        stroke = np.linspace(outside, hole, max(2, int(np.ceil((hole - outside) / max(step, 1e-7)))))
        depth, times = np.concatenate([stroke, [hole], stroke[::-1]]), np.full(2 * len(stroke) + 1, dt)
        times[len(stroke)] = HOLD
        insertion = Insertion(self.model(second=True))
        insertion.run(depth, None, times)
        return insertion

    def _unmodelled_parts(self, depth: np.ndarray, second: bool) -> dict[str, np.ndarray]:
        deepest = np.maximum.accumulate(depth)
        pierced = second | (deepest > self.puncture_depth)
        # +1 in, -1 out: the bristle of the core's friction
        sliding = np.clip(1.0 - (deepest - depth) / PRESLIDING, -1.0, 1.0) * pierced
        return self.unmodelled_forces(depth, sliding, second)

    def unmodelled_forces(self, depth, sliding, second: bool) -> dict:
        """What is in no law [N], at each ``depth`` [m] with ``sliding`` from +1 in to -1 out, 0 before the puncture.

        Numbers, or (n,) each.
        """
        more = self.unmodelled
        opened = np.clip((depth - (0.0 if second else more.dimple)) * math.tan(HALF_ANGLE) / RADIUS, 0.0, 1.0)
        beyond = np.maximum(depth - more.straight_to, 0.0)
        ratio = more.second_friction_ratio if second else 1.0
        growth = 0.5 * self.friction_per_length * ratio * more.friction_growth
        # coming out, the hole closes behind the tip and gives nothing back
        spreading = more.spreading_force * opened**2 * np.maximum(sliding, 0.0)
        return {"spreading": spreading, "bending": growth * beyond**2 * sliding}


def _check(status: np.ndarray) -> None:
    bad = np.flatnonzero(status)
    if len(bad):
        why = core.status_names()[int(status[bad[0]])]
        raise InputError("depth of the specimen", str(why), f"at sample {bad[0]}", next_step="Take smaller steps.")


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
class PhantomSite:
    """One site as drawn: its specimen, where its surface is in the rig's depth [m], and its lateral force.

    ``lateral`` are Fx and Fy as shares of the axial force, 2 to 5 % together (assumed): the paper calls them relatively
    small and neglects them.
    """

    speed: float
    number: int
    specimen: Specimen
    surface: float
    lateral: tuple[float, float]


def draw_site(mean: Specimen, scatter: Scatter, speed: float, number: int, random: np.random.Generator) -> PhantomSite:
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
    return PhantomSite(speed, number, specimen, scatter.surface * float(surface), lateral)
