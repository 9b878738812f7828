# SPDX-License-Identifier: Apache-2.0
"""A small table as CSV, never half-written."""

from pathlib import Path

import numpy as np

from ..files import atomic_write


def write_table(path: Path, columns: dict[str, np.ndarray], digits: int = 7) -> Path:
    """Write (n,) columns under their headers with so many significant digits; the same bytes for the same numbers."""
    rows = [",".join(f"{value:.{digits}g}" for value in row) for row in zip(*columns.values(), strict=True)]
    with atomic_write(path) as file:
        file.write("\n".join([",".join(columns), *rows, ""]))
    return path
