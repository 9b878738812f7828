# SPDX-License-Identifier: Apache-2.0
"""The result of the identification of one recording."""

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from ..display.tables import blocks, text_list, text_table
from ..recording import Recording
from ..segmentation import Events
from ..vocabulary import Status
from .estimates import Parameters, Quality
from .one_layer.cycle_values import CycleFit
from .strokes import Strokes


class FittedTogether(Protocol):
    """A fit of all layers, whose parameters can be drawn together."""

    def standard(self, count: int, random: np.random.Generator) -> dict[str, np.ndarray]:
        """Normal numbers (count,) of variance 1 for each value, correlated as the values are."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class RecordingFit:
    """The result of one recording.

    Attributes
    ----------
    file : str
        Name of the file, or of the recording's source.
    status : Status
        ``ok``, or the reason why it has no parameters.
    recording : Recording or None
        None where the file could not be read.
    events : Events
        Contact, punctures, exit and phases.
    parameters : Parameters
        Its own estimates by name; may be empty.
    quality : Quality or None
        Residual of the model over the strokes; None without a model.
    predicted : numpy.ndarray
        Force (n,) [N] of the model along the recording's motion; empty without a model.
    notes : tuple of str
        Notes of reading, segmentation and fit.
    cycle : CycleFit or None
        The one-layer fit of ``strokes``, for the estimates and draws.
    layers : FittedTogether or None
        The fit of layers that rupture one after another in its insertion, for draws.
    strokes : Strokes or None
        The insertion and withdrawal strokes as they were fitted.
    """

    file: str
    status: Status
    recording: Recording | None
    events: Events
    parameters: Parameters = field(default_factory=Parameters)
    quality: Quality | None = None
    predicted: np.ndarray = field(default_factory=lambda: np.empty(0))
    notes: tuple[str, ...] = ()
    cycle: CycleFit | None = None
    layers: FittedTogether | None = None
    strokes: Strokes | None = None

    def __post_init__(self):
        object.__setattr__(self, "parameters", Parameters(self.parameters))

    @property
    def surface(self) -> float:
        """Depth [m] of zero indentation: its identified contact, at which the model starts, or the detected one; 0
        without one."""
        if "contact_depth" in self.parameters:
            return self.parameters["contact_depth"].value
        return self.events.contact.depth if self.events.contact is not None else 0.0

    @property
    def residuals(self) -> np.ndarray:
        """Measured minus modelled force (n,) [N] at every sample; empty without a model."""
        if self.recording is None or len(self.predicted) != len(self.recording):
            return np.empty(0)
        return self.recording.force - self.predicted

    def __repr__(self) -> str:
        found = f"{len(self.parameters)} parameters" if self.parameters else "no parameters"
        return f"<RecordingFit of {self.file!r}: {self.status}, {found}>"

    def __str__(self) -> str:
        return blocks(repr(self), text_table(*self.parameters.cells()), text_list("Notes", self.notes))
