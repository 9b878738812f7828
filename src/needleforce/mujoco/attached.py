# SPDX-License-Identifier: Apache-2.0
"""A model attached to a needle in MuJoCo, on a slide joint or at the site of its tip, stepped from Python with the same
results as the plugin."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import core
from ..checks import finite_number
from ..errors import InputError
from ..models.model import Insertion, Model

MIN_INCLINATION = 0.17
"""Sine of the angle between needle and surface; below it, at 10 degrees, there is no depth along the axis."""

FORCE_TOLERANCE_N = 1e-6
"""[N] tolerance of the equation between force and motion."""
MAX_ITERATIONS = 24


def library() -> Any:
    """The package mujoco. Raises InputError that names the extra if it is not installed."""
    try:
        import mujoco
    except ImportError as missing:
        step = 'pip install "needleforce[mujoco]"'
        raise InputError("mujoco", "not installed", "it is needed here", next_step=f"Run {step}.") from missing
    return mujoco


@dataclass(frozen=True)
class OnJoint:
    """A needle on a slide joint; ``surface_height`` [m] is the position of the joint at first contact."""

    joint: int
    dof: int
    tree: int
    surface_height: float

    def free(self, m: Any, d: Any) -> tuple[float, float]:
        """Depth at the end of the step without the tissue [m], and its reduction by a force [m/N]."""
        unit, moved = np.zeros((1, m.nv)), np.zeros((1, m.nv))
        unit[0, self.dof] = 1.0
        library().mj_solveM(m, d, moved, unit)
        dt = m.opt.timestep
        depth = d.qpos[m.jnt_qposadr[self.joint]] - self.surface_height
        return depth + dt * d.qvel[self.dof], dt * dt * moved[0, self.dof]

    def apply(self, m: Any, d: Any, sample: core.Sample) -> None:
        """Add the tissue's force to the passive forces."""
        d.qfrc_passive[self.dof] -= sample.force


@dataclass(frozen=True)
class AtSite:
    """A site at the tip whose z axis points along the needle; the surface is that of a site, or a height and normal."""

    site: int
    tree: int
    surface: int
    surface_height: float
    normal: np.ndarray

    def _above(self, d: Any) -> tuple[float, np.ndarray]:
        tip = d.site_xpos[self.site]
        if self.surface < 0:
            return self.normal @ tip - self.surface_height, self.normal
        normal = d.site_xmat[self.surface].reshape(3, 3)[:, 2]
        return normal @ tip - normal @ d.site_xpos[self.surface], normal

    def free(self, m: Any, d: Any) -> tuple[float, float]:
        """As ``OnJoint.free``; NaN if the axis does not point into the tissue."""
        axis = d.site_xmat[self.site].reshape(3, 3)[:, 2]
        height, normal = self._above(d)
        inwards = -(normal @ axis)
        if inwards < MIN_INCLINATION:
            return np.nan, 0.0
        depth, moves = -height / inwards, np.zeros(6)
        site_type = library().mjtObj.mjOBJ_SITE
        library().mj_objectVelocity(m, d, objtype=site_type, objid=self.site, res=moves, flg_local=0)
        rate = (-(normal @ moves[3:]) + depth * (normal @ np.cross(moves[:3], axis))) / inwards
        dt = m.opt.timestep
        return depth + dt * rate, dt * dt * self._mobility(m, d, -normal / inwards, axis)

    def _mobility(self, m: Any, d: Any, measured: np.ndarray, pushed: np.ndarray) -> float:
        jacobian, moved = np.zeros((3, m.nv)), np.zeros((1, m.nv))
        library().mj_jacSite(m, d, jacobian, None, self.site)
        library().mj_solveM(m, d, moved, (pushed @ jacobian)[None])
        return float(measured @ jacobian @ moved[0])

    def apply(self, m: Any, d: Any, sample: core.Sample) -> None:
        """Add the tissue's force at the tip: against the axis, and the lateral force along the site's x axis."""
        frame = d.site_xmat[self.site].reshape(3, 3)
        force = sample.lateral * frame[:, 0] - sample.force * frame[:, 2]
        body, tip = m.site_bodyid[self.site], d.site_xpos[self.site]
        library().mj_applyFT(m, d, force=force, torque=np.zeros(3), point=tip, body=body, qfrc_target=d.qfrc_passive)


def place_of(
    m: Any,
    *,
    joint: str | None,
    site: str | None,
    surface_site: str | None,
    surface_height: float,
    surface_normal: ArrayLike | None,
) -> OnJoint | AtSite:
    """The place of a needle by names. Raises InputError for unknown names and for arguments that contradict."""
    if (joint is None) == (site is None):
        value = "neither" if joint is None else "both"
        raise InputError(
            "joint or site", value, "exactly one is needed", next_step="Give a slide joint or the tip's site."
        )
    finite_number("surface_height", surface_height, "Give it in m.")
    if joint is not None:
        return _on_joint(m, joint, surface_height, surface_site, surface_normal)
    normal = np.array([0.0, 0.0, 1.0] if surface_normal is None else surface_normal, dtype=float)
    if normal.shape != (3,) or not np.linalg.norm(normal) > 1e-6:
        raise InputError("surface_normal", surface_normal, "not a direction", next_step="Give x, y and z, not all 0.")
    tip, surface = named(m, "SITE", site), -1 if surface_site is None else named(m, "SITE", surface_site)
    if surface >= 0 and m.body_weldid[m.site_bodyid[surface]] != 0:
        raise InputError("surface_site", surface_site, "on a moving body", next_step="Fix it to the world.")
    return AtSite(tip, m.body_treeid[m.site_bodyid[tip]], surface, surface_height, normal / np.linalg.norm(normal))


def _on_joint(
    m: Any, joint: str, surface_height: float, surface_site: str | None, surface_normal: ArrayLike | None
) -> OnJoint:
    if surface_site is not None or surface_normal is not None:
        raise InputError("surface", "a site or normal", "not possible for a joint", next_step="Give surface_height.")
    number = named(m, "JOINT", joint)
    if m.jnt_type[number] != library().mjtJoint.mjJNT_SLIDE:
        raise InputError("joint", joint, "not a slide joint", next_step="Give the site of the tip.")
    dof = m.jnt_dofadr[number]
    return OnJoint(number, dof, m.dof_treeid[dof], surface_height)


def named(m: Any, kind: str, name: str) -> int:
    """Number of an object of MuJoCo's model. Raises InputError for an unknown name."""
    number = library().mj_name2id(m, getattr(library().mjtObj, f"mjOBJ_{kind}"), name)
    if number < 0:
        raise InputError(kind.lower(), name, "not a name in the model", next_step="Give it this name in the XML.")
    return number


class Attached:
    """A needle in tissue; ``sample`` is its last sample, ``place`` its joint or site. Use one for each ``MjData``."""

    def __init__(self, insertion: Any, place: OnJoint | AtSite):
        self.place, self.sample = place, None
        self._memory, self._trial = insertion, insertion.snapshot()

    def reset(self) -> None:
        """Reset to intact tissue, as after ``mj_resetData``."""
        self._memory.reset()
        self.sample = None

    def push(self, m: Any, d: Any, needles: int = 1) -> core.Sample:
        """Add the tissue's force of this step to ``d.qfrc_passive``; for use between ``mj_step1`` and ``mj_step2``.

        Parameters
        ----------
        m, d : mujoco.MjModel, mujoco.MjData
            MuJoCo's model and state.
        needles : int
            Number of needles that share the mass of its kinematic tree.

        Returns
        -------
        Sample
            The sample at the end of the step.
        """
        depth, per_force = self.place.free(m, d)
        self.sample = self._at_end_of_step(depth, needles * per_force, m.opt.timestep)
        self._memory.restore(self._trial)
        self.place.apply(m, d, self.sample)
        return self.sample

    def _at_end_of_step(self, depth: float, per_force: float, dt: float) -> core.Sample:
        """Solve z + per_force F(z) = depth; the trial engine is then in the state of the solution."""
        low, high = -np.inf, np.inf
        z = depth - per_force * (self.sample.force if self.sample else 0.0)
        for _ in range(MAX_ITERATIONS):
            self._trial.restore(self._memory)
            sample = self._trial.step(z, None, dt)
            residual = z - depth + per_force * sample.force
            if not abs(residual) > per_force * FORCE_TOLERANCE_N:
                break
            low, high = (low, z) if residual > 0.0 else (z, high)
            rise = sample.force_by_depth + sample.force_by_velocity / dt
            after = z - residual / (1.0 + per_force * max(0.0, rise))
            z = after if low < after < high else 0.5 * (low + high)
        return sample


def attach(
    model: Model,
    mj_model: Any,
    *,
    joint: str | None = None,
    site: str | None = None,
    surface_site: str | None = None,
    surface_height: float = 0.0,
    surface_normal: ArrayLike | None = None,
    max_speed: float = 1.0,
    bevel: core.Bevel | None = None,
    tissue: Any = None,
) -> Attached:
    """Attach tissue to a needle in a MuJoCo model, on a slide joint or at the site of its tip.

    Parameters
    ----------
    model : Model
        The tissue and the needle.
    mj_model : mujoco.MjModel
        MuJoCo's model.
    joint : str, optional
        Slide joint of the needle. Exactly one of ``joint`` and ``site`` is given.
    site : str, optional
        Site at the tip whose z axis points along the needle, in the direction of insertion.
    surface_site : str, optional
        For a site: a fixed site in the surface whose z axis points out of the tissue.
    surface_height : float
        For a joint: its position at first contact [m]. For a site without ``surface_site``: height of the surface
        along ``surface_normal`` [m].
    surface_normal : array_like, shape (3,), optional
        Normal of the surface out of the tissue; default: upwards.
    max_speed : float
        As for ``nf.Insertion`` [m/s].
    bevel : core.Bevel, optional
        As for ``nf.Insertion``.
    tissue : nf.fe.CondensedTissue, optional
        A solid that needle and tissue of the model drag along the path on which it was condensed.

    Returns
    -------
    Attached
        The needle, to be passed to ``step``.

    Raises
    ------
    InputError
        If a name is not in the model, arguments contradict, or the extra ``mujoco`` is not installed.
    """
    library()
    place = place_of(
        mj_model,
        joint=joint,
        site=site,
        surface_site=surface_site,
        surface_height=surface_height,
        surface_normal=surface_normal,
    )
    if tissue is None:
        return Attached(Insertion(model, max_speed=max_speed, bevel=bevel), place)
    from ..fe.elastic.condensed import CondensedInsertion

    return Attached(CondensedInsertion(tissue, model, max_speed=max_speed, bevel=bevel), place)


def step(mj_model: Any, data: Any, *needles: Attached) -> None:
    """Make one step of MuJoCo with the tissue of the needles, instead of ``mj_step``; set ``ctrl`` before.

    Parameters
    ----------
    mj_model, data : mujoco.MjModel, mujoco.MjData
        MuJoCo's model and state.
    *needles : Attached
        The needles.

    Raises
    ------
    InputError
        If the integrator is RK4, which evaluates forces within the step; use the plugin for it.
    """
    mujoco = library()
    if mj_model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4:
        next_step = "Use implicitfast, or the plugin in integrations/mujoco."
        raise InputError("integrator", "RK4", "it evaluates forces within the step", next_step=next_step)
    trees = [needle.place.tree for needle in needles]
    mujoco.mj_step1(mj_model, data)
    for needle in needles:
        needle.push(mj_model, data, trees.count(needle.place.tree))
    mujoco.mj_step2(mj_model, data)
