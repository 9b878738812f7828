# SPDX-License-Identifier: Apache-2.0
"""The result of one recording of a campaign with its anomalies, and numbers formatted for their sentences."""

from dataclasses import dataclass, field

import numpy as np

from ..identification.estimates import Estimate, Quality
from ..segmentation import Events
from ..vocabulary import Status
from .summary import Trace

INVALIDATING = ("sign", "force_unit", "depth_unit", "saturated")
"""Kinds of anomalies that invalidate the values of a recording."""
_DISPLAY_UNITS = {
    "m": (1e3, "mm"),
    "m/s": (1e3, "mm/s"),
    "N/m": (1e-3, "N/mm"),
    "N/m^2": (1e-6, "N/mm²"),
    "1": (1.0, ""),
}


@dataclass(frozen=True, kw_only=True)
class Anomaly:
    """An anomaly of a recording.

    Parameters
    ----------
    kind : str
        A short name, such as ``sign``, ``force_unit``, ``motion`` or ``outlier``.
    quantity : str
        The quantity that is anomalous.
    value : float
        Its value [``unit``].
    usual : float
        The value of the repeats [``unit``], NaN if nothing is compared.
    unit : str
        SI unit.
    sentence : str
        A description with the next step.
    left_out : bool
        True if the pooled fit does not use the recording.
    """

    kind: str
    quantity: str
    value: float
    usual: float
    unit: str
    sentence: str
    left_out: bool = False


@dataclass(frozen=True, eq=False, kw_only=True)
class RecordingResult:
    """The result of one recording.

    Parameters
    ----------
    file : str
        Path relative to the campaign's folder.
    fields : dict
        The label: field -> text.
    status : Status
        Status of the recording.
    notes : tuple of str
        Notes of segmentation and fit, or why the file could not be read.
    reading : tuple of str
        Notes made while reading.
    anomalies : tuple of Anomaly
        Its anomalies.
    pooled : bool
        Whether the pooled parameters of the condition use it.
    events : Events
        Its events and phases.
    measured : dict
        Quantities measured without a model: motion, forces and events.
    parameters : dict
        Parameters of its own fit, empty if there is none.
    quality : Quality or None
        Quality of its own fit.
    shown : Trace or None
        Its curve for drawing, None if it could not be read.
    curve : (m,) array
        Its loading curve [N] for comparison, empty if it could not be read or is too short.
    """

    file: str
    fields: dict[str, str]
    status: Status
    notes: tuple[str, ...] = ()
    reading: tuple[str, ...] = ()
    anomalies: tuple[Anomaly, ...] = ()
    pooled: bool = False
    events: Events = field(default_factory=Events)
    measured: dict[str, Estimate] = field(default_factory=dict)
    parameters: dict[str, Estimate] = field(default_factory=dict)
    quality: Quality | None = None
    shown: Trace | None = None
    curve: np.ndarray = field(default_factory=lambda: np.empty(0))

    @property
    def has_parameters(self) -> bool:
        """Whether its own fit has parameters."""
        return bool(self.parameters)

    @property
    def left_out(self) -> bool:
        """Whether the pooled fit does not use it because of an anomaly."""
        return any(each.left_out for each in self.anomalies)

    @property
    def why(self) -> str:
        """Its anomalies in sentences and, if it has no parameters, the reason."""
        sentences = [each.sentence for each in self.anomalies]
        explained = self.has_parameters or any(each.kind == "no_puncture" for each in self.anomalies)
        return " ".join(sentences if explained else [*sentences, *self.notes])


def formatted(value: float, unit: str) -> str:
    """Format a value with its unit: three significant digits, or all digits before the decimal point."""
    factor, name = _DISPLAY_UNITS.get(unit, (1.0, unit))
    value = factor * value
    return f"{value:.0f} {name}".rstrip() if 1000.0 <= abs(value) < 1e6 else f"{value:.3g} {name}".rstrip()


def nearest(ratio: float, known: tuple[float, ...], within: float) -> float | None:
    """The factor of ``known``, or the inverse of one, that is within a relative distance ``within`` of ``ratio``, or
    None."""
    if not (np.isfinite(ratio) and ratio > 0.0):
        return None
    candidates = [factor for each in known for factor in (each, 1.0 / each)]
    best = min(candidates, key=lambda factor: abs(np.log(ratio / factor)))
    return best if abs(np.log(ratio / best)) <= np.log1p(within) else None
