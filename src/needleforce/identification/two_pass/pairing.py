# SPDX-License-Identifier: Apache-2.0
"""In what two passes at one site differ as they were recorded, told as doubts about their subtraction."""

import numpy as np

from ...recording import Recording
from ...segmentation import Events
from ..one_layer.fit_recording import Single

ALIKE = 0.1  # of the faster: stages keep their speed to a percent or two
SHORT = 0.9  # of the window


def doubts_of(first: Single, second: Recording, events: Events, grid: np.ndarray, window: float) -> tuple[str, ...]:
    """Speeds that differ, a window cut short, a second contact above the first's, another puncture in the window."""
    said = []
    speeds = [speed_of(first.recording), speed_of(second)]
    if min(speeds) < (1.0 - ALIKE) * max(speeds):
        said.append(
            f"First and second pass went at {1e3 * speeds[0]:.3g} and {1e3 * speeds[1]:.3g} mm/s: what friction and "
            "cutting change with speed is in the difference."
        )
    if np.ptp(grid) < SHORT * window:
        said.append(f"The passes share {1e3 * np.ptp(grid):.1f} mm after the puncture, not {1e3 * window:.0f} mm.")
    if _above(first, events, second):
        said.append(
            "The second pass meets the tissue before the first did: its zero of depth may be another, or the surface "
            "was pulled up."
        )
    start = first.events.punctures[0].depth - first.events.punctures[0].indentation
    if any(grid[0] < puncture.depth - start < grid[-1] for puncture in first.events.punctures[1:]):
        said.append(
            "The first pass drops once more within the window: the difference holds what it deforms there, unless the "
            "cutting force swings."
        )
    return tuple(said)


def speed_of(recording: Recording) -> float:
    """Median speed [m/s] of the way in, over the samples that move."""
    inwards = recording.velocity[: int(np.argmax(recording.depth)) + 1]
    moving = inwards > 0.1 * float(np.max(inwards, initial=0.0))
    return float(np.median(inwards[moving])) if moving.any() else 0.0


def _above(first: Single, events: Events, second: Recording) -> bool:
    """Whether the second contact surely lies above the first."""
    one, other = first.events.contact, events.contact
    if one is None or other is None:
        return False
    return float(second.depth[other.high]) < float(first.recording.depth[one.low])
