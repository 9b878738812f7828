# SPDX-License-Identifier: Apache-2.0
"""One insertion with every law of a family, the paper's model behind each in grey."""

import needleforce as nf
from needleforce.models.laws import laws_of

from .figure import DEPTH, FIRST, FORCE, PAPER, TIME, axis_names, curve, drawing, row
from .runs import SLOW, cycle
from .typical import around, example

COLUMNS = 3


def comparison(family: str) -> str:
    """Every law of a family in one insertion, as HTML: small drawings on one scale."""
    laws, rows = [example(law).law for law in laws_of(family)], -(-len(laws_of(family)) // COLUMNS)
    over = TIME if family == "relaxation" else DEPTH  # the depth is constant in a hold
    heights = (60.0 + 170.0 * rows, 60.0 + 190.0 * len(laws))
    alt = f"Force of one insertion with each law for {family}: {', '.join(law.name for law in laws)}"
    return drawing(f"all-{family}", lambda figure, sheet: _each(figure, sheet, laws, over), heights, alt)


def _each(figure, sheet, laws, over: str) -> None:
    paper, several = cycle(nf.preset("paper"), SLOW, hold=5.0), row(figure, sheet, len(laws), COLUMNS)
    done = [cycle(around(law), SLOW, hold=5.0) for law in laws]
    low, high = min(one.force.min() for one in (paper, *done)), max(one.force.max() for one in (paper, *done))
    for axes, law, one in zip(several, laws, done):
        for drawn, colour, width in ((paper, PAPER, 2.4), (one, FIRST, 1.1)):
            curve(axes, drawn.time if over == TIME else drawn.depth, drawn.force, colour, width)
        axes.axhline(0.0, color="#9a9a9a", lw=0.7)
        axes.set_ylim(low - 0.05 * (high - low), high + 0.05 * (high - low))
        axis_names(axes, over, f"{law.name}, {FORCE}")
