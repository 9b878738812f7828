# SPDX-License-Identifier: Apache-2.0
"""What is wrong or doubtful with the signals of a recording, as sentences."""

import numpy as np


def unreadable(time: np.ndarray, depth: np.ndarray, force: np.ndarray) -> str:
    """Why (n,) time, depth and force cannot be segmented; empty if they can."""
    if not all(np.isfinite(values).all() for values in (time, depth, force)):
        return "The recording contains values that are not finite."
    back = np.flatnonzero(np.diff(time) <= 0.0)
    if not len(back):
        return ""
    where = f"at {len(back)} places, first at sample {back[0] + 1}"
    return f"The time does not increase from sample to sample: {where}. Sort the samples by time."


def doubts(time, depth, force, chosen):
    return ()
