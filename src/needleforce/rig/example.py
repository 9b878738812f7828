# SPDX-License-Identifier: Apache-2.0
"""The recording that ships with the package: small, simulated, read like any other."""

import numpy as np

from ..recording import Card, Recording
from .experiment import paper_experiment

_EVERY = 10  # samples: one average each, so that the noise is white again


def example_recording(seed: int = 1) -> Recording:
    """One insertion at 3 mm/s at 100 Hz: time, depth, velocity, force, fx and fy, rounded to make a small file.

    Every sample is the average of ten readings, as the rig's filter gives it; no two share one: ``filter_length`` is 1.
    """
    full = paper_experiment(seed, sites=1, speeds=(3e-3,)).runs[0].recording()
    first = -round(full.time[0] * full.rate) % _EVERY
    card = Card(full.card.source, "", full.card.needle, full.card.tissue, f"{full.card.rig}; every {_EVERY}th sample")
    keep = slice(first, None, _EVERY)
    time, depth, velocity, force = (
        np.round(getattr(full, name)[keep], digits)
        for name, digits in (("time", 6), ("depth", 8), ("velocity", 7), ("force", 5))
    )
    axes = {name: np.round(full.axes[name][keep], 5) for name in ("fx", "fy")}
    return Recording(time, depth, velocity, force, axes, card)
