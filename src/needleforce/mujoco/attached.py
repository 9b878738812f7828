# SPDX-License-Identifier: Apache-2.0
"""A model attached to a needle in MuJoCo, stepped from Python: the same numbers as the plugin.

The step is a function and no callback: MuJoCo has one callback for all models, calls it several times a step and does
not say when a step is done, but the memory of the tissue may move once a step alone. Why the force is that at the end
of the step stands in ``integrations/mujoco/end_of_step.hpp``.
"""

import numpy as np

from .. import core
from ..errors import InputError
from ..models.model import Insertion, Model
from .place import library, place_of

SAME_FORCE = 1e-6
"""[N] to which force and motion agree."""
MOST_ATTEMPTS = 24


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
