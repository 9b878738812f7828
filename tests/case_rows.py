# SPDX-License-Identifier: Apache-2.0
"""The conformance set through hosts that are stepped from Python: the cases, and what they write in two of them."""

import importlib.util
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent / "conformance"
CASES = sorted((HERE / "cases").glob("*.txt"))
_spec = importlib.util.spec_from_file_location("conformance_trace", HERE / "trace.py")
trace = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(trace)

# columns of a step: depth, velocity, force and its parts, lateral, two derivatives; then words
NUMBERS, FORCES = 9, slice(2, 7)


def steps(lines: list[str]) -> tuple[np.ndarray, list]:
    """Numbers (n, 9) of the steps, and the words of every line."""
    rows = [line.split() for line in lines if not line.startswith(("bent ", "point ", "tip ", "node "))]
    numbers = [row[:NUMBERS] for row in rows if len(row) > NUMBERS]
    return np.array(numbers, float).reshape(-1, NUMBERS), [row[NUMBERS:] or row for row in rows]


def units(numbers: np.ndarray) -> np.ndarray:
    """Scale of each column: its largest value; for the parts of the force, the largest force."""
    unit = np.abs(numbers).max(axis=0, initial=0.0)
    unit[FORCES] = unit[2]
    return unit


def rigid() -> list[Path]:
    """The cases without a solid and without a needle that bends."""
    texts = {path: path.read_text(encoding="utf-8").splitlines() for path in CASES}
    return [path for path, lines in texts.items() if not any(line.startswith(("solid ", "lateral ")) for line in lines)]
