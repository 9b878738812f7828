# SPDX-License-Identifier: Apache-2.0
"""Parameters of one repeat that are far from those of the others, by median and median absolute deviation."""

from collections.abc import Iterator, Mapping

import numpy as np

from ..identification.estimates import Estimate
from .anomaly import Oddity, shown

FEWEST = 4  # repeats
LOOKED_AT = (
    "puncture_force", "puncture_indentation", "stiffness_coefficient", "reference_force", "friction_per_length",
    "cutting_force",
)  # fmt: skip
LEAST = 0.1  # of the median: less is no matter, however well the others agree

# repeats -> how many scaled MADs the farthest of them is from the median, at most, in 99 % of normal samples
# (200 000 samples each): for few repeats the MAD itself is a poor guess of the scatter
_EVEN = ((4, 15.8), (6, 10.0), (8, 8.0), (10, 6.9), (12, 6.3), (14, 5.9), (20, 5.3), (30, 4.8), (50, 4.5), (100, 4.3))
_ODD = ((5, 18.7), (7, 10.7), (9, 8.3), (11, 7.0), (13, 6.4), (15, 5.9), (21, 5.3), (31, 4.8), (51, 4.5), (101, 4.3))


def limit(count: int) -> float:
    """Scaled MADs beyond which one of ``count`` values is an outlier: 1 in 100 normal samples holds one."""
    counts, limits = zip(*(_ODD if count % 2 else _EVEN))
    return float(np.interp(count, counts, limits))


def outliers(repeats: Mapping[str, Mapping[str, Estimate]]) -> Iterator[tuple[str, Oddity]]:
    """File and oddity for each parameter of ``repeats`` (file -> its own estimates) that is far off.

    At least four repeats must have the parameter. An outlier is beyond ``limit`` scaled MADs, a tenth of the median
    and its own interval. It stays in the pooled fit: without a cause, leaving it out would choose the result.
    """
    for name in LOOKED_AT:
        known = {file: each[name] for file, each in repeats.items() if name in each and each[name].identifiable}
        if len(known) < FEWEST:
            continue
        values = np.array([each.value for each in known.values()])
        middle = float(np.median(values))
        scale = 1.4826 * float(np.median(np.abs(values - middle)))
        least = max(limit(len(values)) * scale, LEAST * abs(middle))
        if least == 0.0:  # most stand at the bound of the fit, which is no scatter
            continue
        for file, each in known.items():
            off, half = abs(each.value - middle), 0.5 * (each.high - each.low)
            if off > least and not off <= half:
                yield file, _oddity(each, middle, scale)


def _oddity(each: Estimate, middle: float, scale: float) -> Oddity:
    words = each.name.replace("_", " ")
    said = f"Its {words} is {shown(each.value, each.unit)}, far from that of its repeats, {shown(middle, each.unit)} "
    said += f"with a scatter of {shown(scale, each.unit)}."
    return Oddity("outlier", each.name, each.value, middle, each.unit, said)
