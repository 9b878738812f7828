# SPDX-License-Identifier: Apache-2.0
"""Figures in the report's style, in colours that follow the page's light or dark theme."""

from needleforce.display import canvas
from needleforce.display.canvas import INK, MEASURED, MODEL, QUIET, SECOND, axis_names, line, panels

__all__ = ["DEPTH", "FIRST", "FORCE", "OTHER", "PAPER", "SPEED", "TIME", "axis_names", "curve", "drawing", "key", "row"]

FIRST, OTHER, PAPER = MODEL, SECOND, MEASURED
DEPTH, TIME, SPEED, FORCE = "depth [mm]", "time [s]", "velocity [mm/s]", "force [N]"
_THEMED = {
    INK: "var(--color-foreground-primary)", QUIET: "var(--color-foreground-muted)",
    "#9a9a9a": "var(--color-foreground-border)", "#e8e8e6": "var(--color-background-border)",
    FIRST: "var(--curve-first)", OTHER: "var(--curve-other)", PAPER: "var(--curve-paper)",
}  # fmt: skip


def drawing(name: str, draw, heights: tuple[float, float], alt: str) -> str:
    """``draw(figure, sheet)`` as HTML, wide and narrow, ``heights`` high [points]."""
    markup = str(canvas.drawing(name, draw, heights, alt, touch=False))
    for colour, variable in _THEMED.items():
        markup = markup.replace(colour, variable)
    return f'<div class="drawing">{markup}</div>\n'


def row(figure, sheet, count: int, columns: int | None = None):
    """``count`` axes: side by side on a wide sheet, below each other on a narrow one."""
    columns = 1 if sheet.narrow else columns or count
    rows = -(-count // columns)
    axes = panels(figure, sheet, rows, columns).ravel()
    for spare in axes[count:]:
        spare.set_axis_off()
    return axes[:count]


def curve(axes, x, y, colour=FIRST, width: float = 1.5):
    """Draws a curve with at most 400 points; returns the line."""
    return line(axes, x, y, 400, color=colour, lw=width)


def key(axes, colours: dict[str, str]) -> None:
    """The names of the curves in their colours, above the axes."""
    for k, (name, colour) in enumerate(reversed(colours.items())):
        axes.annotate(name, (1.0, 1.0), (-56.0 * k, 8.0), "axes fraction", "offset points", color=colour, ha="right")


def headroom(axes, share: float = 0.15) -> None:
    """Space above the curves for their names."""
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + share * (high - low))
