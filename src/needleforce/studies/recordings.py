# SPDX-License-Identifier: Apache-2.0
"""Learning sets: the recordings of simulated insertions, as a sensor shows them, with their labels."""

import hashlib
from typing import Any

import numpy as np

from ..rig.sensor import COUNTS, Sensor
from .outputs import Run

SPLITS = ("train", "validation", "test")
MAX_LABELLED = 8  # punctures whose depths are kept


def recorded(section: Any, run: Run, rate: float, seed: tuple[int, ...]) -> dict[str, np.ndarray]:
    """The columns of one recording: depth [m], force [N] and phase (samples,), its rate, the depths of its punctures.

    ``seed`` makes bias, noise and drift: the same recording for the same insertion.
    """
    random = np.random.default_rng(seed)
    sensor = Sensor(filter_length=section.filter_length, noise=section.noise_N, bias=section.bias_N)
    drift = section.drift_N_per_s * random.uniform(-1.0, 1.0) * np.arange(len(run.depth)) / rate
    force = sensor.record({"force": run.force + drift}, random)["force"]
    step = max(section.rounding_N, 1.0 / COUNTS["force"] / section.filter_length)
    kept = np.rint(np.linspace(0, len(force) - 1, section.samples)).astype(int)
    punctures = np.full(MAX_LABELLED, np.nan)
    found = run.punctures[:MAX_LABELLED]
    punctures[: len(found)] = run.depth[found]
    return {
        "rate": np.float64(rate * (section.samples - 1) / (len(force) - 1)),
        "depth": run.depth[kept].astype(np.float32),
        "force": (step * np.rint(force[kept] / step)).astype(np.float32),
        "phase": run.columns["phase"][kept].astype(np.int8),
        "puncture_depths": punctures,
    }


def nothing_recorded(section: Any) -> dict[str, np.ndarray]:
    """The columns of an insertion that failed."""
    return {
        "rate": np.float64(np.nan),
        "depth": np.full(section.samples, np.nan, np.float32),
        "force": np.full(section.samples, np.nan, np.float32),
        "phase": np.zeros(section.samples, np.int8),
        "puncture_depths": np.full(MAX_LABELLED, np.nan),
    }


def split_of(section: Any, specimen: int, seed: int) -> str:
    """The part of a learning set to which a specimen belongs, with all its insertions."""
    digest = hashlib.sha256(f"{seed} {specimen}".encode()).digest()
    share = int.from_bytes(digest[:8], "big") / 2.0**64
    if share < section.train:
        return SPLITS[0]
    return SPLITS[1] if share < section.train + section.validation else SPLITS[2]
