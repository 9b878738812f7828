# SPDX-License-Identifier: Apache-2.0
"""Two sequential extended Kalman filters for LuGre friction while the needle moves: equations and one step."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from .. import core
from ..errors import InputError

N_ITERATIONS = 3  # of the linearisation about the corrected state; with one, the first samples bias the parameters


class Limit(NamedTuple):
    """g(v) = F_c + (F_s - F_c) exp(-|v / v_s|^gamma) [N/m], and its derivatives by F_c, F_s and v_s (3,)."""

    value: float
    slopes: np.ndarray


def limit(velocity: float, limits: Sequence[float] | np.ndarray, exponent: float = 2.0) -> Limit:
    """Friction per length at which the bristles slide; ``exponent`` is gamma."""
    coulomb, static, speed = limits
    power = (abs(velocity) / speed) ** exponent
    fall = np.exp(-power)
    by_speed = (static - coulomb) * exponent * power * fall / speed if fall > 0.0 else 0.0
    return Limit(coulomb + (static - coulomb) * fall, np.array([1.0 - fall, fall, by_speed]))


def predicted(state: np.ndarray, velocity: float, dt: float, g: float) -> tuple[np.ndarray, np.ndarray, float]:
    """The state after dt, its Jacobian (4, 4), and the derivative of the deflection by g [m^2/N].

    zeta' = zeta_inf + (zeta - zeta_inf) e, zeta_inf = g sgn(v) / sigma_0, e = exp(-sigma_0 |v| dt / g).
    """
    deflection, stiffness = state[:2]
    sign, left = np.sign(velocity), np.exp(-stiffness * abs(velocity) * dt / g)
    end = g * sign / stiffness
    slower = (deflection - end) * left * abs(velocity) * dt / g
    jacobian = np.eye(4)
    jacobian[0, :2] = left, -end / stiffness * (1.0 - left) - slower
    after = np.array([end + (deflection - end) * left, *state[1:]])
    return after, jacobian, float(sign / stiffness * (1.0 - left) + slower * stiffness / g)


def measured(state: np.ndarray, velocity: float, g: float) -> tuple[float, np.ndarray, float]:
    """Traction h [N/m], its derivatives by the state (4,), and its derivative by g with the deflection frozen.

    h = sigma_0 zeta + sigma_1 v (1 - sigma_0 zeta sgn(v) / g) + sigma_2 v.
    """
    deflection, stiffness, damping, viscous = state
    elastic, bent = stiffness * deflection, 1.0 - damping * abs(velocity) / g
    rate = velocity * (1.0 - elastic * np.sign(velocity) / g)
    jacobian = np.array([stiffness * bent, deflection * bent, rate, velocity])
    frozen = damping * abs(velocity) * elastic / g**2
    return float(elastic + damping * rate + viscous * velocity), jacobian, float(frozen)


def joseph(covariance: np.ndarray, jacobian: np.ndarray, noise: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Gain (n,), covariance (n, n) after one scalar measurement, and the variance of its innovation.

    (I - K H) P (I - K H)' + K R K' stays symmetric and positive semi-definite under rounding.
    """
    variance = float(jacobian @ covariance @ jacobian + noise)
    gain = covariance @ jacobian / variance
    kept = np.eye(len(gain)) - np.outer(gain, jacobian)
    after = kept @ covariance @ kept.T + noise * np.outer(gain, gain)
    return gain, 0.5 * (after + after.T), variance


@dataclass(frozen=True)
class FilterStep:
    """One sample: ``innovation`` [N/m] and its ``variance`` before correction, NaN if ``used`` is False."""

    innovation: float
    variance: float
    used: bool


class LuGreFilter:
    """Two sequential extended Kalman filters for one shaft; call ``step`` for each sample, in the order of time.

    Parameters
    ----------
    start : needleforce.laws.Lugre
        Friction law to start from.
    noise : float
        Standard deviation of the measured traction [N/m].
    spread : float
        Standard deviation of the logarithm of each parameter at the start [1].
    parameter_walk : float
        Random walk of these logarithms [1/sqrt(s)], 0 or more; by default 1 % in a second, so that errors from the
        first samples decay.
    bristle_walk : float
        Random walk of the deflection [m/sqrt(s)], 0 or more.
    cutting_spread : float, optional
        Standard deviation [N] of a cutting force that is estimated as well, from 0 on; None: the force is friction
        alone. It is the eighth state.
    held : bool
        Keep the parameters at their start and correct only the deflection. The covariance is then that of known
        parameters. If it is False and the motion contains little information, the linearisation follows the noise and
        the covariance becomes too small; ``filter_lugre`` therefore reports that of a held filter.

    Attributes
    ----------
    state : numpy.ndarray
        Deflection zeta [m], sigma_0 [N/m^2], sigma_1 [N s/m^2] and sigma_2 [N s/m^2], (4,).
    limits : numpy.ndarray
        F_c [N/m], F_s [N/m] and v_s [m/s], (3,).
    covariance : numpy.ndarray
        Covariance (7, 7) of sigma_0 zeta [N/m] and the logarithms of the parameters, (8, 8) with a cutting force.
    cutting : float
        Cutting force [N].

    Raises
    ------
    InputError
        For values that are not finite and positive; a walk may be 0.
    """

    def __init__(
        self,
        start: Any,
        noise: float,
        *,
        spread: float = 0.5,
        parameter_walk: float = 0.01,
        bristle_walk: float = 0.0,
        cutting_spread: float | None = None,
        held: bool = False,
    ):
        given = {"noise": noise, "spread": spread, "parameter_walk": parameter_walk, "bristle_walk": bristle_walk}
        for name, value in given.items():
            if not (np.isfinite(value) and (value > 0.0 or (value == 0.0 and "walk" in name))):
                limit_text = "it must be finite and 0 or more" if "walk" in name else "it must be finite and above 0"
                raise InputError(name, value, limit_text, "LuGre filter")
        self.noise, self.spread, self.exponent = float(noise), float(spread), start.stribeck_exponent
        self.state = np.array([0.0, start.bristle_stiffness, start.bristle_damping, start.viscous])
        self.limits = np.array([start.coulomb, start.static_friction, start.stribeck_speed])
        self.held = held
        self.cutting, others = 0.0, [] if cutting_spread is None else [float(cutting_spread)]
        self.covariance = np.diag(np.array([0.0, *(6 * [spread]), *others]) ** 2)
        self.walk = np.array([bristle_walk, *(6 * [parameter_walk]), *(parameter_walk * each for each in others)]) ** 2
        self.forget()

    @property
    def law(self) -> Any:
        """The friction law estimated so far, a ``needleforce.laws.Lugre``."""
        return core.laws.Lugre(*map(float, (*self.state[1:], *self.limits, self.exponent)))

    def forget(self) -> None:
        """Reset the deflection to unknown, up to that of static friction, for example after missing samples."""
        self.state[0] = 0.0
        self.covariance[0, :] = self.covariance[:, 0] = 0.0
        self.covariance[0, 0] = self.limits[1] ** 2
        self.deflection_covariance = self.covariance[:1, :1].copy()  # of sigma_0 zeta with known parameters

    def step(
        self, velocity: float, traction: float, dt: float, noise: float | None = None, cuts: float = 0.0
    ) -> FilterStep:
        """Process one sample.

        Parameters
        ----------
        velocity : float
            Velocity [m/s] over the last ``dt``; if it is not finite, the filter calls ``forget``.
        traction : float
            Force over embedded length [N/m] at the end of ``dt``; if it is not finite, there is no correction.
        dt : float
            Time step [s], 0 or more.
        noise : float, optional
            Standard deviation of this traction [N/m]. Default: that of the filter.
        cuts : float
            What the cutting force contributes to it [1/m]: 1 over the embedded length where the tip cuts, else 0.

        Returns
        -------
        FilterStep
        """
        if not (np.isfinite(velocity) and np.isfinite(dt) and dt >= 0.0):
            self.forget()
            return FilterStep(np.nan, np.nan, False)
        self._predict(velocity, dt)
        if not np.isfinite(traction):
            return FilterStep(np.nan, np.nan, False)
        return self._correct(velocity, traction, (self.noise if noise is None else noise) ** 2, cuts)

    def _predict(self, velocity: float, dt: float) -> None:
        g = limit(velocity, self.limits, self.exponent)
        before, stiffness = _by_coordinates(self.state), self.state[1]
        self.state, own, by_limit = predicted(self.state, velocity, dt, g.value)
        jacobian = np.eye(len(self.covariance))
        jacobian[0, :4] = stiffness * own[0] @ before
        jacobian[0, 1] += stiffness * self.state[0]
        jacobian[0, 4:7] = stiffness * by_limit * g.slopes @ _by_log_limits(self.limits)
        walk = np.diag(self.walk * dt)
        walk[0, 0] *= stiffness**2
        self.covariance = jacobian @ self.covariance @ jacobian.T + walk
        self.deflection_covariance = own[0, 0] ** 2 * self.deflection_covariance + walk[0, 0]

    def expected(self, velocity: float, cuts: float = 0.0) -> tuple[float, float]:
        """Traction [N/m] at a velocity [m/s] with this deflection, and its variance."""
        traction, slopes = self._expected(np.zeros(len(self.covariance)), velocity, cuts)
        return traction, float(slopes @ self.covariance @ slopes)

    def _expected(self, moved: np.ndarray, velocity: float, cuts: float) -> tuple[float, np.ndarray]:
        state, limits = _moved(self.state, self.limits, moved[:7])
        friction, slopes = _expected(state, limits, velocity, self.exponent)
        others = np.full(len(moved) - 7, cuts)
        return friction + float(others @ (self.cutting + moved[7:])), np.concatenate([slopes, others])

    def _correct(self, velocity: float, traction: float, noise: float, cuts: float) -> FilterStep:
        moved = np.zeros(len(self.covariance))
        for iteration in range(N_ITERATIONS):
            expected, slopes = self._expected(moved, velocity, cuts)
            gain, after, variance = joseph(self.covariance, slopes, noise)
            held_gain, held_after, _ = joseph(self.deflection_covariance, slopes[:1], noise)
            if iteration == 0:
                step = FilterStep(float(traction - expected), variance, True)
            gain = np.append(held_gain, np.zeros(len(gain) - 1)) if self.held else gain
            moved = gain * (traction - expected + slopes @ moved)
        self.state, self.limits = _moved(self.state, self.limits, moved[:7])
        self.cutting += float(moved[7:].sum())
        self.covariance, self.deflection_covariance = after, held_after
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


def _expected(state: np.ndarray, limits: np.ndarray, velocity: float, exponent: float) -> tuple[float, np.ndarray]:
    """Traction [N/m], and its derivatives (7,) by the deflection and the logarithms."""
    g = limit(velocity, limits, exponent)
    traction, own, frozen = measured(state, velocity, g.value)
    return traction, np.concatenate([own @ _by_coordinates(state), frozen * g.slopes @ _by_log_limits(limits)])


def _moved(state: np.ndarray, limits: np.ndarray, by: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """State and limits after a change (7,) of sigma_0 zeta and the logarithms."""
    factor = np.exp(by[1:])
    parameters, coulomb = state[1:] * factor[:3], limits[0] * factor[3]
    above = (limits[1] - limits[0]) * factor[4]
    deflection = (state[1] * state[0] + by[0]) / parameters[0]
    return np.array([deflection, *parameters]), np.array([coulomb, coulomb + above, limits[2] * factor[5]])
