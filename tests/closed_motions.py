# SPDX-License-Identifier: Apache-2.0
"""Random closed motions of the base of a needle that bends, and the work of the hand along them. A motion begins and
ends outside the tissue, so that nothing is stored at either end."""

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

import needleforce as nf
from needleforce import core

AXIAL = tuple(name for name in nf.presets() if name != "layered_as_fitted")  # whose friction states that it gains
TIPS = ("none", "bevel", "tip force")
ROUNDING = 1e-15  # work that is nothing but the rounding of forces [J]


@dataclass(frozen=True, kw_only=True)
class Motion:
    """Where the base is at each step: depth [m], lateral (n, 2) [m], tilt (n, 2), roll [rad]; dt [s]."""

    depth: np.ndarray
    lateral: np.ndarray
    tilt: np.ndarray
    roll: np.ndarray
    dt: np.ndarray

    def finer(self, times):
        """The same motion in shorter steps."""
        count = len(self.depth)
        at = np.arange((count - 1) * times + 1) / times
        between = lambda values: np.column_stack([np.interp(at, np.arange(count), each) for each in values.T])  # noqa: E731
        depth, roll = (between(each[:, None])[:, 0] for each in (self.depth, self.roll))
        dt = np.append(self.dt[:1], np.repeat(self.dt[1:], times)) / times
        return Motion(depth=depth, lateral=between(self.lateral), tilt=between(self.tilt), roll=roll, dt=dt)

    def only(self, kept):
        """The motion with the steps to these places alone, each in the time of those that it takes the place of."""
        at = np.flatnonzero(kept)
        dt = np.append(self.dt[:1], np.diff(np.cumsum(self.dt)[at]))
        return Motion(depth=self.depth[at], lateral=self.lateral[at], tilt=self.tilt[at], roll=self.roll[at], dt=dt)


def along(corners, steps, speed=5e-3):
    """The way along corners (depth, x, y, slope x, slope y, roll), in so many steps from each to the next."""
    corners = np.atleast_2d(np.asarray(corners, dtype=float))
    share = np.linspace(0.0, 1.0, steps + 1)[1:, None]
    legs = [a + (b - a) * share for a, b in pairwise(corners)]
    way = np.vstack([corners[:1], *legs])
    travel = np.linalg.norm(np.diff(way[:, :3], axis=0), axis=1)
    return Motion(
        depth=way[:, 0].copy(), lateral=way[:, 1:3].copy(), tilt=way[:, 3:5].copy(), roll=way[:, 5].copy(),
        dt=np.append(1.0, np.maximum(travel / speed, 1e-4)),
    )  # fmt: skip


def axes(tilt):
    """Axes of the wrench at the base as rows (n, 3, 3): the last along the needle, none turned about it."""
    direction = np.column_stack([tilt, np.ones(len(tilt))])
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    across = np.array([1.0, 0.0, 0.0]) - direction[:, :1] * direction
    across /= np.linalg.norm(across, axis=1)[:, None]
    return np.stack([across, np.cross(direction, across), direction], axis=1)


def work(insertion, motion, rows):
    """Work of the hand in each step [J], by the trapezoid rule.

    The wrench is that of the tissue on the needle at the base. A hub moves across and along the insertion with
    (lateral, depth); a guide moves across, and the needle is fed through it by the depth against ``force``.
    """
    frame = axes(motion.tilt)
    force = np.einsum("ni,nij->nj", rows["wrench"][:, :3], frame)
    moment = np.einsum("ni,nij->nj", rows["wrench"][:, 3:], frame)
    between = lambda values: 0.5 * (values[1:] + values[:-1])  # noqa: E731
    turned = np.cross(between(frame[:, 2]), np.diff(frame[:, 2], axis=0))
    spun = np.sum(np.diff(frame[:, 0], axis=0) * between(frame[:, 1]), axis=1) + np.diff(motion.roll)
    turned += spun[:, None] * between(frame[:, 2])
    guided = math.isfinite(insertion.guide_distance)
    fed = between(rows["force"] if guided else -force[:, 2]) * np.diff(motion.depth)
    across = np.sum(between(force[:, :2]) * np.diff(motion.lateral, axis=0), axis=1)
    return fed - across - np.sum(between(moment) * turned, axis=1)


def run(insertion, motion):
    return insertion.run(motion.depth, motion.lateral, roll=motion.roll, tilt=motion.tilt, dt=motion.dt)


@dataclass(frozen=True, kw_only=True)
class Balance:
    """What the hand has put in by the end of a motion and at the least, over what it turned over [J]; whether each
    step was within the range of the model, and whether the needle buckled."""

    end: float
    least: float
    turned: float
    inside: bool = True
    buckled: bool = False

    @property
    def share(self):
        """The least of the balance over what was turned over."""
        return self.least / self.turned if self.turned > ROUNDING else 0.0

    @property
    def left(self):
        return abs(self.end) / self.turned if self.turned > ROUNDING else 0.0


def smooth_end(insertion, motion, rows):
    """Work of the hand along legs of even numbers of steps, to fourth order: forces without friction are smooth."""
    half = Motion(**{name: getattr(motion, name)[::2] for name in ("depth", "lateral", "tilt", "roll", "dt")})
    coarse = work(insertion, half, {name: rows[name][::2] for name in ("force", "wrench")}).sum()
    return float((4.0 * work(insertion, motion, rows).sum() - coarse) / 3.0)


def in_finer_steps(insertion, motion, share=1e-4, rounds=16):
    """The motion with its steps halved until the trapezoid rule is right to a share of the work turned over: forces
    jump where the tip leaves the tissue, and are steep where friction turns."""
    for _ in range(rounds):
        halves = motion.finer(2)
        rows = run(insertion, halves)
        fine = work(insertion, halves, rows)
        coarse = work(insertion, motion, {name: rows[name][::2] for name in ("force", "wrench")})
        off = np.abs(fine.reshape(-1, 2).sum(axis=1) - coarse) > share * np.abs(fine).sum()
        if not off.any():
            break
        kept = np.ones(len(halves.depth), dtype=bool)
        kept[1::2] = off
        motion = halves.only(kept)
    return motion


def balance(steps, **more):
    total = np.cumsum(steps)
    return Balance(end=float(total[-1]), least=float(min(total.min(), 0.0)), turned=float(np.abs(steps).sum()), **more)


def bent(insertion, motion):
    """The balance of a needle that bends."""
    rows = run(insertion, motion)
    inside, buckled = bool(np.all(rows["status"] == 0)), bool(np.any(rows["buckled"]))
    found = balance(work(insertion, motion, rows), inside=inside, buckled=buckled)
    return replace(found, end=smooth_end(insertion, motion, rows)) if insertion.model is None else found


def bent_at_least(insertion, motion, bar):
    """The balance of a needle that bends; where it is below a bar, that of the motion in steps that cannot be why."""
    found = bent(insertion, motion)
    return found if found.share >= -bar else bent(insertion, in_finer_steps(insertion, motion))


def scaled(law, rng):
    """A law with each parameter times 1/2 to 2, or as it is where these do not fit together."""
    numbers = {name: value * rng.uniform(0.5, 2.0) for name, value in law.parameters().items() if value}
    try:
        return law.replace(**numbers)
    except (nf.InputError, TypeError):
        return law


def axial_model(rng):
    """A preset as it is, or with other parameters."""
    model = nf.preset(AXIAL[rng.integers(len(AXIAL))])
    if rng.random() < 0.3:
        return model
    laws = {part: scaled(getattr(model, part), rng) for part in ("stiffness", "puncture", "friction", "cutting")}
    try:
        return replace(model, **laws)
    except nf.InputError:
        return model


def foundation(rng, kind, tip):
    """One to three layers of a kind of foundation."""
    tops = np.concatenate([[0.0], np.sort(rng.uniform(3e-3, 30e-3, rng.integers(0, 3)))])
    for top in tops:
        more: dict[str, Any] = {}
        if kind == "saturating":
            more = {"form": ("tanh", "hyperbolic")[rng.integers(2)], "scale": rng.uniform(0.2e-3, 2e-3)}
        if kind == "hardening":
            more = {"form": "cubic", "scale": rng.uniform(0.5e-3, 3e-3)}
        if kind == "yielding":
            more = {"yielding_modulus": rng.uniform(5e3, 5e4), "yield_force": rng.uniform(2.0, 50.0)}
            more |= {"tip_stiffness": rng.uniform(0.0, 100.0)} if rng.random() < 0.5 else {}
        if tip == "tip force":
            more["tip_force"] = rng.uniform(0.0, 0.1)
        yield core.LateralLayer(top=float(top), modulus=10.0 ** rng.uniform(3.7, 5.1), **more)


def drawn_needle(rng):
    if rng.random() < 0.3:
        return nf.preset("paper").needle
    diameter = rng.uniform(0.6e-3, 1.5e-3)
    return nf.Needle(diameter, 0.0, rng.uniform(0.08, 0.2), 10.0 ** rng.uniform(10.5, 11.3), 0.3)


def drawn(seed, *, friction=True, foundations=("linear", "saturating", "hardening", "yielding"), tips=TIPS, noise=0.0):
    """A needle in tissue: (insertion, words that describe it, random numbers for its motion)."""
    rng = np.random.default_rng(seed)
    model = axial_model(rng) if friction else None
    kind, tip = foundations[rng.integers(len(foundations))], tips[rng.integers(len(tips))]
    needle, planar, guided = drawn_needle(rng), bool(rng.random() < 0.5), bool(rng.random() < 0.6)
    free = rng.uniform(15e-3, min(60e-3, needle.length - 38e-3))  # the hub stays above the guide
    more: dict[str, Any] = {"guide_distance": free} if guided else {}
    if rng.random() < 0.2:
        more["pivot_stiffness"] = rng.uniform(0.0, 500.0)
    if tip == "bevel":
        more["bevel"] = core.Bevel(
            half_angle=rng.uniform(0.2, 1.2),
            friction_coefficient=rng.uniform(0.0, 0.4),
            face_share=rng.uniform(0.0, 1.0),
        )
        more["bevel_length"] = rng.uniform(0.0, 3e-3)
    if friction and rng.random() < 0.2:
        more["pressure_friction"] = rng.uniform(0.0, 0.4)
    if noise:
        more["depth_noise"] = noise
    insertion = nf.FlexibleInsertion(
        model, needle, lateral=list(foundation(rng, kind, tip)), planar=planar, max_speed=math.inf, **more
    )
    words = f"{model.name if model else 'no axial force'}, {kind}, {tip}, {'plane' if planar else 'space'}, "
    return insertion, words + ("guide" if guided else "hub"), rng


def drawn_motion(rng, insertion, steps, noise=0.0):
    """Six to twelve legs in tissue, each of a few of the motions of the base, from outside and back; half of them go
    round a small loop several times."""
    largest = np.array([5e-3, 3e-3, 3e-3, 0.04, 0.04, math.pi])
    if insertion.planar:
        largest[[2, 4]] = 0.0
    place = np.concatenate([[-6e-3], np.zeros(5)])
    corners = [place]
    for leg in range(rng.integers(5, 11)):
        place = place.copy()
        moved = rng.random(6) < 0.4
        moved[0] |= leg == 0
        place[moved] = (rng.uniform(-1.0, 1.0, 6) * largest)[moved]
        if moved[0]:
            place[0] = rng.uniform(-3e-3, 35e-3) if leg else rng.uniform(5e-3, 35e-3)
        corners.append(place)
    if rng.random() < 0.5:
        size = 10.0 ** rng.uniform(-2.5, 0.0)
        loop = [place + size * rng.uniform(-1.0, 1.0, 6) * largest for _ in range(3)]
        corners += 3 * [*loop, place]
    corners += [np.concatenate([[-12e-3], place[1:]]), np.concatenate([[-12e-3], np.zeros(4), place[5:]])]
    motion = along(corners, steps, speed=10.0 ** rng.uniform(-3.0, -1.5))
    if noise:
        shaken = motion.depth + rng.uniform(-noise, noise, len(motion.depth))
        motion = replace(motion, depth=shaken)
    return motion


def drawn_loop(rng, insertion, steps, times=5):
    """A needle inserted, its base then moved round the same small loop several times: (the way in, one loop)."""
    largest = np.array([5e-3, 3e-3, 3e-3, 0.04, 0.04, math.pi])
    if insertion.planar:
        largest[[2, 4]] = 0.0
    start = np.concatenate([[-1e-3], np.zeros(5)])
    place = np.concatenate([[rng.uniform(8e-3, 30e-3)], rng.uniform(-1.0, 1.0, 5) * largest[1:]])
    low = np.concatenate([[place[0]], start[1:]])
    corners = place + 10.0 ** rng.uniform(-3.0, 0.0, 6) * rng.uniform(-1.0, 1.0, (3, 6)) * largest
    if rng.random() < 0.5:  # a rectangle in two of the motions
        a, b = np.zeros((2, 6))
        sides = rng.permutation(np.flatnonzero(largest))[:2]
        a[sides[0]], b[sides[1]] = 10.0 ** rng.uniform(-3.0, 0.0, 2) * largest[sides]
        corners = place + np.array([a, a + b, b])
    return along([start, low, place], steps), along([place, *corners, place], steps)


def gain(insertion, way, loop, times=6):
    """The balance of the last of several turns of a loop, if it is that of the one before: what is stored is the same
    after each, so that the hand gains where it is negative. 0 where it still changes."""
    run(insertion, way)
    turns = []
    for _ in range(times):
        rows = run(insertion, loop)
        turns.append(bool(np.all(rows["status"] == 0)) and balance(work(insertion, loop, rows)))
    last, before = turns[-1], turns[-2]
    if not (last and before) or abs(last.end - before.end) > 0.05 * abs(last.end):
        return Balance(end=0.0, least=0.0, turned=last.turned if last else 0.0, inside=bool(last))
    return replace(last, least=min(last.end, 0.0))
