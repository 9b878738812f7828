# SPDX-License-Identifier: Apache-2.0
"""Whether tip and base were recorded in the same frame: a needle of circular section responds equally in each
direction."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..errors import InputError
from .tip_paths import TipPath

MIN_STEPS = 12  # in which the base moved
SIGNIFICANT = 5.0  # standard errors; one false alarm in more than 100 000 insertions of such a needle
MAX_ANGLE = np.radians(30.0)
_ANSWER_LENGTH = 0.03  # [m] of depth over which the answer of the tip falls


class Response(NamedTuple):
    """Response of the tip to the base: size and direction of the part that is a turn, size of the part that is a mirror
    image, and the standard error of both, in slope or length per length."""

    turned: float
    angle: float
    mirrored: float
    error: float


def check_frame(insertions: Sequence[TipPath]) -> None:
    """Refuse tip paths whose frame is mirrored or turned against that of the base.

    Parameters
    ----------
    insertions : sequence of TipPath
        Those whose base moved in both directions are judged, together.

    Raises
    ------
    InputError
        If the tip responds to the base as a mirror image, or turned about the axis by more than 30 degrees.

    Notes
    -----
    In each step the change of the tip's slope (of its position, where no slope was measured) is a linear function of
    the motion of the base in this step and in the next one, which a reading may have seen. A needle of round section in
    even tissue has the same answer in each direction, a x 1, with any sign: a guide may turn the needle about its
    entry. A mirrored frame has a x diag(1, -1), a turned one a x R(angle).
    """
    found = response(insertions)
    if found is None:
        return
    if found.mirrored - found.turned > SIGNIFICANT * found.error:
        sizes = f"{found.mirrored:.3g} against {found.turned:.3g}"
        step = "Change the sign of one column of the base, or exchange the two."
        raise InputError("frame of the base", "a mirror image of that of the tip", sizes, next_step=step)
    off = abs(np.angle(np.exp(2j * found.angle))) / 2.0
    if off > MAX_ANGLE and found.turned * np.sin(off - MAX_ANGLE) > SIGNIFICANT * found.error:
        turned = f"turned by {np.degrees(off):.0f} degrees against that of the tip"
        step = "Turn the columns of the base into the frame of the tip."
        raise InputError("frame of the base", turned, "30 are allowed", next_step=step)


def response(insertions: Sequence[TipPath]) -> Response | None:
    """Response of the tip to the base, or None where the base did not move enough in both directions."""
    rows = [_steps(path) for path in insertions if path.steered and len(path) > 3]
    if not rows:
        return None
    moves, responses = (np.vstack(parts) for parts in zip(*rows))
    if np.sum(np.any(moves != 0.0, axis=1)) < MIN_STEPS or np.linalg.matrix_rank(moves[:, :2], tol=1e-6) < 2:
        return None
    columns = np.column_stack([moves, np.ones(len(moves))])
    found, *_ = np.linalg.lstsq(columns, responses, rcond=None)
    left = responses - columns @ found
    freedom = max(1, len(columns) - columns.shape[1])
    scatter = np.sqrt(np.sum(left**2) / (2.0 * freedom))
    errors = scatter * np.sqrt(np.diag(np.linalg.pinv(columns.T @ columns)))
    first = max((0, 2), key=lambda k: np.linalg.norm(found[k : k + 2]))  # this step's motion, or the next one's
    matrix, error = found[first : first + 2].T, float(np.linalg.norm(errors[first : first + 2]) / np.sqrt(2.0))
    turn = 0.5 * complex(matrix[0, 0] + matrix[1, 1], matrix[1, 0] - matrix[0, 1])
    mirror = 0.5 * complex(matrix[0, 0] - matrix[1, 1], matrix[0, 1] + matrix[1, 0])
    return Response(abs(turn), float(np.angle(turn)), abs(mirror), error)


def _steps(path: TipPath) -> tuple[np.ndarray, np.ndarray]:
    """Motion of the base in each step and in the next one (n, 4), and what the tip does (n, 2)."""
    rows = path.compared
    base, depth = path.base[rows], path.depth[rows]
    moved = np.diff(base, axis=0) * np.exp(-np.maximum(depth[1:], 0.0) / _ANSWER_LENGTH)[:, None]
    answer = path.tip[rows, :2] if path.slope is None else path.slope[rows]
    return np.hstack([moved, np.vstack([moved[1:], np.zeros((1, 2))])]), np.diff(answer, axis=0)
