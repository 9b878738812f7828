# SPDX-License-Identifier: Apache-2.0
"""Motion of tissue with mass and damping, M a + C v + K u = f, by Newmark's rule with Rayleigh damping."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import eigvalsh, lu_factor, lu_solve
from scipy.sparse import csr_array, diags_array, issparse
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from ...checks import above_zero, within
from ...errors import InputError
from ..elastic.factorisation import Factor

_MAX_DENSE = 300  # unknowns whose highest frequency is found from all of them

Solve = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Rayleigh:
    """Damping ``mass * M + stiffness * K``.

    Parameters
    ----------
    mass : float
        Share of the mass [1/s]; damps low frequencies.
    stiffness : float
        Share of the stiffness [s]; damps high frequencies.

    Raises
    ------
    InputError
        If a value is negative or not finite.
    """

    mass: float = 0.0
    stiffness: float = 0.0

    def __post_init__(self) -> None:
        for quantity, unit in (("mass", "1/s"), ("stiffness", "s")):
            value = getattr(self, quantity)
            if not 0.0 <= value < np.inf:
                raise InputError(f"share of {quantity} in the damping", f"{value:.3g} {unit}", "must be at least 0")

    @classmethod
    def from_ratios(cls, frequencies: Sequence[float], ratios: Sequence[float]) -> "Rayleigh":
        """Damping that has given ratios at two frequencies; smaller between them, larger outside.

        Parameters
        ----------
        frequencies : (float, float)
            [Hz], different and above 0.
        ratios : (float, float)
            Of critical damping.

        Raises
        ------
        InputError
            If the frequencies are not two, or no such damping is at least 0 at all frequencies.
        """
        angular, wanted = 2.0 * np.pi * np.asarray(frequencies, dtype=float), np.asarray(ratios, dtype=float)
        if angular.shape != (2,) or wanted.shape != (2,) or not (np.all(angular > 0.0) and angular[0] != angular[1]):
            limit = "must be two different frequencies above 0 with two ratios"
            raise InputError("frequencies", list(frequencies), limit, next_step="Give them in Hz.")
        shares = np.linalg.solve(0.5 * np.column_stack([1.0 / angular, angular]), wanted)
        if not np.all(shares >= -1e-12 * np.abs(shares).max()):
            step = "Give ratios that are closer to each other."
            limit = f"need a negative damping at other frequencies than {list(frequencies)} Hz"
            raise InputError("damping ratios", list(ratios), limit, next_step=step)
        return cls(*np.maximum(shares, 0.0).tolist())

    def ratio(self, frequency: ArrayLike) -> np.ndarray:
        """Ratio of critical damping at a frequency [Hz]: ``mass / (2 w) + stiffness w / 2``."""
        angular = 2.0 * np.pi * np.asarray(frequency, dtype=float)
        return 0.5 * (self.mass / angular + self.stiffness * angular)


class DynamicSystem:
    """Matrices of M a + C v + K u = f.

    Parameters
    ----------
    mass, damping, stiffness : float or array_like or sparse array, shape (n, n) or (n,)
        [kg], [N s/m], [N/m]; a vector is a diagonal matrix, a number the same value for each unknown.
    places : ndarray, shape (n, d), optional
        Of the unknowns [m], by which sparse matrices are factored.

    Raises
    ------
    InputError
        If shapes differ, a value is not finite, or an unknown has no mass.
    """

    def __init__(self, mass: Any, damping: Any, stiffness: Any, places: np.ndarray | None = None):
        count = max(np.shape(each)[0] if np.ndim(each) or issparse(each) else 1 for each in (mass, stiffness))
        self.mass = _matrix("mass", mass, count)
        self.damping = _matrix("damping", damping, count)
        self.stiffness = _matrix("stiffness", stiffness, count)
        self.places = places
        if not np.all(_diagonal(self.mass) > 0.0):
            raise InputError("mass", _diagonal(self.mass).min(), "must be above 0 for each unknown")
        self._solvers: dict[tuple[float, float], Solve] = {}

    @property
    def count(self) -> int:
        """Number of unknowns."""
        return int(self.mass.shape[0])

    def solver(self, damping: float, stiffness: float) -> Solve:
        """Solution of ``(M + damping C + stiffness K) x = r``, factored once for each pair [s], [s^2]."""
        key = (float(damping), float(stiffness))
        if key not in self._solvers:
            terms = [(1.0, self.mass), *zip(key, (self.damping, self.stiffness))]
            self._solvers[key] = _solver(weighted_sum([term for term in terms if term[0]]), self.places)
        return self._solvers[key]

    @cached_property
    def highest_frequency(self) -> float:
        """Largest angular frequency without damping [rad/s]."""
        if self.count <= _MAX_DENSE:
            return float(np.sqrt(eigvalsh(_dense(self.stiffness), _dense(self.mass))[-1]))
        start = np.random.default_rng(0).standard_normal(self.count)
        solve = LinearOperator((self.count,) * 2, matvec=self.solver(0.0, 0.0), dtype=float)
        mass, stiffness = (weighted_sum([(1.0, each)], sparse=True) for each in (self.mass, self.stiffness))
        value = eigsh(stiffness, k=1, M=mass, Minv=solve, which="LM", v0=start, return_eigenvectors=False)
        return float(np.sqrt(value[0]))

    def vector(self, quantity: str, values: ArrayLike) -> np.ndarray:
        """Values of all unknowns, (n,); raises InputError if one is not finite or the number is another."""
        array = np.asarray(values, dtype=float)
        if array.shape not in ((), (self.count,)) or not np.all(np.isfinite(array)):
            limit = f"must be {self.count} finite numbers"
            raise InputError(quantity, array if array.ndim == 0 else f"of shape {array.shape}", limit)
        return np.broadcast_to(array, (self.count,))


@dataclass(frozen=True, eq=False)
class MotionState:
    """Displacement [m], velocity [m/s] and acceleration [m/s^2] of all unknowns, each (n,)."""

    displacement: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray


@dataclass(frozen=True, eq=False)
class EnergyBalance:
    """Energies at each state: ``work = kinetic + strain + dissipated - (kinetic + strain at the start)``.

    Attributes
    ----------
    kinetic, strain : ndarray, shape (k,)
        [J]
    dissipated : ndarray, shape (k,)
        By damping since the start [J].
    work : ndarray, shape (k,)
        Of the forces since the start [J].
    """

    kinetic: np.ndarray
    strain: np.ndarray
    dissipated: np.ndarray
    work: np.ndarray


class Newmark:
    """Newmark's rule with a step of constant length; one factor for all steps.

    ``u' = u + dt v + dt^2 ((1/2 - beta) a + beta a')``, ``v' = v + dt ((1 - gamma) a + gamma a')``, and the equation of
    motion holds at the end of the step.

    Parameters
    ----------
    system : DynamicSystem
        Of any size; ``TissueDynamics`` or ``ReducedTissue`` for tissue.
    dt : float
        Step [s].
    beta : float
        1/4 for average acceleration (default: stable at any step, and conserves energy), 0 for central differences,
        which cost no solution if the mass is lumped and the damping has no share of the stiffness.
    gamma : float
        1/2 for second order; more damps high frequencies, and is of first order.

    Raises
    ------
    InputError
        If the step is not above 0, a rule is not stable, or the step is longer than the critical one.

    Notes
    -----
    Newmark (1959), J. Eng. Mech. Div. ASCE 85, 67-94. Stable below ``omega_max dt = 1 / sqrt(gamma / 2 - beta)``, which
    is 2 for central differences; at any step if ``beta`` is at least ``gamma / 2``.
    """

    def __init__(self, system: DynamicSystem, dt: float, *, beta: float = 0.25, gamma: float = 0.5):
        above_zero("time step", dt, "s")
        within("beta", beta, 0.0, 1.0, next_step="Use 0.25, or 0 for central differences.")
        within("gamma", gamma, 0.5, 2.0, next_step="Use 0.5: motion grows below.")
        self.system, self.dt, self.beta, self.gamma = system, float(dt), float(beta), float(gamma)
        self._check_critical()
        self._solve = system.solver(gamma * dt, beta * dt**2)

    @property
    def critical_step(self) -> float:
        """Longest stable step [s], without regard to damping; infinite for rules that are stable at any step."""
        margin = 0.5 * self.gamma - self.beta
        return np.inf if margin <= 1e-15 else 1.0 / (np.sqrt(margin) * self.system.highest_frequency)

    def start(self, displacement: ArrayLike = 0.0, velocity: ArrayLike = 0.0, forces: ArrayLike = 0.0) -> MotionState:
        """State at the start, with the acceleration that balances the forces (n,) [N]."""
        at, speed = (self.system.vector("start", each) for each in (displacement, velocity))
        right = self._unbalanced(at, speed, self.system.vector("forces", forces))
        return MotionState(at, speed, self.system.solver(0.0, 0.0)(right) if right.any() else right)

    def step(self, state: MotionState, forces: ArrayLike = 0.0) -> MotionState:
        """State one step later.

        Parameters
        ----------
        state : MotionState
            Of ``start`` or ``step``.
        forces : array_like, shape (n,)
            At the end of the step [N].
        """
        forces, dt, old = self.system.vector("forces", forces), self.dt, state.acceleration
        at = state.displacement + dt * state.velocity + dt**2 * (0.5 - self.beta) * old
        speed = state.velocity + dt * (1.0 - self.gamma) * old
        new = self._solve(self._unbalanced(at, speed, forces))
        return MotionState(at + self.beta * dt**2 * new, speed + self.gamma * dt * new, new)

    def states(self, start: MotionState, forces: Iterable[ArrayLike]) -> Iterator[MotionState]:
        """States after each step, for forces at the end of each [N]."""
        for each in forces:
            start = self.step(start, each)
            yield start

    def energies(self, states: Sequence[MotionState], forces: ArrayLike) -> EnergyBalance:
        """Energies of states, the start included, under forces (k, n) [N]: exact for average acceleration."""
        forces = np.asarray(forces, dtype=float).reshape(len(states), -1)
        at, speed = (np.array([getattr(each, name) for each in states]) for name in ("displacement", "velocity"))
        moved, mean = np.diff(at, axis=0), 0.5 * (speed[1:] + speed[:-1])
        lost = self.dt * np.einsum("ki,ki->k", mean, product(self.system.damping, mean.T).T)
        work = 0.5 * np.einsum("ki,ki->k", moved, forces[1:] + forces[:-1])
        return EnergyBalance(
            kinetic=0.5 * np.einsum("ki,ki->k", speed, product(self.system.mass, speed.T).T),
            strain=0.5 * np.einsum("ki,ki->k", at, product(self.system.stiffness, at.T).T),
            dissipated=np.concatenate([[0.0], np.cumsum(lost)]),
            work=np.concatenate([[0.0], np.cumsum(work)]),
        )

    def _unbalanced(self, at: np.ndarray, speed: np.ndarray, forces: np.ndarray) -> np.ndarray:
        return forces - product(self.system.damping, speed) - product(self.system.stiffness, at)

    def _check_critical(self) -> None:
        if self.dt > self.critical_step * (1.0 + 1e-9):
            limit = f"must be at most {self.critical_step:.4g} s, the critical step of beta={self.beta:g}"
            step = "Use a shorter step, larger cells, or beta=0.25, which is stable at any step."
            raise InputError("time step", f"{self.dt:.4g} s", limit, next_step=step)


def product(matrix: Any, vectors: np.ndarray) -> np.ndarray:
    """Matrix, or diagonal of one, times vectors (n,) or (n, k)."""
    return (matrix * vectors.T).T if matrix.ndim == 1 else matrix @ vectors


def _matrix(quantity: str, values: Any, count: int) -> Any:
    if issparse(values):
        matrix = csr_array(values)
    else:
        matrix = np.asarray(values, dtype=float)
        matrix = np.full(count, matrix) if matrix.ndim == 0 else matrix
    if matrix.shape not in ((count,), (count, count)):
        raise InputError(quantity, f"of shape {matrix.shape}", f"must be ({count},) or ({count}, {count})")
    if not np.all(np.isfinite(matrix.data if issparse(matrix) else matrix)):
        raise InputError(quantity, "not finite", "must be finite")
    return matrix


def _diagonal(matrix: Any) -> np.ndarray:
    return matrix if matrix.ndim == 1 else matrix.diagonal()


def _dense(matrix: Any) -> np.ndarray:
    if matrix.ndim == 1:
        return np.diag(matrix)
    return matrix.toarray() if issparse(matrix) else matrix


def weighted_sum(terms: Sequence[tuple[float, Any]], sparse: bool = False) -> Any:
    """Sum of factors times matrices: a vector if all are diagonal, sparse if one is."""
    if all(matrix.ndim == 1 for _, matrix in terms) and not sparse:
        return sum(factor * matrix for factor, matrix in terms)
    sparse = sparse or any(issparse(matrix) for _, matrix in terms)
    square = diags_array if sparse else np.diag
    scaled = [factor * (square(matrix) if matrix.ndim == 1 else matrix) for factor, matrix in terms]
    total = scaled[0]
    for each in scaled[1:]:
        total = total + each
    return csr_array(total) if sparse else total


def _solver(matrix: Any, places: np.ndarray | None) -> Solve:
    if matrix.ndim == 1:
        return lambda right: (right.T / matrix).T
    if not issparse(matrix):
        factors = lu_factor(matrix)
        return lambda right: lu_solve(factors, right)
    return splu(matrix.tocsc()).solve if places is None else Factor(matrix, places).solve
