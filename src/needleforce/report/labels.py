# SPDX-License-Identifier: Apache-2.0
"""Labels next to what they name, where they cover the least."""

import numpy as np

from .canvas import TEXT

_REACHES = (5.0, 10.0, 20.0, 40.0)  # points from a label to its point; further off where near places are taken
_SIDES = ((1, 1), (1, -1), (-1, 1), (-1, -1), (1, 0), (-1, 0), (0, 1), (0, -1))
_CELL = 2.0  # points: side of the squares in which covered ground is counted


class Labels:
    """Writes into ``axes``, whose limits are final; ``curves`` are (x, y) in data units, not to be written over."""

    def __init__(self, axes, curves):
        self.axes = axes
        self.taken = np.zeros(np.ceil(np.array(axes.figure.bbox.size) / _CELL).astype(int) + 1, bool)
        for curve in curves:
            self._take(self._along(*curve))

    def at(self, text: str, x: float, y: float, colour: str, size: float = TEXT) -> None:
        """Names the point (x, y)."""
        self._write(text, self.axes.transData.transform([(x, y)]), colour, size)

    def on(self, text: str, x, y, colour: str, size: float = TEXT) -> None:
        """Names the curve (x, y), somewhere along it."""
        points = self._along(np.asarray(x, float), np.asarray(y, float))
        if len(points):
            points = points[:: max(len(points) // 40, 1)]
            middle = np.argsort(np.abs(np.arange(len(points)) - 0.55 * len(points)), kind="stable")
            self._write(text, points[middle], colour, size)

    def _write(self, text: str, points: np.ndarray, colour: str, size: float) -> None:
        size_of_text = 0.56 * size * max(map(len, text.split("\n"))), 1.2 * size * (1 + text.count("\n"))
        boxes = _boxes(points, *size_of_text)
        distance = np.repeat(_REACHES, len(boxes) // len(_REACHES))
        box = boxes[np.argmin(self._cost(boxes) + 0.5 * distance)]
        place = self.axes.transData.inverted().transform(box[:2])
        self.axes.annotate(text, place, color=colour, fontsize=size, va="bottom", ha="left", annotation_clip=False)
        xs, ys = np.meshgrid(np.arange(box[0], box[2], _CELL), np.arange(box[1], box[3], _CELL))
        self._take(np.column_stack([xs.ravel(), ys.ravel()]))

    def _cost(self, boxes: np.ndarray) -> np.ndarray:
        """How many squares each box would cover; what stands outside the axes costs most."""
        frame = self.axes.bbox.padded(-2.0)
        outside = np.maximum(np.hstack([frame.min - boxes[:, :2], boxes[:, 2:] - frame.max]), 0.0).sum(axis=1)
        total = np.pad(self.taken.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
        cells = np.clip(np.round(boxes / _CELL).astype(int), 0, np.tile(self.taken.shape, 2))
        left, bottom, right, top = cells.T
        covered = total[right, top] - total[left, top] - total[right, bottom] + total[left, bottom]
        return 50.0 * outside + covered

    def _take(self, points: np.ndarray) -> None:
        cells = np.round(points / _CELL).astype(int)
        inside = ((cells >= 0) & (cells < self.taken.shape)).all(axis=1)
        self.taken[tuple(cells[inside].T)] = True

    def _along(self, x, y) -> np.ndarray:
        """The curve in points of the page, one every two points of its length, without what is not finite."""
        points = self.axes.transData.transform(np.column_stack([x, y]))
        points = points[np.isfinite(points).all(axis=1)]
        if len(points) < 2:
            return points
        length = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))))
        at = np.arange(0.0, length[-1], max(_CELL, length[-1] / 20000))
        return np.column_stack([np.interp(at, length, points[:, 0]), np.interp(at, length, points[:, 1])])


def _boxes(points: np.ndarray, width: float, height: float) -> np.ndarray:
    """Every place offered (m, 4), the best first: left, bottom, right, top."""
    size = np.array([width, height])
    sides = np.array(_SIDES)
    corners = np.concatenate([points + reach * side - size * (1 - side) / 2 for reach in _REACHES for side in sides])
    return np.hstack([corners, corners + size])
