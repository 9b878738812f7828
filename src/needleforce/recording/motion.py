# SPDX-License-Identifier: Apache-2.0
"""Motion: depth from velocity, velocity from depth, two clocks joined, and which way is inwards."""

import numpy as np

from ..errors import InputError
from .recording import Note

_SMOOTHING = 0.05  # s: depth's change over this time gives the velocity


def integral(time: np.ndarray, velocity: np.ndarray, start: float, at: np.ndarray) -> np.ndarray:
    """Depth (m,) [m] at the times ``at`` [s], from ``start`` [m] at ``time[0]`` and velocity (n,) [m/s] on ``time``.

    Velocity is taken as linear between its samples, and integrated exactly. ``at`` must lie within ``time``.
    """
    steps = 0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time)
    corners = start + np.concatenate([[0.0], np.cumsum(steps)])
    left = np.clip(np.searchsorted(time, at, side="right") - 1, 0, len(time) - 2)
    here = np.interp(at, time, velocity)
    return corners[left] + 0.5 * (velocity[left] + here) * (at - time[left])


def derivative(time: np.ndarray, depth: np.ndarray) -> tuple[np.ndarray, float]:
    """Velocity (n,) [m/s] as the change of depth over about 50 ms around each sample, and that time [s].

    The window is cut at the ends of the recording and never below the two neighbours.
    """
    step = float(np.median(np.diff(time)))
    half = min(max(1, round(0.5 * _SMOOTHING / step)), (len(time) - 1) // 2)
    if half == 0:  # two samples
        return np.full(len(time), (depth[1] - depth[0]) / (time[1] - time[0])), step
    velocity = np.empty(len(time))
    velocity[half:-half] = (depth[2 * half :] - depth[: -2 * half]) / (time[2 * half :] - time[: -2 * half])
    velocity[:half] = (depth[half : 2 * half] - depth[0]) / (time[half : 2 * half] - time[0])
    velocity[-half:] = (depth[-1] - depth[-2 * half : -half]) / (time[-1] - time[-2 * half : -half])
    return velocity, 2 * half * step


def signed(time: np.ndarray, depth: np.ndarray, velocity: np.ndarray) -> tuple[np.ndarray, bool]:
    """A speed that never turns negative though depth does, with depth's sign; and whether that was so."""
    if velocity.min() < 0.0 or depth.max() - depth[-1] < 0.02 * np.ptp(depth):
        return velocity, False
    return np.copysign(velocity, derivative(time, depth)[0]), True


def overlap(time: np.ndarray, motion: np.ndarray, place: str) -> slice:
    """The samples of ``time`` (n,) [s] that lie within the motion's own times. Raises InputError below two."""
    first, last = np.searchsorted(time, motion[0], "left"), np.searchsorted(time, motion[-1], "right")
    if last - first < 2:
        raise InputError(
            "times of the motion",
            f"{motion[0]:.6g} to {motion[-1]:.6g} s",
            f"the force runs from {time[0]:.6g} to {time[-1]:.6g} s",
            place,
            "Bring both clocks to one zero, and check the units of time.",
        )
    return slice(int(first), int(last))


def check_direction(depth: np.ndarray, force: np.ndarray, place: str) -> list[Note]:
    """Refuse depth that decreases inwards; tell of a force that seems to have the other sign.

    Along the way from the first sample to the farthest one, an insertion's force rises. A withdrawal also
    goes to smaller depths, but its force falls, or is tension: it passes.
    """
    outermost, innermost = int(np.argmin(depth)), int(np.argmax(depth))
    inwards = depth[innermost] - depth[0] >= depth[0] - depth[outermost]
    stroke = force[: (innermost if inwards else outermost) + 1] - force[0]
    rise, fall = float(stroke.max()), float(-stroke.min())
    if not inwards and rise > 3.0 * fall and stroke.max() + force[0] > 0.5 * rise:
        raise InputError(
            "depth",
            f"decreasing from {depth[0]:.6g} to {depth[outermost]:.6g} m while the force grows by {rise:.4g} N",
            "it must increase inwards",
            place,
            "If this file counts the other way, give --depth-inwards decreasing.",
        )
    if inwards and fall > 3.0 * rise:
        return [
            Note(
                "sign",
                f"the force falls by {fall:.4g} N on the way in, but + is what opposes insertion: "
                "if the sensor counts the other way, give --unit force=-N",
            )
        ]
    return []
