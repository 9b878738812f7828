# SPDX-License-Identifier: Apache-2.0
"""One thing that is anomalous in a recording, and how it is put in words."""

from dataclasses import dataclass

import numpy as np

INVALIDATING = ("sign", "force_unit", "depth_unit", "saturated")
"""Kinds of anomalies after which a force curve is not what was measured."""
_SHOWN = {"m": (1e3, "mm"), "m/s": (1e3, "mm/s"), "N/m": (1e-3, "N/mm"), "N/m^2": (1e-6, "N/mm²"), "1": (1.0, "")}


@dataclass(frozen=True)
class Anomaly:
    """``quantity`` has ``value`` [SI ``unit``] where the repeats have ``usual`` (NaN where nothing is compared).

    ``sentence`` says so in words, with what to do; ``left_out``: the pooled fit goes on without the recording.
    """

    kind: str
    quantity: str
    value: float
    usual: float
    unit: str
    sentence: str
    left_out: bool = False


def shown(value: float, unit: str) -> str:
    """A number for people, in three digits before the point or altogether."""
    factor, name = _SHOWN.get(unit, (1.0, unit))
    value = factor * value
    return f"{value:.0f} {name}".rstrip() if 1000.0 <= abs(value) < 1e6 else f"{value:.3g} {name}".rstrip()


def nearest(ratio: float, known: tuple[float, ...], within: float) -> float | None:
    """The one of the ``known`` factors, or its inverse, that ``ratio`` is within a share of; None if there is none."""
    if not (np.isfinite(ratio) and ratio > 0.0):
        return None
    every = [factor for each in known for factor in (each, 1.0 / each)]
    best = min(every, key=lambda factor: abs(np.log(ratio / factor)))
    return best if abs(np.log(ratio / best)) <= np.log1p(within) else None
