# SPDX-License-Identifier: Apache-2.0
"""LuGre friction identified while the needle moves, by two extended Kalman filters in sequence.

A reconstruction: the exact state equations of Asadian, Kermani & Patel 2012 were not available. The first filter
estimates the bristles' mean deflection, sigma_0, sigma_1 and sigma_2, the second F_c, F_s and v_s with the deflection
frozen; parameters are random walks. The filters share one covariance of all seven: at constant velocity only
g(v) + sigma_2 v is observable, and two filters that took each other's values as known would each claim its part.
What is corrected are the bristles' force sigma_0 zeta and the logarithms of sigma_0, sigma_1, sigma_2, F_c, F_s - F_c
and v_s, so that these stay positive; one that starts at zero is held there.
"""

from dataclasses import dataclass

import numpy as np

from .. import core
from ..errors import InputError
from .lugre import joseph, limit, measured, predicted

ITERATIONS = 3  # of the linearisation about the corrected state: else the first samples teach what was never seen


@dataclass(frozen=True)
class Step:
    """One sample: ``innovation`` [N/m] and its ``variance`` before correction, NaN where ``used`` is False."""

    innovation: float
    variance: float
    used: bool


class LuGreFilter:
    """Two sequential extended Kalman filters for one shaft; call ``step`` for each sample, in the order of time.

    ``start`` is a ``needleforce.laws.Lugre`` to start from, ``noise`` the standard deviation of the measured traction
    [N/m], ``spread`` that of the logarithm of each parameter. ``parameter_walk`` [1/sqrt(s)] lets these logarithms
    wander, by default by 1 % in a second, so that what the first samples taught about the wrong values is forgotten;
    ``bristle_walk`` [m/sqrt(s)] the deflection. ``covariance`` (7, 7) is that of sigma_0 zeta [N/m] and the logarithms.
    ``held`` keeps the parameters at their start and corrects the deflection alone, as if they were known: its
    covariance is what the motion tells of such a friction. Without it, where the motion tells little, the linearisation
    wanders with the noise and the covariance shrinks too far; ``filter_lugre`` reports the held one. Raises InputError
    on values that are not finite and positive; a walk may be 0.
    """

    def __init__(self, start, noise: float, *, spread=0.5, parameter_walk=0.01, bristle_walk=0.0, held=False):
        given = {"noise": noise, "spread": spread, "parameter_walk": parameter_walk, "bristle_walk": bristle_walk}
        for name, value in given.items():
            if not (np.isfinite(value) and (value > 0.0 or (value == 0.0 and "walk" in name))):
                raise InputError(name, value, "not finite and positive", "LuGre filter")
        self.noise, self.spread, self.exponent = float(noise), float(spread), start.stribeck_exponent
        self.state = np.array([0.0, start.bristle_stiffness, start.bristle_damping, start.viscous])
        self.limits = np.array([start.coulomb, start.static_friction, start.stribeck_speed])
        self.held = held
        self.covariance = np.diag([0.0] + 6 * [spread**2]).astype(float)
        self.walk = np.array([bristle_walk] + 6 * [parameter_walk]) ** 2
        self.forget()

    @property
    def law(self):
        """The friction as estimated so far, a ``needleforce.laws.Lugre``."""
        return core.laws.Lugre(*map(float, (*self.state[1:], *self.limits, self.exponent)))

    def forget(self) -> None:
        """Bristles of unknown deflection, within what the static friction can bend: where the motion was not seen."""
        self.state[0] = 0.0
        self.covariance[0, :] = self.covariance[:, 0] = 0.0
        self.covariance[0, 0] = self.limits[1] ** 2
        self.alone = self.covariance[:1, :1].copy()  # of sigma_0 zeta with the parameters known

    def step(self, velocity: float, traction: float, dt: float, noise: float | None = None) -> Step:
        """One sample: the velocity [m/s] over the last dt [s], and the force over embedded length [N/m] at its end.

        A traction that is not finite predicts without correction, a motion that is not makes the filter ``forget`` the
        bristles. ``noise`` [N/m] holds for this sample alone.
        """
        if not (np.isfinite(velocity) and np.isfinite(dt) and dt >= 0.0):
            self.forget()
            return Step(np.nan, np.nan, False)
        self._predict(velocity, dt)
        if not np.isfinite(traction):
            return Step(np.nan, np.nan, False)
        return self._correct(velocity, traction, (self.noise if noise is None else noise) ** 2)

    def _predict(self, velocity: float, dt: float) -> None:
        g = limit(velocity, self.limits, self.exponent)
        before, stiffness = _by_coordinates(self.state), self.state[1]
        self.state, own, by_limit = predicted(self.state, velocity, dt, g.value)
        jacobian = np.eye(7)
        jacobian[0, :4] = stiffness * own[0] @ before
        jacobian[0, 1] += stiffness * self.state[0]
        jacobian[0, 4:] = stiffness * by_limit * g.slopes @ _by_log_limits(self.limits)
        walk = np.diag(self.walk * dt) * np.array([stiffness] + 6 * [1.0]) ** 2
        self.covariance = jacobian @ self.covariance @ jacobian.T + walk
        self.alone = own[0, 0] ** 2 * self.alone + walk[0, 0]

    def _correct(self, velocity: float, traction: float, noise: float) -> Step:
        moved = np.zeros(7)
        for iteration in range(ITERATIONS):
            state, limits = _moved(self.state, self.limits, moved)
            expected, slopes = _expected(state, limits, velocity, self.exponent)
            gain, after, variance = joseph(self.covariance, slopes, noise)
            alone_gain, alone_after, _ = joseph(self.alone, slopes[:1], noise)
            if iteration == 0:
                step = Step(float(traction - expected), variance, True)
            gain = np.append(alone_gain, np.zeros(6)) if self.held else gain
            moved = gain * (traction - expected + slopes @ moved)
        self.state, self.limits = _moved(self.state, self.limits, moved)
        self.covariance, self.alone = after, alone_after
        return step


def _by_coordinates(state: np.ndarray) -> np.ndarray:
    """Derivatives (4, 4) of filter 1's state by sigma_0 zeta and the logarithms of its parameters."""
    slopes = np.diag([1.0 / state[1], *state[1:]])
    slopes[0, 1] = -state[0]
    return slopes


def _by_log_limits(limits: np.ndarray) -> np.ndarray:
    """Derivatives (3, 3) of F_c, F_s and v_s by the logarithms of F_c, F_s - F_c and v_s."""
    coulomb, static, speed = limits
    return np.array([[coulomb, 0.0, 0.0], [coulomb, static - coulomb, 0.0], [0.0, 0.0, speed]])


def _expected(state, limits, velocity: float, exponent: float) -> tuple[float, np.ndarray]:
    """Traction [N/m], and its derivatives (7,) by the deflection and the logarithms."""
    g = limit(velocity, limits, exponent)
    traction, own, frozen = measured(state, velocity, g.value)
    return traction, np.concatenate([own @ _by_coordinates(state), frozen * g.slopes @ _by_log_limits(limits)])


def _moved(state, limits, by: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """State and limits after a change (7,) of sigma_0 zeta and the logarithms."""
    factor = np.exp(by[1:])
    parameters, coulomb = state[1:] * factor[:3], limits[0] * factor[3]
    above = (limits[1] - limits[0]) * factor[4]
    deflection = (state[1] * state[0] + by[0]) / parameters[0]
    return np.array([deflection, *parameters]), np.array([coulomb, coulomb + above, limits[2] * factor[5]])
