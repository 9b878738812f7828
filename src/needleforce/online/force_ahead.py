# SPDX-License-Identifier: Apache-2.0
"""The force over the next travel with its interval, and the next puncture."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..display.axes import DEPTH, FORCE
from ..display.canvas import MODEL
from ..display.quantities import percent, quantity
from ..display.result import Result
from ..identification.estimates import Estimate


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class ForceAhead(Result):
    """What is expected over the next travel, from ``OnlineIdentifier.ahead``.

    Attributes
    ----------
    depth : numpy.ndarray
        Depths (n,) [m], the first one now.
    force : numpy.ndarray
        Median of the force (n,) [N].
    low, high : numpy.ndarray
        Its 95 % interval (n,) [N], which includes the parameters, the texture and a puncture before that depth.
    puncture_probability : float
        That there is a puncture within this travel.
    next_puncture : Estimate or None
        Depth of the next puncture [m]; None where none is looked for.
    layers : tuple of float
        Probability of each layer, the first one first, that the tip is in it; the rest is that it is in none.
    regime, status : str
        What the needle does, and what the last sample was worth.
    """

    depth: np.ndarray
    force: np.ndarray
    low: np.ndarray
    high: np.ndarray
    puncture_probability: float
    next_puncture: Estimate | None
    layers: tuple[float, ...]
    regime: str
    status: str

    def _heading(self) -> str:
        travel = abs(float(self.depth[-1] - self.depth[0]))
        return f"Force over the next {quantity(travel, None, None, 'm')} ({self.regime})"

    def _cells(self) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
        rows = [
            (str(quantity(depth, None, None, "m")), str(quantity(force, low, high, "N")))
            for depth, force, low, high in zip(self.depth, self.force, self.low, self.high)
        ]
        return ("depth", "force, 95 % interval"), rows

    def _remarks(self):
        if self.next_puncture is not None:
            chance = f"within this travel with a probability of {percent(self.puncture_probability)}"
            yield "Next puncture", (f"at {self.next_puncture.shown}", chance)
        likely = (f"layer {k}: {percent(p)}" for k, p in enumerate(self.layers, 1) if p >= 0.005)
        yield "Where the tip is", tuple(likely)

    def _draw(self, axes: Any) -> tuple[str, ...]:
        axes.fill_between(1e3 * self.depth, self.low, self.high, color=MODEL, alpha=0.2, label="95 % interval")
        axes.plot(1e3 * self.depth, self.force, color=MODEL, lw=1.4, label="expected")
        return DEPTH, FORCE

    def document(self) -> dict:
        """The numbers in SI."""
        puncture = None if self.next_puncture is None else self.next_puncture.document()
        return {
            "depth_m": self.depth.tolist(),
            "force_N": self.force.tolist(),
            "low_N": self.low.tolist(),
            "high_N": self.high.tolist(),
            "puncture_probability": self.puncture_probability,
            "next_puncture": puncture,
            "layers": list(self.layers),
            "regime": self.regime,
            "status": self.status,
        }

    def to_dataframe(self) -> Any:
        """Depth, force and interval as a pandas DataFrame in SI."""
        import pandas

        names = ("depth", "force", "low", "high")
        return pandas.DataFrame({name: getattr(self, name) for name in names})
