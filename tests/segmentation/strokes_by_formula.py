# SPDX-License-Identifier: Apache-2.0
"""Recordings with and without a puncture by closed formulas, for false alarms and power of the detection."""

import numpy as np

from needleforce.recording.recording import Recording

KINDS = ("white", "correlated", "hum", "quantised", "drift", "filtered")


def rupture(
    seed=0,
    *,
    rate=1000.0,
    noise=3e-3,
    drop=0.06,
    peak=0.2,
    travel=0.0,
    speed=3e-3,
    start=-4e-3,
    end=11e-3,
    at=4e-3,
    rise=12.0,
):
    """A stroke with one rupture at the depth ``at``: the force grows with the square of the depth, falls by ``drop``
    over ``travel`` (0: at once), and grows by ``rise`` [N/m]."""
    z = np.arange(start, end, speed / rate)
    past = np.clip(z - at, 0.0, None)
    fallen = np.clip(past / travel, 0.0, 1.0) if travel else past > 0.0
    force = peak * (np.clip(z, 0.0, at) / at) ** 2 - drop * fallen + rise * past
    force = force + np.random.default_rng(seed).normal(0.0, noise, len(z))
    return Recording(np.arange(len(z)) / rate, z, np.full(len(z), speed), force)


def without_puncture(seed):
    """The kind of noise and a recording of a loading that saturates or not, hold and withdrawal, without a puncture.

    Rates 50 to 5000 Hz, speeds 0.5 to 20 mm/s, powers 1 to 2, noise 0.1 to 10 % of the peak; some have no hold, no
    withdrawal, or begin in contact.
    """
    random = np.random.default_rng(seed)
    log = lambda low, high: float(np.exp(random.uniform(np.log(low), np.log(high))))  # noqa: E731
    rate, speed, reach, start = log(50, 5000), log(0.5e-3, 20e-3), random.uniform(6e-3, 16e-3), -log(0.3e-3, 5e-3)
    stroke = (reach - start) / speed
    rate *= np.clip(1.0, 80 / (stroke * rate), 40_000 / (stroke * rate))
    hold, back = random.choice([0.0, 1.0, 2.0]), random.choice([0.0, 1.0])
    times = np.cumsum([0.0, 0.2, stroke, hold, back * stroke, 0.2])
    out = start if back else reach
    time = np.arange(0.0, times[-1], 1.0 / rate)
    depth = np.interp(time, times, [start, start, reach, reach, out, out])
    peak, kind = log(0.05, 5.0), str(random.choice(KINDS))
    force = loading(time, depth, times, peak, random) + disturbance(kind, time, peak, random)
    if kind == "quantised":
        quantum = peak * log(1e-3, 0.1)
        force = quantum * np.round(force / quantum)
    first = int(np.argmax(depth > 0.5e-3)) if random.random() < 0.2 else 0
    time, depth, force = time[first:], depth[first:], force[first:]
    return kind, Recording(time, depth, np.gradient(depth, time), force)


def loading(time, depth, times, peak, random):
    """A power of the depth that may saturate, relaxing by 30 % in the hold, and tension during the withdrawal."""
    inside, power = np.maximum(depth, 0.0), random.choice([1.0, 1.5, 2.0])
    limit = random.choice([np.inf, 2e-3, 5e-3])
    shape = inside**power if np.isinf(limit) else 1.0 - np.exp(-((inside / limit) ** power))
    held = np.clip(time - times[2], 0.0, times[3] - times[2])
    force = peak * shape / shape.max() * (1.0 - 0.3 * (1.0 - np.exp(-held / 0.5)))
    return np.where((time >= times[3]) & (times[4] > times[3]), -0.4 * force, force)


def disturbance(kind, time, peak, random):
    """Noise of one of the ``KINDS``, 0.1 to 10 % of the peak."""
    size = peak * float(np.exp(random.uniform(np.log(1e-3), np.log(0.1))))
    noise = random.normal(0.0, size, len(time))
    if kind == "correlated":
        from scipy.signal import lfilter  # takes a second

        share = random.uniform(0.3, 0.95)
        return lfilter([np.sqrt(1.0 - share**2)], [1.0, -share], noise)
    if kind == "filtered":
        length = int(random.integers(2, min(50, max(3, len(time) // 60))))
        return np.convolve(noise, np.ones(length) / length, "same")
    if kind == "hum":
        return 0.5 * noise + size * np.sin(2.0 * np.pi * 50.0 * time + random.uniform(0.0, 6.0))
    return noise + (peak * random.uniform(-0.1, 0.1) * time / time[-1] if kind == "drift" else 0.0)
