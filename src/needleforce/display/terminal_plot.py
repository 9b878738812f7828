# SPDX-License-Identifier: Apache-2.0
"""A curve drawn with characters, for a terminal without a window."""

import numpy as np

_DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))  # of a Braille character, by row and column
_BRAILLE = 0x2800


def terminal_plot(
    x: np.ndarray, y: np.ndarray, x_label: str, y_label: str, *, width: int = 64, height: int = 14
) -> str:
    """Draw (n,) ``y`` over ``x`` as dots, with the limits of both axes.

    Parameters
    ----------
    x, y : (n,) array
        Finite values.
    x_label, y_label : str
        Names with units.
    width, height : int
        Characters of the drawing.

    Returns
    -------
    str
        Lines of text.
    """
    if not len(x):
        return ""
    columns = _positions(x, 2 * width)
    rows = 4 * height - 1 - _positions(y, 4 * height)
    cells = np.zeros((height, width), int)
    for row, column in set(zip(rows.tolist(), columns.tolist(), strict=True)):
        cells[row // 4, column // 2] |= _DOTS[row % 4][column % 2]
    lines = ["".join(chr(_BRAILLE + cell) for cell in line) for line in cells]
    limits = [f"{y.max():.4g}", *[""] * (height - 2), f"{y.min():.4g}"]
    margin = max(map(len, limits))
    drawn = [f"{limit:>{margin}} ┤{line}" for limit, line in zip(limits, lines, strict=True)]
    ends = f"{x.min():.4g}", f"{x.max():.4g}"
    below = " " * (margin + 2) + ends[0] + x_label.center(width - len(ends[0]) - len(ends[1])) + ends[1]
    return "\n".join([" " * (margin + 2) + y_label, *drawn, below])


def _positions(values: np.ndarray, count: int) -> np.ndarray:
    """Indices from 0 to ``count - 1`` in proportion to the values."""
    span = float(np.ptp(values))
    return (
        np.rint((values - values.min()) / span * (count - 1)).astype(int) if span > 0.0 else np.zeros(len(values), int)
    )
