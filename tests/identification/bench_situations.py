# SPDX-License-Identifier: Apache-2.0
"""Generated bench tests with a known truth, one a row: materials that yield, break, are slack or saturate the sensor,
by closed forms that no fit uses."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Situation:
    """``truth`` of the ideal readings ``response`` over places from 0 to ``end``; ``noise`` is a share of the largest
    reading, ``readings`` their number, ``zero`` an offset of the sensor, ``rounding`` its step."""

    truth: float
    end: float
    response: Callable[[np.ndarray], np.ndarray]
    noise: float = 0.003
    readings: int = 300
    zero: float = 0.0
    rounding: float = 0.0

    def curve(self, seed: int) -> tuple[np.ndarray, np.ndarray]:
        """Places and readings with white noise, (n,) each."""
        place = np.linspace(0.0, self.end, self.readings)
        ideal = np.asarray(self.response(place), float)
        white = np.random.default_rng(seed).standard_normal(self.readings)
        values = ideal + self.zero + self.noise * np.abs(ideal).max() * white
        return place, self.rounding * np.round(values / self.rounding) if self.rounding else values


def rubber(stretch, modulus):
    """Nominal stress [Pa] of an incompressible neo-Hookean material."""
    return modulus / 3.0 * (stretch - stretch**-2.0)


def gent(stretch, modulus, limit):
    """Nominal stress [Pa] of an incompressible material that locks where I_1 - 3 is the ``limit`` (Gent 1996)."""
    return rubber(stretch, modulus) * limit / (limit + 3.0 - stretch**2 - 2.0 / stretch)


def gent_stretch(share, limit):
    """The stretch at which I_1 - 3 is a ``share`` of the ``limit``."""
    stretches = np.linspace(1.0, 6.0, 100_001)
    return float(np.interp(share * limit, stretches**2 + 2.0 / stretches - 3.0, stretches))


def fung(stretch, modulus, b):
    """Nominal stress [Pa] of a tissue that stiffens exponentially (Fung 1967)."""
    return modulus / b * np.expm1(b * (stretch - 1.0))


# tension: Young's modulus [Pa], over strain
TENSION = {
    "saturating yield": Situation(
        15.12e6, 0.5, lambda e: 6e4 * (1.0 - np.exp(-e / 0.004)) + 12e4 * e - 6e4 * e**2, noise=0.0008, readings=400
    ),
    "steel": Situation(
        153e9, 0.05, lambda e: np.where(e < 2e-3, 153e9 * e, 306e6 + 2e9 * (e - 2e-3)), noise=0.002, readings=500
    ),
    "perfectly plastic": Situation(1e9, 0.1, lambda e: np.minimum(1e9 * e, 2e7)),
    "slack, then rubber": Situation(3e5, 0.3, lambda e: np.where(e > 0.02, rubber((1.0 + e) / 1.02, 3e5), 0.0)),
    "slack, then a line": Situation(3e5, 0.1, lambda e: np.where(e > 0.02, 3e5 * ((1.0 + e) / 1.02 - 1.0), 0.0)),
    "tear": Situation(3e5, 0.4, lambda e: np.where(e < 0.3, 1.0, 0.3) * rubber(1.0 + e, 3e5)),
    "saturated cell": Situation(3e5, 0.5, lambda e: np.minimum(rubber(1.0 + e, 3e5), 0.7 * rubber(1.5, 3e5))),
    "rubber, zero unknown": Situation(3e5, 0.3, lambda e: rubber(1.0 + e, 3e5), noise=0.005, zero=5e3),
    "zero drifts": Situation(3e5, 0.3, lambda e: rubber(1.0 + e, 3e5) + 0.02 * rubber(1.3, 3e5) * (e / 0.3) ** 2),
    "zero steps": Situation(3e5, 0.3, lambda e: rubber(1.0 + e, 3e5) + np.where(e > 0.15, 5e3, 0.0)),
    "tanh": Situation(5e5, 1.0, lambda e: 1e5 * np.tanh(5.0 * e), readings=400),
    "line": Situation(3e5, 0.1, lambda e: 3e5 * e, noise=0.01, readings=200),
    "necking": Situation(2e9, 0.3, lambda e: 4e7 * (1.0 - np.exp(-e / 0.02)) * (1.0 - 0.8 * e), readings=600),
}


def yielding(deflection, stiffness, limit):
    """Force [N] of a rod that is elastic up to the force ``limit`` and then tends to 1.4 times that."""
    beyond = np.maximum(stiffness * deflection - limit, 0.0)
    return np.minimum(stiffness * deflection, limit) + 0.4 * limit * -np.expm1(-beyond / (0.4 * limit))


def seated(deflection, stiffness, toe):
    """Force [N] of a rod whose supports settle: a parabola up to the deflection ``toe``, then a line."""
    return stiffness * np.where(deflection < toe, 0.5 * deflection**2 / toe, deflection - 0.5 * toe)


SPAN, BENT = 0.4, 10.0  # [m] of the supports, and E I [N m^2] of every rod
RATE = 48.0 * BENT / SPAN**3  # N/m
MM = 1e-3
# three-point bending: E I [N m^2], over deflection [m] that is small next to the span
BENDING = {
    "line": Situation(BENT, MM, lambda d: RATE * d, noise=0.01),
    "break": Situation(BENT, 1.3 * MM, lambda d: np.where(d < 0.5 * MM, RATE * d, 0.04), noise=0.005, readings=400),
    "three readings after a break": Situation(
        BENT, 0.5 * MM, lambda d: np.where(d < 0.497 * MM, RATE * d, 0.04), noise=0.005, readings=500
    ),
    "slack": Situation(BENT, 2 * MM, lambda d: RATE * np.maximum(d - 0.4 * MM, 0.0)),
    "slack and yield": Situation(BENT, 6 * MM, lambda d: yielding(np.maximum(d - 0.3 * MM, 0.0), RATE, 5.6)),
    "toe": Situation(BENT, 2 * MM, lambda d: seated(d, RATE, 0.5 * MM)),
    "toe and yield": Situation(BENT, 4 * MM, lambda d: yielding(seated(d, RATE, 0.5 * MM) / RATE, RATE, 8.0)),
    "yield": Situation(BENT, 4 * MM, lambda d: yielding(d, RATE, 8.0)),
    "hardening": Situation(
        BENT, 6 * MM, lambda d: np.where(d < 0.6 * MM, RATE * d, RATE * (0.6 * MM + 0.15 * (d - 0.6 * MM)))
    ),
    "saturated cell": Situation(BENT, 2 * MM, lambda d: np.minimum(RATE * d, 9.0)),
    "rounded force": Situation(BENT, MM, lambda d: RATE * d, noise=0.005, rounding=0.1),
    "zero steps": Situation(BENT, 2 * MM, lambda d: RATE * d + np.where(d > 1.2 * MM, 0.8, 0.0)),
    "few readings, toe": Situation(BENT, 2 * MM, lambda d: seated(d, RATE, 0.5 * MM), noise=0.005, readings=40),
}


def dome(travel, *, peak=0.56, top=5e-4, valley=0.36, bottom=2.8e-3, rate=2.2e6, power=2.0):
    """Force [N] of a membrane that is in contact from the first sample on: it tends to the ``peak`` at the travel
    ``top``, falls along a line to the ``valley`` at ``bottom``, and rises beyond it."""
    rise = peak * np.expm1(-3.0 * np.minimum(travel / top, 1.0)) / np.expm1(-3.0)
    fallen = (peak - valley) * np.clip((travel - top) / (bottom - top), 0.0, 1.0)
    return rise - fallen + rate * np.maximum(travel - bottom, 0.0) ** power


def sawtooth(travel, peak, at):
    """Force [N] of a film: a line to the ``peak`` at the travel ``at``, a fall to a third at once, then friction."""
    return np.where(travel < at, peak * travel / at, peak / 3.0)


# penetration: the force at tip entry [N], over travel [m], from the contact on
PENETRATION = {
    "dome": Situation(0.56, 3.7e-3, dome, noise=0.002, readings=208),
    "flat dome": Situation(0.56, 3.7e-3, lambda z: dome(z, valley=0.42), noise=0.002, readings=208),
    "deep valley": Situation(0.56, 3.7e-3, lambda z: dome(z, valley=0.2), noise=0.002, readings=208),
    "low dome": Situation(0.3, 3.7e-3, lambda z: dome(z, peak=0.3, valley=0.2), noise=0.002, readings=208),
    "long dome": Situation(0.56, 6e-3, lambda z: dome(z, bottom=4.8e-3), noise=0.002, readings=400),
    "late dome": Situation(0.8, 5e-3, lambda z: dome(z, peak=0.8, top=1.5e-3, valley=0.5, bottom=4e-3)),
    "cubic rise": Situation(0.56, 3.7e-3, lambda z: dome(z, bottom=2.5e-3, rate=1.2e9, power=3.0), readings=208),
    "noisy dome": Situation(0.56, 3.7e-3, dome, noise=0.006),
    "many readings": Situation(0.56, 3.7e-3, dome, readings=5000),
    "film in contact": Situation(0.9, 4e-3, lambda z: sawtooth(z, 0.9, 1e-3)),
    "film, rounded force": Situation(0.9, 4e-3, lambda z: sawtooth(z, 0.9, 1e-3), noise=0.005, rounding=0.01),
    "film after free travel": Situation(0.9, 6e-3, lambda z: sawtooth(np.maximum(z - 2e-3, 0.0), 0.9, 1e-3)),
    "zero is off": Situation(0.9, 6e-3, lambda z: sawtooth(np.maximum(z - 2e-3, 0.0), 0.9, 1e-3), zero=0.4),
}


@dataclass(frozen=True)
class Indentation:
    """A cone of 70.3 degrees half angle in a material with the reduced ``modulus`` and ``hardness`` [Pa], to ``depth``
    [m]: a plastic loading F ~ h^2, a hold in which a ``relaxed`` share of the force is lost, and an unloading with the
    ``exponent`` to ``rest`` of the largest force."""

    modulus: float
    hardness: float
    depth: float = 200e-9
    exponent: float = 1.5
    noise: float = 2e-3
    readings: int = 300
    rest: float = 0.0
    relaxed: float = 0.0

    def curve(self, seed: int) -> tuple[np.ndarray, np.ndarray, int]:
        """Depths and forces (n,), and the first sample of the unloading.

        The largest force follows from H = F/A with A = 24.5 h_c^2, h_c = h - 0.75 F/S, S = 2 E_r sqrt(A/pi).
        """
        # of h_c: F/S = H A/(2 E_r sqrt(A/pi)) is proportional to h_c
        lost = 0.75 * self.hardness * np.sqrt(24.5 * np.pi) / (2.0 * self.modulus)
        area = 24.5 * (self.depth / (1.0 + lost)) ** 2
        largest, stiffness = self.hardness * area, 2.0 * self.modulus * np.sqrt(area / np.pi)
        loading = np.linspace(0.0, self.depth, self.readings)
        elastic = self.exponent * largest / stiffness  # the depth that goes back
        left = np.linspace(1.0, self.rest ** (1.0 / self.exponent), self.readings)
        held = np.full(50 if self.relaxed else 0, self.depth)
        ends = 1.0 + self.relaxed * np.exp(-np.arange(len(held)) / 10.0)
        depth = np.concatenate((loading, held, self.depth - elastic * (1.0 - left)))
        first = 1.0 + self.relaxed
        force = largest * np.concatenate((first * (loading / self.depth) ** 2, ends, left**self.exponent))
        white = np.random.default_rng(seed).standard_normal(len(depth))
        return depth, force + self.noise * largest * white, len(loading) + len(held)


GPA = 1e9
# indentation: nearly plastic to nearly elastic
INDENTATION = {
    "steel": Indentation(231 * GPA, 3 * GPA),
    "gold": Indentation(95 * GPA, 1 * GPA),
    "silica": Indentation(74 * GPA, 9 * GPA),
    "polymer": Indentation(4 * GPA, 0.2 * GPA, depth=2e-6),
    "little plastic": Indentation(10 * GPA, 2 * GPA),
    "deep": Indentation(231 * GPA, 3 * GPA, depth=5e-6),
    "quiet": Indentation(231 * GPA, 3 * GPA, noise=1e-4),
    "noisy": Indentation(231 * GPA, 3 * GPA, noise=1e-2),
    "few readings": Indentation(74 * GPA, 9 * GPA, readings=60),
    "unloaded to a tenth": Indentation(95 * GPA, 1 * GPA, rest=0.1),
    "relaxes in a hold": Indentation(95 * GPA, 1 * GPA, relaxed=0.1),
    "straight unloading": Indentation(95 * GPA, 1 * GPA, exponent=1.3),
}
