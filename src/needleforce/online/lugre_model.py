# SPDX-License-Identifier: Apache-2.0
"""The LuGre filters as a model of ``OnlineIdentifier``: friction and cutting force behind a puncture."""

import copy
import math
from typing import Any

import numpy as np

from .. import core
from ..identification.estimates import Estimate
from ..identification.lugre import MAX_VARIANCE_RATIO, SOURCE
from ..identification.lugre_filter import LuGreFilter
from ..identification.statistics.noise import TWO_SIDED

FOLLOWED = ("sliding", "reversing", "withdrawal", "rest")
PARAMETERS = ("bristle_stiffness", "bristle_damping", "viscous", "coulomb", "static_friction", "stribeck_speed")
KNOWN_SPREAD, UNKNOWN_SPREAD = 0.56, 1.0  # of the logarithms: a factor of three with a prior, of seven without
PARAMETER_WALK = 0.1  # of the logarithms [1/sqrt(s)]: less leaves early errors in narrow intervals
CORRELATION = 2e-4  # of the texture [m]: samples that are closer are one
MAX_CORRELATED = 1e4  # samples that count as one where the needle hardly moves
MIN_LENGTH = 1e-3  # embedded [m]
COMPARED_OVER = 1e-3  # [m]: a force that was foreseen is compared with the one that came
CUTS_WITHIN = 2e-5  # of the deepest point [m]
SLOWEST = 1e-4  # [m/s] at which a needle that rests is expected to continue
REMAINDER = 0.05  # of the force: the least that a puncture leaves, at 95 %


class LuGreModel:
    """Fed by an identifier with the same samples; ``ahead`` answers where ``follows``.

    Force and velocity are those at the middle of each step, where the difference of two depths is the velocity: at
    the end of the step it lags by half of it, and the damping of the bristles makes up for that.

    Parameters
    ----------
    start : needleforce.laws.Lugre or None
        Friction law to start from; None: one of the size of the force after the first puncture.
    roughness : float
        Texture expected as a share of the force [1].
    """

    def __init__(self, start: Any, roughness: float):
        self.start, self.roughness = start, roughness
        self.reset()

    def reset(self) -> None:
        """Back to before the first contact."""
        self.filter: LuGreFilter | None = None
        self.last: tuple[float, float] | None = None
        self.deepest, self.inwards = -math.inf, True
        self.scale = 1.0  # variance of the texture over that of the roughness
        self.block, self.count, self.block_from = 0.0, 0, 0.0
        self.wider, self.due = 4.0, None  # variance of the force ahead over the filter's own

    def follows(self, online: Any) -> bool:
        """Whether there is a friction to foresee."""
        return self.filter is not None and online.regime in FOLLOWED and online.status in ("ok", "gap")

    def see(self, online: Any, depth: float, dt: float) -> None:
        """One sample that the core has read."""
        if online.status in ("not_finite", "bad_time"):
            return
        force, before = online.force - online.zero, self.last
        self.last = force, depth
        self.deepest = max(self.deepest, depth)
        if online.regime in ("free", "contact", "unknown"):
            self.reset()
        elif online.regime not in FOLLOWED or online.status != "ok":
            self._forget()
        elif depth - online.surface[0] > MIN_LENGTH:
            self._begin(online, depth)
            if before is not None:
                self._learn(online, before, dt)

    def _forget(self) -> None:
        self.last = self.due = None
        if self.filter is not None:
            self.filter.forget()

    def _begin(self, online: Any, depth: float) -> None:
        """After the first puncture: friction of the size of the force that is left, per length."""
        if self.filter is not None:
            return
        size = max(online.layer(0)["puncture_force"], abs(online.force - online.zero), 1e-3)
        usual = 0.5 * size / (depth - online.surface[0])
        start = self.start or core.laws.Lugre(usual / 1e-4, usual / 0.05, usual / 0.1, usual, 1.3 * usual)
        spread = KNOWN_SPREAD if self.start else UNKNOWN_SPREAD
        options = {"spread": spread, "parameter_walk": PARAMETER_WALK, "cutting_spread": size}
        self.filter = LuGreFilter(start, max(online.noise, 1e-9), **options)

    def _learn(self, online: Any, before: tuple[float, float], dt: float) -> None:
        (force, depth), top = self.last, online.surface[0]
        middle, length = 0.5 * (force + before[0]), max(0.5 * (depth + before[1]) - top, MIN_LENGTH)
        travel = depth - before[1]
        cuts = 1.0 / length if travel > 0.0 and depth >= self.deepest - CUTS_WITHIN else 0.0
        if travel != 0.0:
            self.inwards = travel > 0.0
        correlated = min(max(1.0, 2.0 * CORRELATION / max(abs(travel), 1e-12)), MAX_CORRELATED)
        sd = math.hypot(online.noise, math.sqrt(correlated * self.scale) * self.roughness * middle)
        found = self.filter.step(travel / dt, middle / length, 0.5 * dt, sd / length, cuts)
        self.filter.step(travel / dt, math.nan, 0.5 * dt)
        self._size_up(found.innovation / math.sqrt(found.variance), depth)
        self._compare(online, force, depth)

    def _size_up(self, innovation: float, depth: float) -> None:
        """Innovations over one correlation length together have a variance of 1, or the texture is of another size."""
        self.block, self.count = self.block + innovation, self.count + 1
        if abs(depth - self.block_from) < CORRELATION:
            return
        square = min(self.block**2 / self.count, 16.0)
        self.scale = min(max(self.scale * (1.0 + 0.2 * (square - 1.0)), 1e-2), 1e4)
        self.block, self.count, self.block_from = 0.0, 0, depth

    def _compare(self, online: Any, force: float, depth: float) -> None:
        """How far the last force that was foreseen was off, in its own variance."""
        direction = 1.0 if self.inwards else -1.0
        if self.due is not None and self.due[3] != direction:
            self.due = None
        if self.due is not None:
            if direction * (depth - self.due[0]) < 0.0:
                return
            off = min((force - self.due[1]) ** 2 / self.due[2], 1e3)
            self.wider = max(1.0, self.wider + 0.3 * (off - self.wider), 0.3 * off)
        mean, variance = self._foresee(online, [0.0, COMPARED_OVER])
        self.due = depth + direction * COMPARED_OVER, mean[-1], variance[-1], direction

    def _foresee(self, online: Any, travels: Any) -> tuple[np.ndarray, np.ndarray]:
        """Force [N] without the zero after these travels [m] from now, and its variance."""
        run, direction = copy.deepcopy(self.filter), 1.0 if self.inwards else -1.0
        speed, rows = direction * max(abs(online.speed), SLOWEST), []
        for gone, step in zip(travels, np.diff(travels, prepend=0.0), strict=True):
            depth = online.depth + direction * gone
            length = max(depth - online.surface[0], MIN_LENGTH)
            run.step(speed, math.nan, step / abs(speed))
            traction, variance = run.expected(speed, 1.0 / length if depth > self.deepest - CUTS_WITHIN else 0.0)
            rough = self.scale * (self.roughness * length * traction) ** 2
            rows.append((length * traction, length**2 * variance + rough + online.noise**2))
        return np.array(rows).T

    def ahead(self, online: Any, found: dict, distance: float) -> dict:
        """The core's answer with the force of this filter; a puncture may lower it."""
        travels = np.abs(np.array(found["depth"]) - online.depth)
        mean, variance = self._foresee(online, travels)
        half = TWO_SIDED * np.sqrt(self.wider * variance)
        low = mean - half
        chance = found["puncture_probability"] * travels / distance
        low = np.where(chance > 0.025, np.minimum(low, REMAINDER * mean), low)
        arrays = {"force": mean, "low": low, "high": mean + half}
        return {**found, **{name: values + online.zero for name, values in arrays.items()}}

    def estimates(self) -> list[Estimate]:
        """The six parameters per embedded length and the cutting force, with 95 % intervals."""
        if self.filter is None:
            return []
        covariance, law = self.filter.covariance, self.filter.law
        by_logs, (coulomb, static, _) = np.eye(6), self.filter.limits
        by_logs[4, 3:5] = coulomb / static, 1.0 - coulomb / static
        spread = np.sqrt(np.einsum("ij,jk,ik->i", by_logs, covariance[1:7, 1:7], by_logs) * self.wider)
        units = {row["name"]: row["unit"] for row in law.table()}
        max_sd = math.sqrt(MAX_VARIANCE_RATIO) * self.filter.spread
        found = []
        for name, sd in zip(PARAMETERS, spread.tolist(), strict=True):
            value, factor = getattr(law, name), math.exp(min(TWO_SIDED * sd, 50.0))
            limits = value, units[name], value / factor, value * factor
            found.append(Estimate(name, *limits, identifiable=sd < max_sd, source=SOURCE))
        cutting, half = self.filter.cutting, TWO_SIDED * math.sqrt(self.wider * covariance[7, 7])
        known = half < 0.5 * abs(cutting)
        limits = cutting, "N", cutting - half, cutting + half
        return [*found, Estimate("cutting_force", *limits, identifiable=known, source=SOURCE)]
