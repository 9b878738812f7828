# SPDX-License-Identifier: Apache-2.0
"""Results of an insertion into tissue with mass: the state after a step; forces, energies and targets over time."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class InsertionState:
    """A needle and the tissue around it at one time.

    Attributes
    ----------
    depth : float
        Of the tip from the undeformed surface [m].
    tip : float
        Of the tip along the path, in the tissue as it was before it moved [m].
    cut : float
        How far the path is cut, in the same tissue [m].
    displacement, velocity : ndarray, shape (n,)
        Of the unknowns of the model.
    dragged : ndarray, shape (nodes,)
        Displacement of the tissue along the path at its nodes [m].
    friction : ndarray, shape (nodes,)
        On the tissue at the nodes, + inwards, mean over the last step [N].
    tip_force : float
        On the tissue at the tip, mean over the last step [N].
    slip : ndarray of int, shape (nodes + 1,)
        1 where the needle slides inwards past the tissue, -1 outwards, 0 where it sticks or is not yet; last the tip,
        where 1 is cutting and -1 is without force.
    """

    depth: float
    tip: float
    cut: float
    displacement: np.ndarray
    velocity: np.ndarray
    dragged: np.ndarray
    friction: np.ndarray
    tip_force: float
    slip: np.ndarray

    @property
    def force(self) -> float:
        """At the base of the needle, + opposes insertion [N]."""
        return float(self.friction.sum()) + self.tip_force


@dataclass(frozen=True, eq=False)
class InsertionEnergy:
    """Energies of an insertion [J], each (k,): ``work = kinetic + strain + damped + friction + numerical``.

    That is for tissue at rest at the start; otherwise ``kinetic + strain`` is less what it was there.

    Attributes
    ----------
    work : ndarray
        Of the base of the needle.
    kinetic, strain : ndarray
        Of the tissue.
    damped : ndarray
        By the damping of the tissue.
    friction : ndarray
        By friction along the shaft and by cutting.
    numerical : ndarray
        By the rule of integration; zero for ``theta=0.5``.
    """

    work: np.ndarray
    kinetic: np.ndarray
    strain: np.ndarray
    damped: np.ndarray
    friction: np.ndarray
    numerical: np.ndarray


@dataclass(frozen=True, eq=False)
class InsertionRun:
    """An insertion over time: k steps.

    Attributes
    ----------
    time, depth : ndarray, shape (k,)
        At the end of each step [s], [m].
    force : ndarray, shape (k,)
        At the base, mean over the step, + opposes insertion [N].
    tip_force : ndarray, shape (k,)
        Part of it at the tip [N].
    tip : ndarray, shape (k,)
        Of the tip along the path, in the tissue as it was [m].
    friction : ndarray, shape (k, nodes)
        On the tissue at the nodes of the path [N].
    dragged : ndarray, shape (k, nodes)
        Displacement of the tissue there, along the path [m].
    targets : ndarray, shape (k, t, d)
        Positions of the targets [m].
    energy : InsertionEnergy
        What became of the work.
    end : InsertionState
        From which another run can continue.
    """

    time: np.ndarray
    depth: np.ndarray
    force: np.ndarray
    tip_force: np.ndarray
    tip: np.ndarray
    friction: np.ndarray
    dragged: np.ndarray
    targets: np.ndarray
    energy: InsertionEnergy
    end: InsertionState
