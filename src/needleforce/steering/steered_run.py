# SPDX-License-Identifier: Apache-2.0
"""A simulated insertion of a steered needle, for a motion of its base."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..display.result import Result
from ..errors import InputError
from ..files import write_rows
from ..models.flexible_insertion import FlexibleInsertion
from ..models.model import Model
from .base_motion import COLUMNS as BASE_COLUMNS
from .base_motion import BaseMotion, base_moves
from .path_errors import PathReadings
from .steering_model import SteeringModel, steering_model
from .tip_paths import TIP_COLUMNS, TipPath

if TYPE_CHECKING:
    import pandas

    from ..display.page import Page

COLUMNS = (
    *BASE_COLUMNS, *TIP_COLUMNS, "force_N", "fx_N", "fy_N", "fz_N", "tx_Nmm", "ty_Nmm", "tz_Nmm",
    "status",
)  # fmt: skip
_SHAPES = 5


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class SteeredRun(Result):
    """What a needle does in the steps of a base motion.

    Attributes
    ----------
    motion : BaseMotion
        Of the base.
    tip : ndarray, shape (n, 3)
        After each step [m], in the frame of the tissue; of an identified needle from its point of entry, in the frame
        of its tip paths and with the error that they had in common.
    force : ndarray, shape (n,)
        Axial force [N]; 0 without a model of it.
    wrench : ndarray, shape (n, 6)
        Of the tissue on the needle at the base [N], [N m].
    shapes : tuple of ndarray, shape (m, 3)
        The needle at some of the steps, the last of which is the end [m].
    layers : tuple of float
        Depths at which the tissue changes [m].
    lost : ndarray of bool, shape (n,)
        Where the needle buckled, or a step was impossible.
    """

    motion: BaseMotion
    tip: np.ndarray
    force: np.ndarray
    wrench: np.ndarray
    shapes: tuple[np.ndarray, ...]
    layers: tuple[float, ...]
    lost: np.ndarray

    def rows(self) -> list[dict[str, float | str]]:
        """A row a step under ``COLUMNS``."""
        units = np.array([1.0] * 3 + [1e3] * 3)
        numbers = np.column_stack([1e3 * self.tip, self.force, units * self.wrench])
        return [
            row | dict(zip(COLUMNS[len(row) :], [*map(float, values), "lost" if lost else "ok"], strict=True))
            for row, values, lost in zip(self.motion.rows(), numbers, self.lost)
        ]

    def write(self, path: str | os.PathLike) -> None:
        """Write a row a step as CSV. Raises InputError if the file cannot be written."""
        write_rows(path, COLUMNS, self.rows())

    def _heading(self) -> str:
        end = ", ".join(f"{1e3 * value:.2f}" for value in self.tip[-1])
        lost = " Some steps are invalid: the needle buckles, or a step is impossible." * bool(self.lost.any())
        force = f", with an axial force of {self.force[-1]:.3f} N" * bool(self.force.any())
        return f"The tip ends at ({end}) mm{force}.{lost}"

    def _cells(self) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
        shown = [name for name in COLUMNS if name not in ("fz_N", "tz_Nmm") and (name != "force_N" or self.force.any())]
        rows = [
            [f"{row[name]:.3f}" if isinstance(row[name], float) else row[name] for name in shown] for row in self.rows()
        ]
        return shown, rows

    def _draw(self, axes: Any) -> tuple[str, ...]:
        """The path of the tip across, over its depth."""
        from .figures import draw_path

        return draw_path(axes, self.tip)

    def document(self) -> dict:
        """Steps and layers, as ``to_json`` writes them."""
        return {"steps": self.rows(), "layers_m": list(self.layers)}

    def to_dataframe(self) -> "pandas.DataFrame":
        """A pandas DataFrame with a row for each step, units in the names of its columns."""
        import pandas

        return pandas.DataFrame(self.rows(), columns=list(COLUMNS))

    def _page(self) -> "Page":
        from ..display.page import Page, section
        from . import figures

        path = figures.Scene(path=self.tip, shapes=self.shapes, layers=self.layers).figures()
        loads = figures.loads(self.motion.depth, self.force, self.wrench)
        return Page(
            title="A simulated insertion",
            kind="steering",
            outcome=self.heading(),
            sections=[
                section("Path", *path, name="path"),
                section("Force and wrench", loads, name="loads"),
                section("Motion of the base", figures.base_motion(self.motion), name="motion"),
            ],
        )


def simulate(model: SteeringModel | FlexibleInsertion, motion: BaseMotion, *, axial: Model | None = None) -> SteeredRun:
    """Simulate an insertion step by step: in each, base and bevel move at rest, then the needle is pushed in.

    Parameters
    ----------
    model : SteeringModel or FlexibleInsertion
        An identified needle, or one whose parameters are given, which is reset.
    motion : BaseMotion
        Of the base.
    axial : Model, optional
        Laws of the axial force, for an identified needle.

    Returns
    -------
    SteeredRun

    Raises
    ------
    InputError
        If the model is no steering model, ``axial`` is given for an insertion that has its own, or the motion has no
        rows or withdraws the needle.
    """
    steered = steering_model(model, axial)
    if not len(motion) or np.any(np.diff(motion.depth) < 0.0):
        limit, step = "must have rows and not decrease", "For a withdrawal, call run of a FlexibleInsertion."
        raise InputError("depth of the base motion", f"{len(motion)} rows", limit, next_step=step)
    flex = model if isinstance(model, FlexibleInsertion) else steered.insertion(axial, small_slopes=True)
    flex.reset()
    depth = np.maximum.accumulate(np.maximum(motion.depth - steered.values.get("surface", 0.0), 0.0))
    path = TipPath("run", motion.lateral, np.column_stack([0.0 * motion.lateral, depth]), None, roll=motion.roll)
    moves = base_moves(depth, path)
    rows, shapes = _stepped(flex, moves, steered.roll, len(motion))
    added = np.zeros((len(motion), 3))
    if steered.identified:
        added = _in_tracker(steered, motion.depth, depth, rows["tip"][0])
    return SteeredRun(
        motion=motion,
        tip=rows["tip"] + added,
        force=rows["force"],
        wrench=rows["wrench"],
        shapes=tuple(_moved(shape, depth, added) for shape in shapes),
        layers=tuple(float(layer.top) for layer in flex.lateral),
        lost=(rows["status"] != 0) | ~np.isfinite(np.column_stack([rows["tip"], rows["wrench"]])).all(axis=1),
    )


def _in_tracker(model: SteeringModel, depth: np.ndarray, travel: np.ndarray, first: np.ndarray) -> np.ndarray:
    """What is added to the tips of the engine, (n, 3) [m]: axis in the tracker's frame, entry, common errors."""
    axis = np.array([model.values.get(f"axis_{across}", 0.0) for across in "xy"])
    error = model.predictor.common_error(PathReadings(np.zeros(1), sloped=False), np.maximum(depth, 0.0))
    across = np.outer(travel - travel[0], axis) - first[:2] + error
    return np.column_stack([across, depth - travel])


def _moved(shape: np.ndarray, travel: np.ndarray, added: np.ndarray) -> np.ndarray:
    """A shape in the frame of the tips; above the surface as at the surface."""
    return shape + np.column_stack([np.interp(shape[:, 2], travel, column) for column in added.T])


def _stepped(flex: FlexibleInsertion, moves, roll: float, steps: int) -> tuple[dict[str, np.ndarray], Sequence]:  # type: ignore[no-untyped-def]
    """Rows at the end of each step, and the shapes of some."""
    drawn = set(np.linspace(0, steps - 1, _SHAPES).astype(int)[1:])
    found: list[dict[str, np.ndarray]] = []
    shapes = []
    each = len(moves.depth) // steps
    for step in range(steps):
        part = slice(step * each, (step + 1) * each)
        rows = flex.run(moves.depth[part], moves.lateral[part], roll=moves.roll[part] + roll, dt=moves.dt[part])
        worst = rows["status"].max()
        found.append({name: values[-1] for name, values in rows.items()} | {"status": worst})
        if step in drawn:
            shapes.append(flex.shape())
    return {name: np.array([row[name] for row in found]) for name in found[0]}, shapes
