# SPDX-License-Identifier: Apache-2.0
"""Insertions that show what a law does, in the units of the axes: mm, s, mm/s and N."""

from typing import NamedTuple

import numpy as np

import needleforce as nf
from needleforce.errors import InputError
from needleforce.models.simulation import simulate

from .typical import around, without

SPEED, SLOW = 3e-3, 1e-3  # the paper's two speeds [m/s]
DEEP = 12e-3  # the depth up to which the paper's friction model holds [m]


class Run(NamedTuple):
    """A simulated insertion: time [s], depth [mm], force and its parts [N], (n,) each."""

    time: np.ndarray
    depth: np.ndarray
    force: np.ndarray
    parts: dict[str, np.ndarray]


def run(model, *moves, start: float = 0.0) -> Run:
    """``model`` along ``moves`` of target [m] and speed [m/s] or hold time [s]."""
    recording = simulate(model, nf.Motion(start, tuple(moves)))
    return Run(recording.time, 1e3 * recording.depth, recording.force, recording.axes)


def cycle(model, speed: float = SPEED, depth: float = DEEP, hold: float = 2.0) -> Run:
    """In, hold, and out to a little above the surface."""
    return run(model, (depth, speed), (depth, hold), (-1e-3, speed))


def back_and_forth(law) -> Run:
    """In, half-way back, in again, hold, out: the loop of a friction law."""
    moves = [(10e-3, SPEED), (6e-3, SPEED), (DEEP, SPEED), (DEEP, 3.0), (-1e-3, SPEED)]
    return run(around(law), *moves)


def by_velocity(law, embedded: float = 10e-3) -> tuple[np.ndarray, np.ndarray] | None:
    """Sliding friction [N] over velocity [mm/s] at one depth; None for a law independent of it or with memory."""
    velocity = np.concatenate([np.linspace(-10e-3, -1e-6, 200), np.linspace(1e-6, 10e-3, 200)])
    try:
        force = around(law).replace(cutting=without("cutting")).force(np.full(400, embedded), velocity)
    except InputError:
        return None
    return (1e3 * velocity, force) if np.ptp(force[200:]) > 1e-9 else None
