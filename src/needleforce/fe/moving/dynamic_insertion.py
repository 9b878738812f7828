# SPDX-License-Identifier: Apache-2.0
"""A rigid needle that moves along a path in tissue with mass: nodes stick, slip or are free, and the tip cuts."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import issparse

from ...checks import above_zero, finite_number, not_below_zero, within
from ...errors import InputError
from ..elastic.needle_path import NeedlePath, check_resolved
from .dynamics import product
from .insertion_run import InsertionEnergy, InsertionRun, InsertionState

_OWN_COMPLIANCE = 1e-6  # of the tip, as a share of the path's, by which its force differs from friction at its place
_TRIES = 3  # turns in which all nodes may change together without progress


class DynamicInsertion:
    """A rigid needle along a path in tissue with mass.

    Parameters
    ----------
    model : TissueDynamics or ReducedTissue
        The tissue.
    path : NeedlePath
        Of the needle; it contains all depths.
    friction : float or array_like, shape (nodes,)
        Along the shaft [N/m], the same inwards and outwards.
    cutting : float or array_like, shape (nodes,)
        Force at the tip while it cuts [N].
    dt : float
        Step [s]; the needle moves a fraction of the path's spacing in it.
    theta : float, optional
        0.5 is the average acceleration rule, whose energy is balanced without numerical dissipation, and in which nodes
        that stick vibrate from step to step. 1 is Euler's implicit rule, of first order, whose slow motion is
        quasi-static at any step. A vibration w has a numerical damping ratio of about ``(theta - 0.5) w dt``.
    settling : float, optional
        Time in which the place of the tip along the path follows from the deformed path [s]; until then, from how far
        the tip has slid past the tissue. Both are the same for small strain along the path.

    Raises
    ------
    InputError
        If a value is out of its range, the path leaves the mesh, or the mesh is too coarse for it.

    Notes
    -----
    Each step minimises energy of the tissue, its inertia included, minus the work of forces within their bounds, on the
    compliance of the path for one step, a constant matrix. A node sticks if the tissue is displaced as far as the
    needle in a step, so that friction along the shaft never gives energy. Bounds are those of the tip at the beginning
    of the step. The force at the tip is spread over two spacings of the path, by which the depth at which it begins to
    cut changes.
    Alterovitz et al. (2003), Proc. IEEE ICRA, with condensation in place of nodes that move with the tip.
    """

    def __init__(
        self,
        model: Any,
        path: NeedlePath,
        *,
        friction: ArrayLike,
        cutting: ArrayLike,
        dt: float,
        theta: float = 0.55,
        settling: float = 5e-3,
    ):
        above_zero("time step", dt, "s")
        within("theta", theta, 0.5, 1.0, next_step="Use 0.55.")
        above_zero("settling", settling, "s", "Use 0.005.")
        self.model, self.path, self.dt = model, path, float(dt)
        self.theta, self.settling = float(theta), float(settling)
        self.friction = _at_nodes("friction per length", friction, path, "N/m")
        self.cutting = _at_nodes("cutting force", cutting, path, "N")
        loads = model.loads(path)
        self._loads = loads.toarray() if issparse(loads) else np.asarray(loads, dtype=float)
        self._solve = model.solver(theta * dt, (theta * dt) ** 2)
        self._response = dt * self._solve(self._loads)  # change of velocity by unit forces
        self.compliance = theta * dt * (self._loads.T @ self._response)
        check_resolved(self.compliance, path)

    def along(self, path: NeedlePath) -> "DynamicInsertion":
        """The same needle along another path with as many nodes."""
        return DynamicInsertion(
            self.model, path, friction=self.friction, cutting=self.cutting, dt=self.dt, theta=self.theta,
            settling=self.settling,
        )  # fmt: skip

    def start(self, depth: float = 0.0) -> InsertionState:
        """Tissue at rest without forces, cut down to a depth [m] where the tip is; above the surface if negative."""
        tip, nodes = max(self._depths([depth])[0], 0.0), len(self.path.nodes)
        return InsertionState(
            depth=float(depth), tip=tip, cut=tip, displacement=np.zeros(self.model.count),
            velocity=np.zeros(self.model.count), dragged=np.zeros(nodes), friction=np.zeros(nodes), tip_force=0.0,
            slip=np.zeros(nodes + 1, dtype=int),
        )  # fmt: skip

    def step(self, state: InsertionState, depth: float) -> InsertionState:
        """State one step later, with the tip at a depth from the undeformed surface [m].

        Raises
        ------
        InputError
            If the depth is not finite, or beyond the path.
        """
        depth, theta, dt = float(self._depths([depth])[0]), self.theta, self.dt
        freely = self._velocity_without_forces(state)
        drift = self._loads.T @ (state.displacement + dt * freely)
        shares = self._tip_shares(state.tip)
        travel = depth - state.depth, depth - state.depth + self._closing(state, shares)
        touching = state.tip >= state.cut
        forces, slip = self._balanced(state, drift, shares, travel)
        loads = forces[:-1] + forces[-1] * shares
        mean = freely + theta * (self._response @ loads)  # velocity over the step
        dragged = drift + self.compliance @ loads
        tip = state.tip
        if slip[-1] != 0 or forces[-1] == 0.0:  # it cuts, or moves in its cut
            ahead = travel[1] - shares @ (dragged - state.dragged)
            tip = float(np.clip(tip + ahead, 0.0, self.path.depth if touching else state.cut))
        return InsertionState(
            depth=depth, tip=tip, cut=max(state.cut, tip), displacement=state.displacement + dt * mean,
            velocity=state.velocity + (mean - state.velocity) / theta, dragged=dragged, friction=forces[:-1],
            tip_force=float(forces[-1]), slip=slip,
        )  # fmt: skip

    def run(self, depths: ArrayLike, *, start: InsertionState | None = None, targets: ArrayLike = ()) -> InsertionRun:
        """Move the tip through depths, one at the end of each step.

        Parameters
        ----------
        depths : array_like, shape (k,)
            From the undeformed surface [m]; of ``stroke``, or ``nf.Motion.at`` of times.
        start : InsertionState, optional
            Tissue at rest, and the tip at the surface, by default.
        targets : array_like, shape (t, d), optional
            Points of the tissue before it moved [m].

        Raises
        ------
        InputError
            If a depth is not finite or beyond the path, or a target is outside the mesh.
        """
        depths, places = self._depths(depths), _places(targets)
        readout = self.model.values_at(places) if places.size else np.zeros((0, self.model.count))
        state, rows = start or self.start(), []
        for depth in depths:
            before, state = state, self.step(state, depth)
            moved = (readout @ state.displacement).reshape(places.shape[::-1]).T
            rows.append((
                state.force, state.tip_force, state.tip, state.friction, state.dragged, places + moved,
                self._ledger(before, state),
            ))  # fmt: skip
        force, tip_force, tip, friction, dragged, moved, ledger = (np.array(column) for column in zip(*rows))
        return InsertionRun(
            time=self.dt * np.arange(1, len(depths) + 1), depth=depths, force=force, tip_force=tip_force, tip=tip,
            friction=friction, dragged=dragged, targets=moved, energy=_energy(ledger), end=state,
        )  # fmt: skip

    def _depths(self, depths: ArrayLike) -> np.ndarray:
        array, end = np.asarray(depths, dtype=float), self.path.depth
        wrong = np.flatnonzero(~(np.isfinite(array) & (array <= end)))
        if array.ndim != 1 or not len(array):
            raise InputError("depths", f"of shape {array.shape}", "must be (k,)", next_step="Give one for each step.")
        if len(wrong):
            limit = f"must be finite and at most {1e3 * end:g} mm, the end of the path"
            raise InputError(f"depth {wrong[0]}", f"{1e3 * array[wrong[0]]:g} mm", limit)
        return array

    def _velocity_without_forces(self, state: InsertionState) -> np.ndarray:
        """Mean over the step."""
        step = self.theta * self.dt
        right = product(self.model.damping, state.velocity)
        right = right + product(self.model.stiffness, state.displacement + step * state.velocity)
        return state.velocity - step * self._solve(right)

    def _balanced(
        self, state: InsertionState, drift: np.ndarray, shares: np.ndarray, travel: tuple[float, float]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Friction of the nodes and last the force at the tip, and which of them slip.

        ``drift`` is where the nodes would be without forces, ``travel`` how far the shaft and the tip move.
        """
        limits = self._limits(state.tip)
        cutting = float(np.interp(state.cut, self.path.nodes, self.cutting)) if state.tip >= state.cut else 0.0
        columns = np.column_stack([np.eye(len(shares)), shares])
        compliance = columns.T @ self.compliance @ columns
        compliance[-1, -1] *= 1.0 + _OWN_COMPLIANCE
        wanted = columns.T @ (state.dragged - drift) + np.append(np.full(len(shares), travel[0]), travel[1])
        return bounded_forces(compliance, wanted, (np.append(-limits, 0.0), np.append(limits, cutting)), state.slip)

    def _closing(self, state: InsertionState, shares: np.ndarray) -> float:
        """How much of the gap between the tip and the tissue that it touches is to be closed in a step [m]."""
        gap = float(state.depth - state.tip - shares @ state.dragged)
        above = state.tip == 0.0 and gap < 0.0
        return gap if above else min(self.dt / self.settling, 1.0) * gap

    def _tip_shares(self, tip: float) -> np.ndarray:
        """Shares of the nodes in a force at the tip, a cubic spline over two spacings, mirrored at the ends."""
        nodes, step = self.path.nodes, self.path.nodes[1]
        images = np.concatenate([-nodes[1:2], nodes, 2.0 * nodes[-1:] - nodes[-2:-1]])
        away = np.abs(images - tip) / step
        near, far = 2.0 / 3.0 - away**2 * (1.0 - 0.5 * away), np.maximum(2.0 - away, 0.0) ** 3 / 6.0
        spline = np.where(away < 1.0, near, far)
        shares = spline[1:-1].copy()
        shares[1] += spline[0]
        shares[-2] += spline[-1]
        return shares

    def _limits(self, tip: float) -> np.ndarray:
        """Friction at most of each node, for a shaft that ends at the tip [N]."""
        nodes, step = self.path.nodes, self.path.nodes[1]
        covered = np.clip(tip - nodes[:-1], 0.0, step)
        lengths = np.zeros(len(nodes))  # integrals of hat functions
        lengths[1:] = 0.5 * covered**2 / step
        lengths[:-1] += covered - 0.5 * covered**2 / step
        return self.friction * lengths

    def _ledger(self, before: InsertionState, after: InsertionState) -> tuple[float, ...]:
        """Kinetic and strain energy, then work, damping, friction and numerical loss of the step [J]."""
        system, moved, faster = self.model, after.displacement - before.displacement, after.velocity - before.velocity
        energy = [(system.mass, after.velocity), (system.stiffness, after.displacement), (system.damping, moved)]
        kinetic, strain, damped = (float(vector @ product(matrix, vector)) for matrix, vector in energy)
        lost = faster @ product(system.mass, faster) + moved @ product(system.stiffness, moved)
        travel, slid = after.depth - before.depth, after.depth - before.depth - after.dragged + before.dragged
        friction = float((after.friction + after.tip_force * self._tip_shares(before.tip)) @ slid)
        return (
            0.5 * kinetic, 0.5 * strain, after.force * travel, damped / self.dt, friction, (self.theta - 0.5) * lost,
        )  # fmt: skip


def stroke(depth: float, speed: float, dt: float, *, start: float = 0.0, hold: float = 0.0) -> np.ndarray:
    """Depths of the tip at the end of each step of a stroke at constant speed, then of a hold, (k,) [m].

    Parameters
    ----------
    depth : float
        Where it ends [m].
    speed : float
        [m/s], above 0.
    dt : float
        Step [s].
    start : float
        Where it begins [m].
    hold : float
        Duration of rest at the end [s].

    Raises
    ------
    InputError
        If a value is not finite, the speed or the step is not above 0, or the hold is negative.
    """
    above_zero("time step", dt, "s")
    finite_number("depth of the stroke", depth, "Give it in SI units.")
    finite_number("start of the stroke", start, "Give it in SI units.")
    above_zero("speed", speed, next_step="Give it in SI units.")
    not_below_zero("hold", hold, next_step="Give it in SI units.")
    moving = max(int(np.ceil(abs(depth - start) / (speed * dt) - 1e-9)), 0)
    travel = np.minimum(speed * dt * np.arange(1, moving + 1), abs(depth - start))
    return np.append(start + np.sign(depth - start) * travel, np.full(round(hold / dt), float(depth)))


def _places(targets: ArrayLike) -> np.ndarray:
    places = np.asarray(targets, dtype=float)
    places = places if places.size else np.zeros((0, 1))
    if places.ndim != 2 or not np.all(np.isfinite(places)):
        raise InputError("targets", places.tolist(), "must be finite, of shape (t, d)", next_step="Give [[x, z]] in m.")
    return places


def _energy(ledger: np.ndarray) -> InsertionEnergy:
    kinetic, strain, work, damped, friction, numerical = ledger.T
    sums = {"work": work, "damped": damped, "friction": friction, "numerical": numerical}
    return InsertionEnergy(kinetic=kinetic, strain=strain, **{name: np.cumsum(each) for name, each in sums.items()})


def _at_nodes(quantity: str, values: ArrayLike, path: NeedlePath, unit: str) -> np.ndarray:
    array = np.asarray(values, dtype=float)
    if array.shape not in ((), path.nodes.shape):
        limit = f"must be a number, or one for each of the {len(path.nodes)} nodes of the path"
        raise InputError(quantity, f"of shape {array.shape}", limit)
    if not np.all((array >= 0.0) & (array < np.inf)):
        wrong = array[~((array >= 0.0) & (array < np.inf))].flat[0]
        raise InputError(quantity, f"{wrong:g} {unit}", "must be at least 0", next_step=f"Give it in {unit}.")
    return np.broadcast_to(array, path.nodes.shape)


def bounded_forces(
    compliance: np.ndarray, wanted: np.ndarray, bounds: tuple[np.ndarray, np.ndarray], slip: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Forces [N] that move nodes by ``wanted`` [m] where they are within their bounds, and by less where they are at
    one, for a symmetric, positive definite compliance [m/N]; and which nodes slip: -1 at the lower bound, 1 at the
    upper one, 0 within. ``bounds`` are lowest and highest forces, ``slip`` is a guess.

    Block principal pivoting, one node at a time where that makes no progress: ends for any positive definite matrix.
    Júdice & Pires (1994), Comput. Oper. Res. 21, 587-596, with two bounds in place of one.
    """
    low, high = bounds
    slip, free = slip.copy(), high > low
    small = 1e-12 * (np.abs(wanted).max() + np.abs(compliance).max() * max(np.abs(high).max(), np.abs(low).max()))
    fewest, tries = len(wanted) + 1, _TRIES
    for _ in range(100 * len(wanted)):
        forces, short = _with(compliance, wanted, bounds, np.where(free, slip, 1))
        own = small / np.diag(compliance)
        change = _change(slip, short, np.stack([forces - low + own, high - forces + own]), small) * free
        wrong = np.flatnonzero(change)
        if not len(wrong):
            return np.clip(forces, low, high), np.where(free, slip, 0)
        fewest, tries = (len(wrong), _TRIES) if len(wrong) < fewest else (fewest, tries - 1)
        if tries < 0:
            wrong = wrong[-1:]
        slip[wrong] += change[wrong]
    raise InputError("friction", "without balance", f"in {100 * len(wanted)} turns", next_step="Use a shorter step.")


def _with(
    compliance: np.ndarray, wanted: np.ndarray, bounds: tuple[np.ndarray, np.ndarray], slip: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Forces when nodes stick and slip as given, and by how much each node falls short of what is wanted."""
    sticks = np.flatnonzero(slip == 0)
    forces = np.where(slip < 0, bounds[0], bounds[1])
    forces[sticks] = 0.0
    short = wanted - compliance @ forces
    if len(sticks):
        forces[sticks] = np.linalg.solve(compliance[np.ix_(sticks, sticks)], short[sticks])
        short = wanted - compliance @ forces
    return forces, short


def _change(slip: np.ndarray, short: np.ndarray, room: np.ndarray, small: float) -> np.ndarray:
    """By how much the slip of each node must change."""
    leaves = (slip == 0) * ((room[1] < 0.0).astype(int) - (room[0] < 0.0))
    return leaves + ((slip < 0) & (short > small)).astype(int) - ((slip > 0) & (short < -small))
