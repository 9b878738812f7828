# SPDX-License-Identifier: Apache-2.0
"""What is said of a run at its end."""

import numpy as np

from ..errors import InputError
from ..recording.alignment import align
from .settings import Outcome


def told(outcome: Outcome) -> dict[str, str]:
    """The end of a file, in words."""
    shown = ("ended", "detail", "seconds", "received", "lost", "doubled", "late", "longest_own_gap", "peak_force")
    return {
        name: f"{value:.6g}" if isinstance(value := getattr(outcome, name), float) else str(value) for name in shown
    }


def alignment_uncertainty(pairs: list[tuple[int, int]]) -> float | None:
    """How well the sensor's clock is known on this computer's [s], 95 %; None for too few readings."""
    if len(pairs) < 20:
        return None
    kept = np.array(sorted(pairs), dtype=np.int64)  # late ones in their place
    device, arrival = 1e-9 * (kept - kept[0]).T
    try:
        return float(align(device, arrival).uncertainty)
    except InputError:
        return None
