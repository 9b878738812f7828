# SPDX-License-Identifier: Apache-2.0
"""Simulated repeats with small differences of specimen and noise, and every kind of fault."""

import dataclasses

import numpy as np

import needleforce as nf
from needleforce import core

RATE, NOISE = 200.0, 1e-3  # Hz, N


def run(seed: int, factor=1.0, speed=5e-3, depth=15e-3, puncture=3.2e-3, cutting=0.08, hold=1.0) -> nf.Recording:
    """One insertion of the preset ``paper``, its forces times ``factor``, 2 % from specimen to specimen."""
    random = np.random.default_rng(seed)
    model = dataclasses.replace(
        nf.preset("paper"),
        puncture=core.laws.PunctureDepth(puncture * random.normal(1.0, 0.01)),
        cutting=core.laws.ConstantCutting(cutting * random.normal(1.0, 0.02)),
    )
    made = nf.simulate(model, nf.Motion.insert(-4e-3, speed, depth, hold, True), RATE)
    force = factor * random.normal(1.0, 0.01) * made.force + random.normal(0.0, NOISE, len(made))
    return nf.Recording(made.time, made.depth, made.velocity, force)


def changed(recording: nf.Recording, keep=slice(None), filter_length=1, **columns) -> nf.Recording:
    """A recording with other columns, some samples, or the length of its filter on its card."""
    arrays = {name: columns.get(name, getattr(recording, name)) for name in ("time", "depth", "velocity", "force")}
    card = dataclasses.replace(recording.card, filter_length=filter_length)
    return nf.Recording(**{name: values[keep] for name, values in arrays.items()}, card=card)


def two_close_punctures(seed: int, apart: int, length: int = 40) -> nf.Recording:
    """A force of straight lines with two sudden drops ``apart`` samples apart, through an average of ``length``."""
    one = run(seed, speed=3e-3)
    inside = np.clip(one.depth, 0.0, None)
    inwards = np.arange(len(one)) <= int(np.argmax(one.depth))
    first = int(np.argmax(one.depth > 5e-3))
    at = np.arange(len(one))
    drop = 0.1 * (at >= first) + 0.1 * (at >= first + apart)
    force = np.where(inwards, 80.0 * inside - drop, -20.0 * inside)
    force = np.convolve(np.concatenate((np.zeros(length - 1), force)), np.ones(length) / length, "valid")
    random = np.random.default_rng(seed)
    return changed(one, force=force + random.normal(0.0, 1e-4, len(one)), filter_length=length)


def wrong_sign(seed: int) -> nf.Recording:
    one = run(seed)
    return changed(one, force=-one.force)


def other_unit(seed: int, factor: float) -> nf.Recording:
    one = run(seed)
    return changed(one, force=factor * one.force)


def millimetres(seed: int) -> nf.Recording:
    """Depth in mm with a header in m."""
    one = run(seed)
    return changed(one, depth=1e3 * one.depth, velocity=1e3 * one.velocity)


def saturated(seed: int) -> nf.Recording:
    one = run(seed)
    return changed(one, force=np.minimum(one.force, 0.15))


def dying(seed: int) -> nf.Recording:
    """Its last reading beyond the puncture is repeated up to the end."""
    one = run(seed)
    return changed(one, force=np.where(one.time < 2.0, one.force, one.force[np.searchsorted(one.time, 2.0)]))


def dropped(seed: int) -> nf.Recording:
    one = run(seed)
    return changed(one, keep=(one.time < 2.0) | (one.time > 2.4))


def drifting(seed: int) -> nf.Recording:
    one = run(seed)
    return changed(one, force=one.force + 0.06 * one.time / one.time[-1])


def never_pierced(seed: int) -> nf.Recording:
    return run(seed, factor=0.05, puncture=20e-3)
