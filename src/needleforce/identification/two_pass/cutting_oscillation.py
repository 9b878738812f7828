# SPDX-License-Identifier: Apache-2.0
"""The range over which the cutting force swings where it sticks and slips: paper sec. 2.3, at 1 mm/s."""

import numpy as np

from ..estimates import Estimate, mean_estimate
from .result import Site, TwoPass

FEWEST = 3  # cycles: fewer are a wander
CLEAR = 8.0  # standard deviations of the noise: a thousand points of noise alone span some 6.5
LEAST = 0.25  # of the mean difference: less is not told apart from two passes that differ in friction here and there


def swing(two_pass: TwoPass) -> tuple[Estimate, Estimate] | None:
    """Mean trough and mean crest [N] of the difference between the passes, over the sites; None where it is steady.

    Names ``cutting_force_low`` and ``cutting_force_high``; the interval is that of the sites. What biases the
    difference biases both ends alike.
    """
    ends = [found for found in map(_of_site, two_pass.sites) if found is not None]
    if 2 * len(ends) <= len(two_pass.sites):
        return None
    source = "mean trough and crest of the first minus the second insertion, where it sticks and slips"
    low, high = zip(*ends)
    return tuple(
        mean_estimate(f"cutting_force_{name}", list(values), "N", source)
        for name, values in (("low", low), ("high", high))
    )


def _of_site(site: Site) -> tuple[float, float] | None:
    if not len(site.swinging):
        return None
    least = max(CLEAR * site.noise, LEAST * abs(float(np.mean(site.swinging))))
    troughs, crests = _turns(site.swinging, least)
    # the first half cycle starts where the puncture left it
    return (float(np.mean(troughs[1:])), float(np.mean(crests[1:]))) if len(troughs) > FEWEST else None


def _turns(values: np.ndarray, least: float) -> tuple[list[float], list[float]]:
    """Troughs and crests of ``values`` (n,) between which it swings by at least ``least``, in order."""
    troughs, crests = [], []
    lowest = highest = float(values[0])
    rising = None
    for value in values:
        lowest, highest = min(lowest, value), max(highest, value)
        if rising is not False and highest - value >= least:  # it turned down
            crests.append(float(highest))
            rising, lowest = False, value
        elif rising is not True and value - lowest >= least:  # it turned up
            troughs.append(float(lowest))
            rising, highest = True, value
    pairs = min(len(troughs), len(crests))
    return troughs[:pairs], crests[:pairs]
