# SPDX-License-Identifier: Apache-2.0
"""Drawings as inline SVG: one for a wide page and for print, one for a narrow screen, both with readable text.

matplotlib is loaded when something is drawn.
"""

import io
import re
import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from ..errors import InputError
from ..files import atomic_write
from .markup import Markup, element, join

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# measured light (its labels darker, in slate), model dark and thicker: they differ in a greyscale print, too
INK, QUIET, MEASURED, SLATE = "#222222", "#6d7278", "#88929b", "#566069"
MODEL, SECOND = "#c64f00", "#0072b2"
TINTS = {"deformation": "#e3eef7", "insertion": "#f6f5f1", "hold": "#fdf3dc", "extraction": "#e6f3ee"}
THIN, MEDIUM, THICK = 0.9, 1.2, 1.7
TEXT = 9.0  # points; 12 px at the scale of the page

_STYLE = {
    "svg.fonttype": "none", "text.parse_math": False, "font.size": TEXT, "axes.titlesize": TEXT, "axes.labelsize": TEXT,
    "axes.spines.top": False, "axes.spines.right": False, "axes.edgecolor": "#9a9a9a", "axes.linewidth": 0.7,
    "axes.grid": True, "axes.grid.axis": "y", "grid.color": "#e8e8e6", "grid.linewidth": 0.7, "axes.axisbelow": True,
    "xtick.color": "#9a9a9a", "ytick.color": "#9a9a9a", "xtick.labelcolor": INK, "ytick.labelcolor": INK,
    "xtick.labelsize": TEXT - 0.5, "ytick.labelsize": TEXT - 0.5, "xtick.major.size": 3, "ytick.major.size": 0,
    "axes.labelcolor": INK, "text.color": INK, "axes.facecolor": "none", "figure.facecolor": "none",
    "lines.solid_capstyle": "round", "lines.solid_joinstyle": "round", "axes.unicode_minus": True,
}  # fmt: skip
_MARGINS = {"left": 40.0, "right": 8.0, "top": 22.0, "bottom": 36.0, "across": 52.0, "down": 62.0}  # points
_NO_METADATA = dict.fromkeys(("Creator", "Date", "Format", "Type"))
_REACHES = (5.0, 10.0, 20.0, 40.0)  # points from a label to its point; the larger ones if near places are occupied
_SIDES = ((1, 1), (1, -1), (-1, 1), (-1, -1), (1, 0), (-1, 0), (0, 1), (0, -1))
ON_WHITE = {"boxstyle": "square,pad=0.15", "fc": "white", "ec": "none"}  # of a label that a line would cross
FORMATS = ("svg", "png", "pdf")
"""Endings of a figure in a file of its own."""
_CELL = 2.0  # points: side of the squares in which occupied area is counted


@dataclass(frozen=True)
class Sheet:
    """The size of a drawing: its width in points, and whether it is for a narrow screen."""

    width: float
    narrow: bool = False

    @property
    def columns(self) -> int:
        """Columns to which the curves of a full-width panel are reduced; more would not be distinguishable."""
        return int(0.6 * self.width)


FULL, WITH_SIDE_CAPTION, NARROW = Sheet(640.0), Sheet(390.0), Sheet(262.0, narrow=True)


def drawing(
    name: str, draw: Callable, heights: tuple[float, float], alt: str, wide: Sheet = FULL, touch: bool = True
) -> Markup:
    """``draw(figure, sheet)`` on a wide and a narrow sheet of ``heights`` [points]; the page shows one of the two."""
    sheets = zip(("wide", "narrow"), (wide, NARROW), heights)
    both = ((kind, svg(name, draw, sheet, height, alt, touch=touch)) for kind, sheet, height in sheets)
    return join(element("div", each, class_=kind) for kind, each in both)


def panels(
    figure: "Figure", sheet: Sheet, rows: int = 1, columns: int = 1, margins: dict | None = None, **options: Any
) -> np.ndarray:
    """Axes (rows, columns) with margins in points, independent of fonts and of the digits of tick labels."""
    height = 72.0 * figure.get_figheight()
    m = _MARGINS | (margins or {})
    wide, high = sheet.width - m["left"] - m["right"], height - m["top"] - m["bottom"]
    grid = {
        "left": m["left"] / sheet.width, "right": 1 - m["right"] / sheet.width,
        "bottom": m["bottom"] / height, "top": 1 - m["top"] / height,
        "wspace": m["across"] * columns / (wide - m["across"] * (columns - 1)),
        "hspace": m["down"] * rows / (high - m["down"] * (rows - 1)),
    }  # fmt: skip
    return figure.subplots(rows, columns, gridspec_kw=grid, squeeze=False, **options)


def axis_names(axes: "Axes", x: str, y: str) -> None:
    """Quantity and unit of both axes; that of the vertical axis is horizontal text above it."""
    axes.set_xlabel(x, loc="right")
    axes.set_label(y)  # under it the page shows values
    axes.annotate(y, (0.0, 1.0), (-32.0, 8.0), xycoords="axes fraction", textcoords="offset points", va="bottom")


def save_drawing(path: Path, draw: Callable, height: float) -> None:
    """``draw(figure, sheet)`` as a file of its own of ``height`` [points], in the format of its ending.

    Raises InputError for an ending that is no format of a figure.
    """
    kind = path.suffix.removeprefix(".").lower()
    if kind not in FORMATS:
        raise InputError("figure", path.name, f"known endings are {', '.join(FORMATS)}", next_step="Give one of them.")
    style = {"svg.hashsalt": path.stem, "svg.fonttype": "path", "figure.facecolor": "white"}
    metadata = {"Date": None} if kind == "svg" else None
    with atomic_write(path) as file:
        _save(draw, FULL, height, style, file.buffer, format=kind, dpi=216, metadata=metadata)


def svg(name: str, draw: Callable, sheet: Sheet, height: float, alt: str, touch: bool = True) -> Markup:
    """One drawing as an ``svg`` element, the same for the same input; with ``touch`` it is one for ``touch.js``."""
    # the salt makes the names of clip paths unique: two drawings of one page must not share them
    # a curve keeps its points for touch.js: they are the values that the page shows
    style, text = {"svg.hashsalt": f"{name}-{sheet.width:g}", "path.simplify": not touch}, io.BytesIO()
    drawn = partial(_touchable, draw) if touch else draw
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph")  # the browser's fonts draw the text, not matplotlib's
        _save(drawn, sheet, height, style, text, format="svg", metadata=_NO_METADATA)
    return _inline(text.getvalue().decode(), sheet, height, alt)


def _save(draw: Callable, sheet: Sheet, height: float, style: dict, file: BinaryIO, **options: Any) -> None:
    """Draw a figure of the sheet's width and ``height`` [points] in our style, and save it."""
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context(_STYLE | style):
        figure = Figure(figsize=(sheet.width / 72.0, height / 72.0), dpi=72)
        draw(figure, sheet)
        figure.savefig(file, **options)


def _touchable(draw: Callable, figure: "Figure", sheet: Sheet) -> None:
    """Draw, and name for ``touch.js`` the panels with quantities on both axes, their curves, ticks and labels.

    The values are not written twice: box and limits of a panel give them from the points of its curves.
    """
    draw(figure, sheet)
    for axes in figure.axes:
        together = axes.get_shared_x_axes().get_siblings(axes)
        x, y = next((each.get_xlabel() for each in together if each.get_xlabel()), ""), axes.get_label()
        if not x or not y:
            continue
        box, height = axes.bbox, figure.bbox.height
        edges = box.x0, height - box.y1, box.x1, height - box.y0
        limits = *axes.get_xlim(), *axes.get_ylim()
        numbers = (" ".join(f"{value:.7g}" for value in each) for each in (edges, limits))
        axes.set_gid(f"data-panel={'|'.join((*numbers, x, y))}")
        for curve in axes.lines:
            if curve.get_transform() == axes.transData:
                curve.set_gid(f"data-curve={curve.get_label() if curve.get_label()[0] != '_' else ''}")
        for tick in (*axes.xaxis.get_major_ticks(), *axes.yaxis.get_major_ticks()):
            tick.set_gid("data-ticks=")
        for label in axes.texts:
            follows = (True, True)
            if label.xycoords != "data":
                follows = getattr(label.xycoords, "contains_branch_seperately", lambda _: ())(axes.transData)
            label.set_gid(f"data-label={''.join(name for name, each in zip('xy', follows) if each)}")


def _inline(text: str, sheet: Sheet, height: float, alt: str) -> Markup:
    """The drawing's content in a new ``svg`` element, without prologue, name spaces, styles and names of groups."""
    content = text[text.index(">", text.index("<svg")) + 1 :]
    content = re.sub(r"<metadata>.*?</metadata>|<style.*?</style>", "", content, flags=re.DOTALL)
    content = re.sub(r'<g id="(data-\w+)=([^"]*)"', r'<g \1="\2"', content)
    content = re.sub(r'<g id="[^"]*"', "<g", content)
    content = re.sub(r'(<text [^>]*?) ?font-family: [^;"]*;?', r"\1", content)  # the page's fonts
    content = re.sub(r' transform="rotate\(-?0 [^"]*"', "", content)
    content = re.sub(r' d="([^"]*)"', lambda path: f' d="{_short(path[1])}"', content)
    view = f"0 0 {sheet.width:g} {height:g}"
    opening = Markup('<svg viewBox="{}" role="img" aria-label="{}">').format(view, alt)
    return opening + Markup(re.sub(r">\s+<", "><", content.strip()))


def _short(path: str) -> str:
    """A path rounded to hundredths of a point, finer than print, without superfluous white space."""
    path = re.sub(r"-?\d+\.\d+", lambda number: f"{float(number[0]):.2f}".rstrip("0").rstrip("."), path)
    return re.sub(r"([A-Zz]) ", r"\1", " ".join(path.split()))


class Labels:
    """Labels in ``axes`` that avoid each other and the ``curves`` (x, y), in data units; the limits become final."""

    def __init__(self, axes: "Axes", curves: Iterable[tuple[np.ndarray, np.ndarray]]):
        self.axes = axes
        axes.autoscale_view()  # places are computed from the final limits
        self.taken = np.zeros(np.ceil(np.array(axes.figure.bbox.size) / _CELL).astype(int) + 1, bool)
        for curve in curves:
            self._take(self._along(*curve))

    def at(self, text: str, x: float, y: float, colour: str, size: float = TEXT) -> None:
        """Label the point (x, y)."""
        self._write(text, self.axes.transData.transform([(x, y)]), colour, size)

    def on(self, text: str, x: np.ndarray, y: np.ndarray, colour: str, size: float = TEXT) -> None:
        """Label the curve (x, y), at the best place along it."""
        for curve in self.axes.lines:
            if curve.get_label().startswith("_") and np.array_equal(curve.get_xydata(), np.column_stack([x, y]), True):
                curve.set_label(text)
        points = self._along(np.asarray(x, float), np.asarray(y, float))
        if len(points):
            points = points[:: max(len(points) // 40, 1)]
            middle = np.argsort(np.abs(np.arange(len(points)) - 0.55 * len(points)), kind="stable")
            self._write(text, points[middle], colour, size)

    def _write(self, text: str, points: np.ndarray, colour: str, size: float) -> None:
        """Write the text at the place with the lowest cost near one of ``points``."""
        size_of_text = 0.56 * size * max(map(len, text.split("\n"))), 1.2 * size * (1 + text.count("\n"))
        boxes = _boxes(points, *size_of_text)
        distance = np.repeat(_REACHES, len(boxes) // len(_REACHES))
        box = boxes[np.argmin(self._cost(boxes) + 0.5 * distance)]
        place = self.axes.transData.inverted().transform(box[:2])
        self.axes.annotate(text, place, color=colour, fontsize=size, va="bottom", ha="left", annotation_clip=False)
        xs, ys = np.meshgrid(np.arange(box[0], box[2], _CELL), np.arange(box[1], box[3], _CELL))
        self._take(np.column_stack([xs.ravel(), ys.ravel()]))

    def _cost(self, boxes: np.ndarray) -> np.ndarray:
        """Cost of each box: the occupied squares that it covers, and a larger cost outside the axes."""
        frame = self.axes.bbox.padded(-2.0)
        outside = np.maximum(np.hstack([frame.min - boxes[:, :2], boxes[:, 2:] - frame.max]), 0.0).sum(axis=1)
        total = np.pad(self.taken.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
        cells = np.clip(np.round(boxes / _CELL).astype(int), 0, np.tile(self.taken.shape, 2))
        left, bottom, right, top = cells.T
        covered = total[right, top] - total[left, top] - total[right, bottom] + total[left, bottom]
        return 50.0 * outside + covered

    def _take(self, points: np.ndarray) -> None:
        """Mark the squares at ``points`` as occupied."""
        cells = np.round(points / _CELL).astype(int)
        inside = ((cells >= 0) & (cells < self.taken.shape)).all(axis=1)
        self.taken[tuple(cells[inside].T)] = True

    def _along(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """The curve in page coordinates, a point every two points of its length, without values that are not finite."""
        points = self.axes.transData.transform(np.column_stack([x, y]))
        points = points[np.isfinite(points).all(axis=1)]
        if len(points) < 2:
            return points
        length = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))))
        at = np.arange(0.0, length[-1], max(_CELL, length[-1] / 20000))
        return np.column_stack([np.interp(at, length, points[:, 0]), np.interp(at, length, points[:, 1])])


def _boxes(points: np.ndarray, width: float, height: float) -> np.ndarray:
    """Candidate places (m, 4) of a label, the best first: left, bottom, right, top."""
    size = np.array([width, height])
    sides = np.array(_SIDES)
    corners = np.concatenate([points + reach * side - size * (1 - side) / 2 for reach in _REACHES for side in sides])
    return np.hstack([corners, corners + size])


def line(
    axes: "Axes", x: np.ndarray, y: np.ndarray, columns: int, shift: float = 0.0, **style: Any
) -> tuple[np.ndarray, np.ndarray]:
    """Draw (x, y) reduced to about 4 points per column; returns the points drawn."""
    x, y = envelope(np.asarray(x), np.asarray(y), columns, shift)
    axes.plot(x, y, **style)
    return x, y


def envelope(x: np.ndarray, y: np.ndarray, columns: int, shift: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """``x``, ``y`` (n,) reduced to 4 points per column: the first, lowest, highest and last ``y``, in their order.

    Columns have equal travel of x, forward and backward, so a peak or a drop of a single sample is always kept.
    ``shift`` (share of a column) offsets the columns, so that overlaid curves do not have the same ones.
    """
    if len(x) <= 4 * columns:
        return x, y
    travel = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(x)))))
    edges = np.searchsorted(travel, (np.arange(columns) + 1.0 - shift % 1.0) * travel[-1] / columns)
    edges = np.unique(np.concatenate(([0], np.minimum(edges, len(x) - 1), [len(x)])))
    keep = np.unique([k for first, last in pairwise(edges) for k in _extremes(y, first, last)])
    return x[keep], y[keep]


def _extremes(y: np.ndarray, first: int, last: int) -> tuple[int, int, int, int]:
    """Indices of the first, lowest, highest and last value of ``y[first:last]``."""
    part = y[first:last]
    return first, first + int(np.argmin(part)), first + int(np.argmax(part)), last - 1


def columns_for(lines: int, width: float) -> int:
    """Columns of each of ``lines`` curves in a drawing ``width`` points wide, so that the file stays small."""
    return int(np.clip(1600 // max(lines, 1), 60, width))
