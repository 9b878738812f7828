# SPDX-License-Identifier: Apache-2.0
"""Insertions in closed form, with the parameters of the paper's one-layer experiment."""

import numpy as np

from needleforce.recording.recording import Card, Recording

CONTACT = 5e-3  # [m] in the recording's own zero
PUNCTURE = CONTACT + 3.237e-3
PEAK, FRICTION, CUTTING = 0.2101, 18.6, 0.0776  # [N], [N/m], [N]


def travel(speed: float, depth: float, hold: float, withdraw: bool, rate: float, rest: float) -> np.ndarray:
    """Depth [m] at ``rate`` [Hz]: rest, insertion to ``depth``, hold, withdrawal, rest."""
    times = np.cumsum([0.0, rest, depth / speed, hold, depth / speed if withdraw else 0.0, rest if withdraw else 0.0])
    depths = [0.0, 0.0, depth, depth, 0.0 if withdraw else depth, 0.0 if withdraw else depth]
    return np.interp(np.arange(0.0, times[-1], 1.0 / rate), times, depths)


def tissue_force(depth: np.ndarray) -> np.ndarray:
    """The force [N] of one pass: a cone, then friction and cutting; only friction at rest and during withdrawal."""
    indentation = np.maximum(depth - CONTACT, 0.0)
    inwards = np.diff(depth, append=depth[-1]) > 0
    outwards = np.diff(depth, append=depth[-1]) < 0
    pierced = np.maximum.accumulate(depth) > PUNCTURE
    loading = PEAK * (indentation / (PUNCTURE - CONTACT)) ** 2
    after = FRICTION * indentation + CUTTING * inwards - 2 * FRICTION * indentation * outwards
    return np.where(pierced, after, loading)


def averaged(force: np.ndarray, length: int) -> np.ndarray:
    """The causal average filter of a force sensor: each sample is the mean of the last ``length``."""
    padded = np.concatenate((np.full(length - 1, force[0]), force))
    sums = np.concatenate(([0.0], np.cumsum(padded)))
    return (sums[length:] - sums[:-length]) / length


def paper_insertion(
    speed=1e-3, noise=1e-3, length=1, rate=1000.0, depth=20e-3, hold=1.0, withdraw=True, seed=1, extra=None, scale=1.0
) -> Recording:
    """One pass behind an average filter of ``length`` samples; ``extra(time, depth)`` [N] is added."""
    z = travel(speed, depth, hold, withdraw, rate, rest=0.2)
    time = np.arange(len(z)) / rate
    force = scale * tissue_force(z) + np.random.default_rng(seed).normal(0.0, noise, len(z))
    if extra is not None:
        force = force + extra(time, z)
    return Recording(time, z, np.gradient(z, time), averaged(force, length), card=Card(filter_length=length))


def part(run: Recording, first: int, last: int) -> Recording:
    """The samples from ``first`` up to ``last`` as a recording."""
    cut = slice(first, last)
    return Recording(run.time[cut], run.depth[cut], run.velocity[cut], run.force[cut], card=run.card)


def joined(runs: list[Recording]) -> Recording:
    """Recordings one after the other, one sample apart."""
    times, late = [], 0.0
    for run in runs:
        times.append(run.time + late)
        late = times[-1][-1] + 1.0 / run.rate
    depth, velocity, force = (np.concatenate([getattr(run, q) for run in runs]) for q in ("depth", "velocity", "force"))
    return Recording(np.concatenate(times), depth, velocity, force)
