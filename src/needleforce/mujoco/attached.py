# SPDX-License-Identifier: Apache-2.0
"""A model attached to a needle in MuJoCo, on a slide joint or at the site of its tip, stepped from Python: the same
numbers as the plugin."""

from dataclasses import dataclass
from numbers import Real

import numpy as np

from .. import core
from ..errors import InputError
from ..models.model import Insertion, Model

LEAST_INCLINATION = 0.17
"""A needle within 10 degrees of lying along the surface has no depth along its axis."""

SAME_FORCE = 1e-6
"""[N] to which force and motion agree."""
MOST_ATTEMPTS = 24


def library():
    """The package mujoco. Raises InputError that names the extra where it is not installed."""
    try:
        import mujoco
    except ImportError as missing:
        step = 'pip install "needleforce[mujoco]"'
        raise InputError("mujoco", "not installed", "needed here", next_step=f"{step} installs it.") from missing
    return mujoco


@dataclass(frozen=True)
class OnJoint:
    """A slide joint; ``surface_height`` [m] is its position when the tip touches."""

    joint: int
    dof: int
    tree: int
    surface_height: float

    def free(self, m, d) -> tuple[float, float]:
        """Depth at the end of the step without the tissue [m], and how far 1 N takes it back [m/N]."""
        unit, moved = np.zeros((1, m.nv)), np.zeros((1, m.nv))
        unit[0, self.dof] = 1.0
        library().mj_solveM(m, d, moved, unit)
        dt = m.opt.timestep
        depth = d.qpos[m.jnt_qposadr[self.joint]] - self.surface_height
        return depth + dt * d.qvel[self.dof], dt * dt * moved[0, self.dof]

    def apply(self, m, d, sample) -> None:
        """Adds the tissue's force to the passive forces."""
        d.qfrc_passive[self.dof] -= sample.force


@dataclass(frozen=True)
class AtSite:
    """A site at the tip, its z axis that of the insertion; a plane of a ``surface`` site or height and normal."""

    site: int
    tree: int
    surface: int
    surface_height: float
    normal: np.ndarray

    def _above(self, d) -> tuple[float, np.ndarray]:
        tip = d.site_xpos[self.site]
        if self.surface < 0:
            return self.normal @ tip - self.surface_height, self.normal
        normal = d.site_xmat[self.surface].reshape(3, 3)[:, 2]
        return normal @ tip - normal @ d.site_xpos[self.surface], normal

    def free(self, m, d) -> tuple[float, float]:
        """As ``OnJoint.free``; NaN where the axis does not point into the tissue."""
        axis = d.site_xmat[self.site].reshape(3, 3)[:, 2]
        height, normal = self._above(d)
        inwards = -(normal @ axis)
        if inwards < LEAST_INCLINATION:
            return np.nan, 0.0
        depth, moves = -height / inwards, np.zeros(6)
        library().mj_objectVelocity(m, d, library().mjtObj.mjOBJ_SITE, self.site, moves, 0)
        rate = (-(normal @ moves[3:]) + depth * (normal @ np.cross(moves[:3], axis))) / inwards
        dt = m.opt.timestep
        return depth + dt * rate, dt * dt * self._mobility(m, d, -normal / inwards, axis)

    def _mobility(self, m, d, felt: np.ndarray, pushed: np.ndarray) -> float:
        jacobian, moved = np.zeros((3, m.nv)), np.zeros((1, m.nv))
        library().mj_jacSite(m, d, jacobian, None, self.site)
        library().mj_solveM(m, d, moved, (pushed @ jacobian)[None])
        return float(felt @ jacobian @ moved[0])

    def apply(self, m, d, sample) -> None:
        """Adds the tissue's force, against the axis and across it along the site's x axis, at the tip."""
        frame = d.site_xmat[self.site].reshape(3, 3)
        force = sample.lateral * frame[:, 0] - sample.force * frame[:, 2]
        body, tip = m.site_bodyid[self.site], d.site_xpos[self.site]
        library().mj_applyFT(m, d, force, np.zeros(3), tip, body, d.qfrc_passive)


def place_of(m, joint, site, surface_site, surface_height: float, surface_normal) -> OnJoint | AtSite:
    """The place by names. Raises InputError for names not in the model, and for what does not go together."""
    if (joint is None) == (site is None):
        value = "neither" if joint is None else "both"
        raise InputError("joint or site", value, "not one of them", next_step="Give a slide joint or the tip's site.")
    if not (isinstance(surface_height, Real) and np.isfinite(surface_height)):
        raise InputError("surface_height", surface_height, "not a finite number", next_step="Give it in m.")
    if joint is not None:
        return _on_joint(m, joint, surface_height, surface_site, surface_normal)
    normal = np.array([0.0, 0.0, 1.0] if surface_normal is None else surface_normal, dtype=float)
    if normal.shape != (3,) or not np.linalg.norm(normal) > 1e-6:
        raise InputError("surface_normal", surface_normal, "no direction", next_step="Give x, y, z.")
    tip, surface = _named(m, "SITE", site), -1 if surface_site is None else _named(m, "SITE", surface_site)
    if surface >= 0 and m.body_weldid[m.site_bodyid[surface]] != 0:
        raise InputError("surface_site", surface_site, "on a body that moves", next_step="Fix it to the world.")
    return AtSite(tip, m.body_treeid[m.site_bodyid[tip]], surface, surface_height, normal / np.linalg.norm(normal))


def _on_joint(m, joint: str, surface_height: float, surface_site, surface_normal) -> OnJoint:
    if surface_site is not None or surface_normal is not None:
        raise InputError("surface", "a site or normal", "not for a joint", next_step="Give surface_height.")
    number = _named(m, "JOINT", joint)
    if m.jnt_type[number] != library().mjtJoint.mjJNT_SLIDE:
        raise InputError("joint", joint, "not a slide joint", next_step="Give the site of the tip.")
    dof = m.jnt_dofadr[number]
    return OnJoint(number, dof, m.dof_treeid[dof], surface_height)


def _named(m, kind: str, name: str) -> int:
    number = library().mj_name2id(m, getattr(library().mjtObj, f"mjOBJ_{kind}"), name)
    if number < 0:
        raise InputError(kind.lower(), name, "no such name in the model", next_step="Name it in the XML.")
    return number


class Attached:
    """A needle that feels tissue: ``sample`` is its last row, ``place`` where it is. One for each ``MjData``."""

    def __init__(self, model: Model, place, max_speed: float, bevel: core.Bevel | None):
        self.place, self.sample = place, None
        self._memory = Insertion(model, max_speed=max_speed, bevel=bevel)
        self._trial = Insertion(model, max_speed=max_speed, bevel=bevel)

    def reset(self) -> None:
        """Back to whole tissue, as after ``mj_resetData``."""
        self._memory.reset()
        self.sample = None

    def push(self, m, d, needles: int = 1):
        """Adds the tissue's force of this step to ``d.qfrc_passive`` and moves the memory; returns the sample.

        For use between ``mj_step1`` and ``mj_step2``. ``needles`` share the mass of its tree.
        """
        depth, per_force = self.place.free(m, d)
        self.sample = self._at_end_of_step(depth, needles * per_force, m.opt.timestep)
        self._memory.restore(self._trial)
        self.place.apply(m, d, self.sample)
        return self.sample

    def _at_end_of_step(self, depth: float, per_force: float, dt: float):
        """Solves z + per_force F(z) = depth; the trial engine stands at the answer."""
        low, high = -np.inf, np.inf
        z = depth - per_force * (self.sample.force if self.sample else 0.0)
        for _ in range(MOST_ATTEMPTS):
            self._trial.restore(self._memory)
            sample = self._trial.step(z, None, dt)
            miss = z - depth + per_force * sample.force
            if not abs(miss) > per_force * SAME_FORCE:
                break
            low, high = (low, z) if miss > 0.0 else (z, high)
            rise = sample.force_by_depth + sample.force_by_velocity / dt
            after = z - miss / (1.0 + per_force * max(0.0, rise))
            z = after if low < after < high else 0.5 * (low + high)
        return sample


def attach(
    model: Model,
    mj_model,
    *,
    joint: str | None = None,
    site: str | None = None,
    surface_site: str | None = None,
    surface_height: float = 0.0,
    surface_normal=None,
    max_speed: float = 1.0,
    bevel: core.Bevel | None = None,
) -> Attached:
    """Tissue around the slide joint ``joint``, or the ``site`` of a tip whose z axis is that of the insertion.

    The surface is at the joint's position ``surface_height`` [m]; for a site it is the plane of ``surface_site``, whose
    z axis points out of the tissue, or that at ``surface_height`` along ``surface_normal``, upwards if not given.
    ``max_speed`` [m/s] and ``bevel`` are those of ``nf.Insertion``. Raises InputError for names that are not in the
    model, and without the extra ``mujoco``.
    """
    library()
    place = place_of(mj_model, joint, site, surface_site, surface_height, surface_normal)
    return Attached(model, place, max_speed, bevel)


def step(mj_model, data, *needles: Attached) -> None:
    """One step of MuJoCo with the tissue of ``needles``: in place of ``mj_step``. ``ctrl`` is set before.

    Raises InputError for RK4, which evaluates forces within the step: take the plugin.
    """
    mujoco = library()
    if mj_model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4:
        next_step = "Take implicitfast, or the plugin of integrations/mujoco."
        raise InputError("integrator", "RK4", "evaluates forces within the step", next_step=next_step)
    trees = [needle.place.tree for needle in needles]
    mujoco.mj_step1(mj_model, data)
    for needle in needles:
        needle.push(mj_model, data, trees.count(needle.place.tree))
    mujoco.mj_step2(mj_model, data)
