# SPDX-License-Identifier: Apache-2.0
"""Random closed motions of a rigid needle in a condensed solid, from outside the tissue and back, and the work of the
hand along them."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
from closed_motions import ROUNDING, balance, scaled

import needleforce as nf
from needleforce import fe

# whose friction a condensed solid takes
SLIDING = (
    "paper", "paper_by_force", "paper_by_energy", "okamura_liver", "lugre", "power_law", "maurin", "gokgol_liver",
    "blunted_cone", "stribeck", "physical",
)  # fmt: skip


def solid(rng, nodes=41, spacing=1e-3):
    """A table that falls off along the path, as that of a solid of 3 to 1000 kPa does."""
    apart = np.abs(np.subtract.outer(np.arange(nodes), np.arange(nodes)))
    falls, largest = np.exp(-rng.uniform(0.1, 0.6) * apart), 10.0 ** rng.uniform(-3.2, -0.7)
    return fe.CondensedTissue(spacing, largest * (0.7 * falls + 0.3 * np.exp(-0.03 * apart)))


def drawn_in_solid(seed, noise=0.0, relaxes=False):
    """A rigid needle in one or two layers of a condensed solid, which may relax: (insertion, words, random numbers for
    its motion)."""
    rng = np.random.default_rng(seed)
    model = nf.preset(SLIDING[rng.integers(len(SLIDING))])
    laws = {part: scaled(getattr(model, part), rng) for part in ("stiffness", "friction", "cutting")}
    laws["puncture"] = nf.laws.PunctureDepth(depth=10.0 ** rng.uniform(-4.0, -2.4))
    if rng.random() < 0.5:
        laws["cutting"] = nf.laws.ConstantCutting(force=10.0 ** rng.uniform(-2.5, -0.3))
    deeper = (nf.Layer(top=rng.uniform(5e-3, 15e-3), **laws),) if rng.random() < 0.3 else ()
    if rng.random() < 0.5:
        laws["stiffness"] = nf.laws.Cone(10.0 ** rng.uniform(3.5, 6.5), rng.uniform(0.1, 1.0))
    more = {"depth_noise": noise} if noise else {}
    if relaxes:
        first, second = rng.uniform(0.0, 0.6), rng.uniform(0.0, 0.35)
        times = 10.0 ** rng.uniform(-3.0, 1.0, 2)
        laws["relaxation"] = nf.laws.Prony(share_1=first, time_1=times[0], share_2=second, time_2=times[1])
        deeper = tuple(replace(layer, relaxation=laws["relaxation"]) for layer in deeper)
    model = replace(model, **laws, deeper=deeper)
    return fe.CondensedInsertion(solid(rng), model, max_speed=math.inf, **more), model.name, rng


def rigid(insertion, depth, dt, at_most=False):
    """The balance of a needle in a condensed solid, by the trapezoidal rule; or with the larger force of each step, so
    that a negative one is gained whatever the force did in between."""
    rows = insertion.run(depth, dt)
    travel, force = np.diff(depth), rows["force"]
    ends = force[1:] * travel, force[:-1] * travel
    return balance(np.maximum(*ends) if at_most else 0.5 * sum(ends), inside=bool(np.all(rows["status"] == 0)))


def drawn_depth(rng, insertion, noise=0.0):
    """Turns of the depth from outside the tissue and back, about the surface or deep: (depth, dt). All steps are on one
    grid, so that the trapezoidal rule returns all of what is elastic, and short to the puncture's depth."""
    deepest = 10.0 ** rng.uniform(-3.3, -1.5)
    step = min(deepest / 300, insertion.puncture[0] / 200)
    turns = np.concatenate([[-1e-3], deepest * rng.uniform(-0.3, 1.0, rng.integers(1, 12)), [-2.0 * deepest - 3e-3]])
    turns = np.round(turns / step).astype(int)
    legs = [np.arange(a, b, 1 if b > a else -1) for a, b in pairwise(turns)]
    depth = step * np.concatenate([*legs, turns[-1:]]).astype(float)
    return depth + rng.uniform(-noise, noise, len(depth)) * (np.arange(len(depth)) > 0), np.full(len(depth), 1e-3)


def laws_in_solid(rng, deepest):
    """Laws of a layer, of kinds and sizes at random, which breaks before a depth [m]."""
    size, laws = lambda low, high: 10.0 ** rng.uniform(low, high), nf.laws
    contacts = (
        lambda: laws.Cone(size(3.5, 6.5), rng.uniform(0.1, 1.2)),
        lambda: laws.Polynomial(linear=size(0.0, 3.5), quadratic=size(3.0, 6.5)),
        lambda: laws.PowerLaw(size(-2.0, 0.5), rng.uniform(1.0, 2.5)),
        lambda: laws.Exponential(rate=size(2.0, 3.3), scale=size(-3.0, -0.5)),
    )
    punctures = (
        lambda: laws.PunctureDepth(size(-4.0, -2.4)),
        lambda: laws.PunctureForce(size(-2.5, 0.3)),
        lambda: laws.PunctureEnergy(size(-6.0, -3.0)),
    )
    frictions = (
        lambda: laws.Coulomb(size(-1.0, 2.0), size(-9.0, -3.3)),
        lambda: laws.Karnopp(*np.array([size(0.0, 1.5), -size(0.0, 1.5), size(0.0, 2.0), size(0.0, 2.0), 50.0, -50.0])),
        lambda: laws.Lugre(
            size(4.0, 6.0), viscous=size(0.0, 2.0), coulomb=size(0.0, 1.3), static_friction=size(1.3, 1.8),
            stribeck_speed=2e-3, stribeck_exponent=2.0,
        ),
    )  # fmt: skip
    cuttings = (
        lambda: laws.ConstantCutting(size(-3.0, 0.0)),
        lambda: laws.StribeckCutting(size(-1.0, 0.0), size(-2.5, -1.0), size(-3.5, -2.0), size(-1.0, 1.5)),
        lambda: laws.Fracture(toughness=size(1.0, 3.0), crack_length=size(-4.0, -3.0)),
        laws.NoCutting,
    )
    while True:
        found = [kinds[rng.integers(len(kinds))]() for kinds in (contacts, punctures, frictions, cuttings)]
        if nf.Model(*found).puncture_depth < deepest:
            return found


def drawn_from_all_laws(seed):
    """A rigid needle in one to three layers of a condensed solid, a third of which relax, with any laws that it takes:
    (insertion, words, turns of its depth from outside the tissue and back)."""
    rng = np.random.default_rng(seed)
    first, second = rng.uniform(0.0, 0.6), rng.uniform(0.0, 0.35)
    times = 10.0 ** rng.uniform(-3.0, 1.0, 2)
    prony = nf.laws.Prony(share_1=first, time_1=times[0], share_2=second, time_2=times[1])
    relaxation = prony if rng.random() < 0.33 else nf.laws.NoRelaxation()
    tops = np.cumsum(rng.uniform(4e-3, 12e-3, rng.integers(0, 3)))
    layers = [laws_in_solid(rng, 4e-3 if len(tops) else 1.0) for _ in range(1 + len(tops))]  # none reaches the next
    deeper = tuple(nf.Layer(float(top), *laws, relaxation) for top, laws in zip(tops, layers[1:]))
    model = nf.Model(*layers[0], relaxation=relaxation, deeper=deeper)
    deepest = 10.0 ** rng.uniform(-3.3, -1.5)
    inside = deepest * rng.uniform(-0.3, 1.0, rng.integers(1, 12))
    turns = np.concatenate([[-1e-3], inside, [-2.0 * deepest - 3e-3]])
    words = f"{model.stiffness.name}, {model.cutting.name}, {model.friction.name}, {1 + len(deeper)} layers"
    return fe.CondensedInsertion(solid(rng), model, max_speed=math.inf), words, turns


def refined(seed, least, finest=256_000):
    """The balance along turns of the depth, whose steps are shorter until it is above the least share or they are as
    fine as they get, so many a leg: the trapezoidal rule's own error falls as the square of the step, or as the step
    where a force jumps. What is nothing but rounding is none. (Balance, words)."""
    steps = 1000
    while True:
        insertion, words, turns = drawn_from_all_laws(seed)
        depth = np.concatenate(
            [turns[:1], *(a + (b - a) * np.arange(1, steps + 1) / steps for a, b in pairwise(turns))]
        )
        dt = np.append(1.0, np.maximum(np.abs(np.diff(depth)) / 5e-3, 1e-9))
        found = rigid(insertion, depth, dt)
        if -found.least < ROUNDING:
            found = replace(found, least=0.0)
        if found.share >= least or steps >= finest:
            return found, f"{words}, {steps} steps a leg"
        steps *= 4
