# SPDX-License-Identifier: Apache-2.0
"""Insertions into stacks of layers, each a preset file in the folder ``stacks``."""

from pathlib import Path

import needleforce as nf

from .figure import DEPTH, FIRST, FORCE, OTHER, PAPER, TIME, axis_names, curve, drawing, key, row
from .runs import SPEED, Run, run

STACKS = sorted((Path(__file__).parent / "stacks").glob("*.toml"), reverse=True)
STACK_DEPTH, STACK_HOLD = 20e-3, 5.0
PARTS = {"stiffness": OTHER, "friction": FIRST, "cutting": PAPER}


def figure(path: Path) -> str:
    """Force over depth and its parts over time of one stack, as HTML."""
    model = nf.preset(str(path))
    done = run(model, (STACK_DEPTH, SPEED), (STACK_DEPTH, STACK_HOLD), (-1e-3, SPEED))
    alt = f"Force and its parts in an insertion into layers: {model.summary}"
    return drawing(path.stem, lambda figure, sheet: _draw(figure, sheet, model, done), (480.0, 560.0), alt)


def _draw(figure, sheet, model, done: Run) -> None:
    top, bottom = row(figure, sheet, 2, 1)
    curve(top, done.depth, done.force)
    for layer in model.layers:
        top.axvline(1e3 * layer.top, color=PAPER, lw=0.9, ls=(0, (4, 3)))
    for part, colour in PARTS.items():
        curve(bottom, done.time, done.parts[part], colour)
    axis_names(top, DEPTH, FORCE)
    axis_names(bottom, TIME, f"parts of the {FORCE}")
    key(bottom, PARTS)
