# SPDX-License-Identifier: Apache-2.0
"""What every identification of a steered needle returns: parameters with intervals, and how they are shown and kept."""

import json
import math
import os
from dataclasses import asdict, dataclass
from typing import Any

from ..display.markup import Markup, element, join, listing, table
from ..display.quantities import quantity
from ..display.tables import blocks, text_list, text_table
from ..files import json_safe
from .steering_model import SteeringModel
from .steering_parameters import SteeringEstimate

HEAD = ("parameter", "value, 95 % interval", "identifiable", "meaning")


@dataclass(frozen=True)
class SteeringResult:
    """An identified needle.

    Attributes
    ----------
    model : SteeringModel
        What simulates it, predicts and plans.
    parameters : tuple of SteeringEstimate
        With intervals, which assume that the model is right.
    trade_offs : tuple of (str, str, float)
        Pairs of parameters whose errors have a correlation beyond 0.9.
    rms : dict of str to object
        Insertion -> root mean square of what the fit leaves.
    """

    model: SteeringModel
    parameters: tuple[SteeringEstimate, ...]
    trade_offs: tuple[tuple[str, str, float], ...]
    rms: dict[str, Any]

    measured = "insertions"  # what it was identified from

    def save(self, path: str | os.PathLike) -> None:
        """Write the model as a file that ``nf.steering.load`` and ``needleforce steer plan`` read."""
        from .steering_files import save

        save(self.model, path)

    def to_json(self) -> str:
        """The result as a document: model, parameters in SI, trade-offs, what the fit leaves."""
        document = {
            "model": self.model.form,
            "parameters": [asdict(each) for each in self.parameters],
            "trade_offs": [list(each) for each in self.trade_offs],
            "insertions": [{"name": name, **fields} for name, fields in self.by_insertion().items()],
        }
        return json.dumps(json_safe(document), indent=2, allow_nan=False)

    def report(self, path: str | os.PathLike) -> None:
        """Write a report as one HTML file that opens offline."""
        from ..report import write_steering_report

        write_steering_report(self, path)

    def by_insertion(self) -> dict[str, dict[str, Any]]:
        """Insertion -> what the fit leaves of it, in SI."""
        return {name: {"rms": value} for name, value in self.rms.items()}

    def rows(self) -> list[tuple[str, str, str, str]]:
        """Each parameter as text under ``HEAD``."""
        return [
            (p.name, str(quantity(p.value, p.low, p.high, p.unit)), "yes" if p.identifiable else "no", p.meaning)
            for p in self.parameters
        ]

    def remarks(self) -> list[str]:
        """What a reader should know of the intervals."""
        pairs = [f"{a} and {b} (correlation {value:+.2f})" for a, b, value in self.trade_offs]
        return [f"trade off with each other: {', '.join(pairs)}"] if pairs else []

    def heading(self) -> str:
        """The result in a line."""
        sizes = [value for value in self.rms.values() if isinstance(value, float) and math.isfinite(value)]
        left = f", lateral error {1e3 * min(sizes):.2f} to {1e3 * max(sizes):.2f} mm rms" if sizes else ""
        return f"Needle identified from {len(self.rms)} {self.measured}, model {self.model.form}{left}"

    def __str__(self) -> str:
        return blocks(self.heading(), text_table(HEAD, self.rows()), text_list("Remarks", self.remarks()))

    def _repr_html_(self) -> Markup:
        remarks = [listing(self.remarks())] if self.remarks() else []
        return join([element("p", self.heading()), table(HEAD, self.rows()), *remarks])
