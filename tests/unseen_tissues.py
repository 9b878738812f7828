# SPDX-License-Identifier: Apache-2.0
"""Tissues that no law of the package describes, and insertions into them: a beam of finite differences on a foundation
with laws of its own, and tips that follow kinematics with a curvature that changes."""

import math
from dataclasses import dataclass, field

import numpy as np

from needleforce.steering import TipPath

STIFFNESS = 0.0207  # [N m^2] of an 18 gauge needle
ROWS = 21
ROW, PUSH = 5e-3, 1e-3  # [m] between readings, and of a push
_SPACING = 2e-3  # [m] of the nodes
_FIXED = 1e6  # [N/m] of a guide

BEAMS = ("softening", "layered", "creeping", "stiffening")
KINEMATIC = ("unicycle", "bicycle")
FAMILIES = BEAMS + KINEMATIC


def _wandering(random, depth, length, size):
    """A stationary process along the depth that forgets itself over a length [m]."""
    values, keep = [random.normal()], math.exp(-(depth[1] - depth[0]) / length)
    for _ in depth[1:]:
        values.append(keep * values[-1] + math.sqrt(1.0 - keep**2) * random.normal())
    return size * np.array(values)


@dataclass
class Tracker:
    """Reads with noise, drifts, and may see no slope."""

    noise: float
    drift: float  # [m] a row
    sloped: bool

    def path(self, name, depth, base, tip, slope, random):
        """What is read of positions and slopes, complex numbers across; the first rows do not depend on later ones."""
        noise, steps, turn = (size * self._unit(random)[: len(tip)] for size in (self.noise, self.drift, 3e-3))
        read, slope = tip + noise + np.cumsum(steps), slope + turn
        across = np.column_stack([read.real, read.imag, depth])
        return TipPath(name, base, across, np.column_stack([slope.real, slope.imag]) if self.sloped else None)

    @staticmethod
    def _unit(random):
        return random.normal(size=ROWS) + 1j * random.normal(size=ROWS)


def _backlash(base, play):
    """The base as the needle feels it: it follows once it touches."""
    held, at = [], base[0]
    for each in base:
        away = each - at
        at = at + away * max(0.0, 1.0 - play / max(abs(away), 1e-12))
        held.append(at)
    return np.array(held)


@dataclass
class Beam:
    """A beam on a foundation whose force per length is a function of the offset from where the tip cut, which may creep
    after the needle."""

    family: str
    random: np.random.Generator
    stiffness: np.ndarray = field(init=False)  # [Pa] at each push

    def __post_init__(self):
        draw, depth = self.random, PUSH * np.arange(200)
        stiffness = np.full(len(depth), math.exp(draw.uniform(math.log(1e4), math.log(8e4))))
        force = np.full(len(depth), draw.uniform(0.08, 0.3))
        if self.family == "layered":
            for top in np.sort(draw.uniform(0.005, 0.08, draw.integers(1, 4))):
                stiffness[depth >= top] *= math.exp(draw.normal(0.0, 0.7))
                force[depth >= top] *= math.exp(draw.normal(0.0, 0.4))
        if self.family == "stiffening":
            force = force * (1.0 + draw.uniform(-0.5, 1.0) * depth / 0.1)
        self.stiffness, self.force = stiffness, force * np.exp(1j * draw.uniform(-math.pi, math.pi))
        self.scale = draw.uniform(0.5e-3, 3e-3)
        self.creep = draw.uniform(0.05, 0.3) if self.family == "creeping" else 0.0
        self.guide, self.turn = draw.uniform(0.01, 0.04), draw.uniform(0.0, 1.5)  # [m], [rad/(N m)]
        self.play = draw.uniform(0.0, 0.25e-3)
        self.uneven = draw.uniform(0.05, 0.2)

    def _secant(self, offset):
        """Force per length over offset, relative to that of small offsets."""
        relative = np.abs(offset) / self.scale
        return 1.0 + relative**2 if self.family == "stiffening" else 1.0 / (1.0 + relative)

    def insertion(self, depth, base, random):
        """Tip and slope, complex, after each row of the motion of the base."""
        pushes = np.rint(depth / PUSH).astype(int)
        base = _backlash(base[:, 0] + 1j * base[:, 1], self.play)
        depth = PUSH * np.arange(200)
        stiffness = self.stiffness * np.exp(_wandering(random, depth, 0.015, self.uneven))
        force = self.force * np.exp(_wandering(random, depth, 0.015, self.uneven))
        force = force * np.exp(1j * _wandering(random, depth, 0.03, 0.1))
        tips, slopes, path, at = [base[0]], [0.0j], np.array([base[0]]), 0
        for row in range(1, len(base)):
            while at < pushes[row]:
                at += 1
                shape = self._equilibrium(at * PUSH, base[row], path, stiffness, force[at])
                z = at * PUSH - _SPACING * np.arange(len(shape))
                here = np.interp(depth[: len(path)], z[::-1], shape[::-1])
                path = np.append(path + self.creep * (here - path), shape[0])
            tips.append(shape[0])
            slopes.append((shape[0] - shape[1]) / _SPACING)
        return np.array(tips), np.array(slopes)

    def _equilibrium(self, tip, base, path, stiffness, force):
        """Nodes from the tip back to the guide."""
        n = int((tip + self.guide) / _SPACING) + 3
        z = tip - _SPACING * np.arange(n)
        bend = np.diff(np.eye(n), 2, axis=0)
        matrix, side = STIFFNESS / _SPACING**3 * bend.T @ bend, np.zeros(n, complex)
        share = (z[0] + self.guide) / _SPACING
        before, part = int(share), share - int(share)
        held = np.zeros(n)
        held[before : before + 2] = 1.0 - part, part
        slope = np.zeros(n)
        slope[before : before + 2] = 1.0 / _SPACING, -1.0 / _SPACING
        matrix = matrix + _FIXED * np.outer(held, held) + np.outer(slope, slope) / (self.turn + 0.05)
        side += _FIXED * held * base
        side[0] += force
        inside = np.clip(z / _SPACING + 0.5, 0.0, 1.0)
        known = PUSH * np.arange(len(path))
        cut = np.interp(z, known, path)
        local = _SPACING * inside * np.interp(z, PUSH * np.arange(len(stiffness)), stiffness)
        local[0] *= 0.5
        shape = np.linalg.solve(matrix + np.diag(local), side + local * cut)
        for _ in range(40):
            spring = local * self._secant(shape - cut)
            found = np.linalg.solve(matrix + np.diag(spring), side + spring * cut)
            change = np.abs(found - shape).max()
            shape = 0.5 * (shape + found) if self.family == "stiffening" else found
            if change < 1e-6:
                break
        return shape


@dataclass
class Kinematics:
    """A tip whose slope changes by a curvature that wanders along the depth, and by a share of the motion of the base
    that falls with the depth; that of a bicycle is ahead of what turns."""

    family: str
    random: np.random.Generator

    def __post_init__(self):
        draw = self.random
        self.curvature = draw.uniform(0.3, 2.0) * np.exp(1j * draw.uniform(-math.pi, math.pi))
        self.changes = draw.uniform(0.1, 0.4)
        self.response, self.length = draw.uniform(-25.0, 5.0), draw.uniform(0.02, 0.08)  # [rad/m], [m]
        self.along = draw.uniform(0.0, 0.6)  # of the motion that the tip follows at once
        self.ahead = draw.uniform(0.005, 0.02) if self.family == "bicycle" else 0.0
        self.play = draw.uniform(0.0, 0.25e-3)

    def insertion(self, depth, base, random):
        """Tip and slope, complex, after each row of the motion of the base."""
        pushes = np.rint(depth / PUSH).astype(int)
        base = _backlash(base[:, 0] + 1j * base[:, 1], self.play)
        depth = PUSH * np.arange(200)
        curvature = self.curvature * (1.0 + _wandering(random, depth, 0.02, self.changes))
        place, slope, tips, slopes, at = base[0], 0.0j, [base[0]], [0.0j], 0
        for row in range(1, len(base)):
            fades = math.exp(-depth[at] / self.length)
            slope += self.response * fades * (base[row] - base[row - 1])
            place += self.along * fades * (base[row] - base[row - 1])
            while at < pushes[row]:
                slope += PUSH * curvature[at]
                place += PUSH * slope
                at += 1
            tips.append(place + self.ahead * slope)
            slopes.append(slope)
        return np.array(tips), np.array(slopes)


def motion(random, steered):
    """Base (ROWS, 2) [m]: at rest, a random walk, or through random places, within 6 mm of where it began."""
    base = np.zeros((ROWS, 2))
    if not steered:
        return base
    if random.random() < 0.5:
        base[2:] = np.cumsum(random.normal(0.0, 1.2e-3, (ROWS - 2, 2)), axis=0)
        return np.clip(base, -6e-3, 6e-3)
    places = np.vstack([np.zeros(2), random.uniform(-6e-3, 6e-3, (4, 2)) * random.uniform(0.3, 1.0)])
    at = np.linspace(0.0, 1.0, ROWS - 1)
    base[1:] = np.column_stack([np.interp(at, np.linspace(0.0, 1.0, 5), column) for column in places.T])
    return base


class Tissue:
    """One tissue of a family, with the tracker that reads the tips in it."""

    def __init__(self, family, seed):
        self.key = [FAMILIES.index(family), seed]
        draw = np.random.default_rng(self.key)
        self.law = (Beam if family in BEAMS else Kinematics)(family, draw)
        drift, sloped = (0.03e-3, False) if family == "bicycle" else (draw.uniform(0.0, 0.03e-3), True)
        self.tracker = Tracker(draw.uniform(0.05e-3, 0.25e-3), drift, sloped)

    def inserted(self, name, depth, base, random):
        """Where the tip is (n, 2) [m], and what is read of it, at another site and in another pose."""
        tip, slope = self.law.insertion(depth, base, random)
        offset, axis = (size * (random.normal() + 1j * random.normal()) for size in (0.3e-3, 6e-3))
        tip, slope = tip + offset + axis * depth, slope + axis
        return np.column_stack([tip.real, tip.imag]), self.tracker.path(name, depth, base, tip, slope, random)

    def paths(self, steered):
        """A tip path for each of ``steered``: whether its base moves."""
        found = []
        for number, moves in enumerate(steered):
            random = np.random.default_rng([*self.key, number])
            found.append(self.inserted(str(number), ROW * np.arange(ROWS), motion(random, moves), random)[1])
        return found
