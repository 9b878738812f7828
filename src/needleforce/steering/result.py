# SPDX-License-Identifier: Apache-2.0
"""What every identification of a steered needle returns: parameters with intervals, and how they are shown and kept."""

import math
import os
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..display.axes import draw_intervals
from ..display.markup import listing, table
from ..display.quantities import quantity
from ..display.result import Result
from ..display.tables import parameters_html
from .steering_model import SteeringModel
from .steering_parameters import SteeringEstimate

if TYPE_CHECKING:
    import pandas

    from ..display.page import Figure, Page

HEAD = ("parameter", "value, 95 % interval", "identifiable", "meaning")


@dataclass(frozen=True, repr=False)
class SteeringResult(Result):
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

    def by_insertion(self) -> dict[str, dict[str, Any]]:
        """Insertion -> what the fit leaves of it, in SI."""
        return {name: {"rms": value} for name, value in self.rms.items()}

    def remarks(self) -> list[str]:
        """What a reader should know of the intervals."""
        pairs = [f"{a} and {b} (correlation {value:+.2f})" for a, b, value in self.trade_offs]
        return [f"trade off with each other: {', '.join(pairs)}"] if pairs else []

    def _heading(self) -> str:
        sizes = [value for value in self.rms.values() if isinstance(value, float) and math.isfinite(value)]
        left = f", lateral error {1e3 * min(sizes):.2f} to {1e3 * max(sizes):.2f} mm rms" if sizes else ""
        return f"Needle identified from {len(self.rms)} {self.measured}, model {self.model.form}{left}"

    def insertion_table(self) -> tuple[list[str], list[list[str]]]:
        """Heads and cells of what the fit leaves of each insertion."""
        found = self.by_insertion()
        keys = list(dict.fromkeys(key for fields in found.values() for key in fields))
        rows = [[name, *(_cell(key, fields[key]) for key in keys)] for name, fields in found.items()]
        return ["insertion", *(_HEADS.get(key, key) for key in keys)], rows

    def _cells(self) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
        rows = [
            (p.name, str(quantity(p.value, p.low, p.high, p.unit)), "yes" if p.identifiable else "no", p.meaning)
            for p in self.parameters
        ]
        return HEAD, rows

    def _remarks(self) -> Iterable[tuple[str, Iterable[str]]]:
        yield "Remarks", self.remarks()

    def _draw(self, axes: Any) -> tuple[str, ...]:
        return draw_intervals(axes, [(each.name, each.value, each.low, each.high) for each in self.parameters])

    def document(self) -> dict:
        """Model, parameters in SI, trade-offs, and what the fit leaves, as ``to_json`` writes them."""
        return {
            "model": self.model.form,
            "parameters": [asdict(each) for each in self.parameters],
            "trade_offs": [list(each) for each in self.trade_offs],
            "remarks": self.remarks(),
            "insertions": [{"name": name, **fields} for name, fields in self.by_insertion().items()],
        }

    def to_dataframe(self) -> "pandas.DataFrame":
        """The parameters as a pandas DataFrame in SI, indexed by name."""
        import pandas

        return pandas.DataFrame([asdict(each) for each in self.parameters]).set_index("name")

    def _page(self) -> "Page":
        from ..display.page import Page, section

        words = listing(["Intervals assume that the model is right.", *self.remarks()], class_="note")
        notes: dict[str, list[str]] = {}
        for path in self.model.predictor.insertions:
            if path.note:
                notes.setdefault(path.note, []).append(path.name)
        remarks = [f"{note} ({', '.join(names)})" if len(notes) > 1 else note for note, names in notes.items()]
        left = table(*self.insertion_table(), class_="numbers dense")
        return Page(
            title="An identified steered needle",
            kind="steering",
            outcome=f"{self.heading()}.",
            sections=[
                section("Tips", *self._tip_figures(), name="tips"),
                section("Parameters", table(*self.cells(), class_="cards numbers dense"), words, name="parameters"),
                section("Insertions", left, listing(remarks, class_="note"), name="insertions"),
                section("Needle", parameters_html(self.model.needle), name="needle"),
            ],
        )

    def _tip_figures(self) -> Sequence["Figure"]:
        """Figures of measured and predicted tips, where tips were measured."""
        return ()


_HEADS = {
    "rms_m": "error in the fit [mm]",
    "left_out_rms_m": "error when left out [mm]",
    "rms": "residual of fx, fy [N], tx, ty [N m]",
}


def _cell(key: str, value: Any) -> str:
    factor = 1e3 if key.endswith("_m") else 1.0
    return ", ".join(f"{factor * each:.3g}" for each in np.atleast_1d(np.asarray(value, dtype=float)))
