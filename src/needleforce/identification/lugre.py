# SPDX-License-Identifier: Apache-2.0
"""LuGre friction per embedded length as a Kalman filter sees it: the exact step, the measurement, their Jacobians.

A reconstruction of the sequential filters of Asadian, Kermani & Patel 2012, whose exact state equations were not
available; the friction is that of Canudas de Wit et al. 1995. States are (4,): mean deflection zeta [m], sigma_0
[N/m^2], sigma_1 and sigma_2 [N s/m^2]; limits are (3,): F_c and F_s [N/m], v_s [m/s]. A velocity [m/s] is constant over
its dt [s].
"""

from typing import NamedTuple

import numpy as np


class Limit(NamedTuple):
    """g(v) = F_c + (F_s - F_c) exp(-|v / v_s|^gamma) [N/m], and its derivatives by F_c, F_s and v_s (3,)."""

    value: float
    slopes: np.ndarray


class Update(NamedTuple):
    """State (4,) and its covariance (4, 4) after a sample; the sample's innovation [N/m] and its variance."""

    state: np.ndarray
    covariance: np.ndarray
    innovation: float
    variance: float


def limit(velocity: float, limits, exponent: float = 2.0) -> Limit:
    """The friction per length at which bristles slide; ``exponent`` is gamma."""
    coulomb, static, speed = limits
    power = (abs(velocity) / speed) ** exponent
    fall = np.exp(-power)
    by_speed = (static - coulomb) * exponent * power * fall / speed if fall > 0.0 else 0.0
    return Limit(coulomb + (static - coulomb) * fall, np.array([1.0 - fall, fall, by_speed]))


def predicted(state, velocity: float, dt: float, g: float) -> tuple[np.ndarray, np.ndarray, float]:
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


def measured(state, velocity: float, g: float) -> tuple[float, np.ndarray, float]:
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


def updated_state(
    state, covariance, velocity: float, traction: float, dt: float, limits, process, noise: float, exponent: float = 2.0
) -> Update:
    """One full step of filter 1 in plain parameters, with the limits (3,) known: predict, then Joseph's update.

    ``covariance`` (4, 4) is that of ``state`` before the step, ``process`` (4, 4) what is added to it, ``traction``
    [N/m] the measured force over embedded length and ``noise`` its variance. Nothing keeps the parameters positive.
    """
    g = limit(velocity, limits, exponent).value
    ahead, jacobian, _ = predicted(np.asarray(state, float), velocity, dt, g)
    expected, slopes, _ = measured(ahead, velocity, g)
    before = jacobian @ np.asarray(covariance, float) @ jacobian.T + np.asarray(process, float)
    gain, after, variance = joseph(before, slopes, noise)
    innovation = traction - expected
    return Update(ahead + gain * innovation, after, innovation, variance)
