# SPDX-License-Identifier: Apache-2.0
"""The source paper's values, and a site of the phantom: its own values, and the axial force with effects that the
fitted model omits."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from .. import core
from ..checks import not_below_zero
from ..errors import InputError
from ..models.model import Insertion, Model

# values of the source paper's experiment, sec. 1 and 2: mean and standard deviation [SI], None if it gives none
PAPER = {
    "needle_young_modulus": (14.1e9, 1.6e9),
    "tissue_young_modulus": (116e3, None),
    "puncture_force": (0.2101, 0.0105),
    "puncture_indentation": (3.237e-3, 0.1347e-3),
    "friction_per_length": (18.6, None),
    "cutting_force": (0.0776, 0.0139),
}
# range of the stick–slip oscillation of the cutting force [N] at 1 mm/s; at 3 mm/s there is none
CUTTING_OSCILLATION = {"cutting_force_low_1mm_s": 0.04, "cutting_force_high_1mm_s": 0.1}
_ARREST_SPEED = 1.5e-3  # [m/s] any value between the two speeds gives the same forces
_STEADY_SPEED = 3e-3  # [m/s]
RADIUS = 0.35e-3  # [m] source paper sec. 1
HALF_ANGLE = math.radians(15.0)  # source paper sec. 2.1: the bevel angle, used as the half angle of a cone
HOLD = 1.0  # [s] at the deepest point
PRESLIDING = 20e-6  # [m] of travel until the friction is that of sliding
# Opening a slit to the needle's radius in plane strain: pi/4 E' R^2 = 0.0149 N, with E = 116 kPa and an incompressible
# tissue: the energy per length of slit (Azar & Hayward 2008).
SPREADING = 0.25 * math.pi * PAPER["tissue_young_modulus"][0] / (1.0 - 0.5**2) * RADIUS**2


def stick_slip(force: float) -> core.laws.StickSlip:
    """A cutting law with a steady ``force`` [N] at 3 mm/s that oscillates at 1 mm/s over the paper's scaled range."""
    low, high = (force / PAPER["cutting_force"][0] * end for end in CUTTING_OSCILLATION.values())
    return core.laws.StickSlip(
        break_force=high,
        arrest_force=low,
        arrest_speed=_ARREST_SPEED,
        damping=(force - low) / (_STEADY_SPEED - _ARREST_SPEED),
    )


@dataclass(frozen=True)
class Unmodelled:
    """Effects that are in neither the source paper's model nor its procedure.

    The defaults are assumed, except ``spreading_force`` and ``straight_to``.

    Parameters
    ----------
    dimple : float
        Depth of the surface around the shaft during the first pass [m]: less shaft is embedded while the hole is cut,
        and the needle exits there on withdrawal. The second pass has no dimple.
    spreading_force : float
        Force that opens the hole in both passes while the tip advances [N]; proportional to the square of the tip's
        radius at the surface until the shank is reached.
    straight_to : float
        Depth up to which the needle is straight [m]: the paper's 12 mm, where friction begins to deviate.
    friction_growth : float
        Relative growth of the friction per length per depth beyond ``straight_to`` [1/m].
    second_friction_ratio : float
        Friction of the second pass relative to the first [1].

    Raises
    ------
    InputError
        If a value is negative or not finite.
    """

    dimple: float = 0.8e-3
    spreading_force: float = SPREADING
    straight_to: float = 12e-3
    friction_growth: float = 150.0
    second_friction_ratio: float = 1.0

    def __post_init__(self):
        for quantity, value in vars(self).items():
            not_below_zero(f"specimen.{quantity}", value)


NOTHING_UNMODELLED = Unmodelled(dimple=0.0, spreading_force=0.0, friction_growth=0.0)
_PAPER = Unmodelled()


@dataclass(frozen=True)
class Specimen:
    """A site with its own values; the defaults are the source paper's means (sec. 2.1-2.3, at 3 mm/s).

    Parameters
    ----------
    puncture_force, puncture_depth : float
        Force [N] and depth [m] of the puncture. They determine the modulus, with a contact that stops growing at the
        needle's radius.
    friction_per_length : float
        Friction per embedded length [N/m].
    cutting_force : float
        Cutting force [N].
    unmodelled : Unmodelled
        Effects that the paper's model omits.
    cutting : callable
        ``cutting(force=cutting_force)`` returns the cutting law.
    """

    puncture_force: float = PAPER["puncture_force"][0]
    puncture_depth: float = PAPER["puncture_indentation"][0]
    friction_per_length: float = PAPER["friction_per_length"][0]
    cutting_force: float = PAPER["cutting_force"][0]
    unmodelled: Unmodelled = _PAPER
    cutting: Callable = core.laws.ConstantCutting

    @property
    def reduced_modulus(self) -> float:
        """Reduced modulus [Pa] for which the saturated contact has the peak force at the puncture depth."""
        unit = core.laws.ConeCylinder(reduced_modulus=1.0, half_angle=HALF_ANGLE, radius=RADIUS)
        return self.puncture_force / unit.force(self.puncture_depth)

    def model(self, second: bool = False) -> Model:
        """The laws of the first or the second pass; of the unmodelled effects it includes dimple and friction ratio."""
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
        """Parts of the axial force in one insertion: in, optionally a hold, and out.

        Parameters
        ----------
        depth : ndarray, shape (n,)
            Depth below the undeformed surface [m].
        hole : float
            Depth of the hole of an earlier pass [m], 0 for fresh tissue: down to it there is no deformation, puncture
            or cutting.
        dt : float
            Time step [s].

        Returns
        -------
        dict of str to ndarray
            Forces (n,) [N]: ``stiffness``, ``friction``, ``cutting``, and the unmodelled ``spreading`` and ``bending``,
            the additional friction of the needle that is not straight.

        Raises
        ------
        InputError
            If the hole is not deeper than the puncture, or a step is invalid.
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
        """The axial force (n,) [N], + opposes insertion: the sum of ``parts``, with the same parameters."""
        return sum(self.parts(depth, hole=hole, dt=dt).values())

    def pierced(self, hole: float, outside: float, step: float, dt: float) -> Insertion:
        """The second pass at its start, ``outside`` <= 0 [m], after a first one to ``hole`` [m] and out again.

        The first pass is made in steps of ``step`` [m] and ``dt`` [s], with a hold: the depth of its crack depends on
        both.
        """
        if not hole > self.puncture_depth:
            raise InputError("hole", f"{hole} m", f"must be deeper than the puncture at {self.puncture_depth:.4g} m")
        stroke = np.linspace(outside, hole, max(2, int(np.ceil((hole - outside) / max(step, 1e-7)))))
        depth, times = np.concatenate([stroke, [hole], stroke[::-1]]), np.full(2 * len(stroke) + 1, dt)
        times[len(stroke)] = HOLD
        insertion = Insertion(self.model(second=True))
        insertion.run(depth, None, times)
        return insertion

    def _unmodelled_parts(self, depth: np.ndarray, second: bool) -> dict[str, np.ndarray]:
        deepest = np.maximum.accumulate(depth)
        pierced = second | (deepest > self.puncture_depth)
        # +1 for insertion, -1 for withdrawal: the bristle state of the core's friction
        sliding = np.clip(1.0 - (deepest - depth) / PRESLIDING, -1.0, 1.0) * pierced
        return self.unmodelled_forces(depth, sliding, second)

    def unmodelled_forces(
        self, depth: float | np.ndarray, sliding: float | np.ndarray, second: bool
    ) -> dict[str, float | np.ndarray]:
        """The forces [N] that are in no law, at ``depth`` [m], numbers or (n,) each.

        ``sliding`` is +1 for insertion to -1 for withdrawal, and 0 before the puncture.
        """
        more = self.unmodelled
        opened = np.clip((depth - (0.0 if second else more.dimple)) * math.tan(HALF_ANGLE) / RADIUS, 0.0, 1.0)
        beyond = np.maximum(depth - more.straight_to, 0.0)
        ratio = more.second_friction_ratio if second else 1.0
        growth = 0.5 * self.friction_per_length * ratio * more.friction_growth
        # during withdrawal the hole closes behind the tip and no energy is recovered
        spreading = more.spreading_force * opened**2 * np.maximum(sliding, 0.0)
        return {"spreading": spreading, "bending": growth * beyond**2 * sliding}


def _check(status: np.ndarray) -> None:
    invalid = np.flatnonzero(status)
    if len(invalid):
        name = core.status_names()[int(status[invalid[0]])]
        limit = f"at sample {invalid[0]}"
        raise InputError("status of the specimen", str(name), limit, next_step="Give depths in smaller steps.")


@dataclass(frozen=True)
class Scatter:
    """Standard deviations between sites; those of friction and surface are assumed, the others are the source paper's.

    The modulus is derived from puncture force and depth, which are drawn independently: with an independent modulus and
    depth the scatter of the peak would exceed the paper's 0.0105 N.

    Parameters
    ----------
    puncture_force, puncture_depth : float
        Of the force [N] and the depth [m] of the puncture, at least 0.
    cutting_force, friction_per_length : float
        Relative to the mean [1], at least 0.
    surface : float
        Of the depth of the surface in the rig's zero [m], at least 0.

    Raises
    ------
    InputError
        If a value is negative or not finite.
    """

    puncture_force: float = PAPER["puncture_force"][1]
    puncture_depth: float = PAPER["puncture_indentation"][1]
    cutting_force: float = PAPER["cutting_force"][1] / PAPER["cutting_force"][0]
    friction_per_length: float = 0.05
    surface: float = 0.2e-3

    def __post_init__(self):
        for quantity, value in vars(self).items():
            not_below_zero(f"scatter.{quantity}", value)


@dataclass(frozen=True)
class PhantomSite:
    """A drawn site: its specimen, the depth of its surface in the rig's zero [m], and its lateral force.

    ``lateral`` is Fx and Fy relative to the axial force, 2 to 5 % together (assumed): the source paper calls them
    relatively small and neglects them.
    """

    speed: float
    number: int
    specimen: Specimen
    surface: float
    lateral: tuple[float, float]


def draw_site(mean: Specimen, scatter: Scatter, speed: float, number: int, random: np.random.Generator) -> PhantomSite:
    """Draw a site around ``mean``, each quantity in a fixed order, so that changing one does not affect the others."""
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
