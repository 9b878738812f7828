# SPDX-License-Identifier: Apache-2.0
"""Tissue, tip and guide from tip paths in one frame with the base: least squares with priors, whatever the mechanics
leave unexplained aside."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .. import core
from ..checks import one_of
from ..errors import InputError
from .path_errors import PathErrors
from .path_prediction import readings_of, residuals_of
from .path_simulation import simulated_path
from .result import SteeringResult
from .simple_predictors import SIMPLE
from .steering_model import identified_model
from .steering_parameters import MODELS, Progress, held_at, search, within_reach
from .tip_paths import TipPath
from .tissue_prior import TissuePrior

if TYPE_CHECKING:
    from ..display.page import Figure

MIN_STEPS = 12  # in which the base moved
SIGNIFICANT = 5.0  # standard errors; one false alarm in more than 100 000 insertions of such a needle
MAX_ANGLE = np.radians(30.0)
_ANSWER_LENGTH = 0.03  # [m] of depth over which the answer of the tip falls


@dataclass(frozen=True, repr=False)
class SteeringFit(SteeringResult):
    """A needle identified from tip paths; ``rms`` is the lateral error of each insertion's prediction from its entry
    [m], while it is in the fit, and ``contradicted`` by how many standard deviations, more than two, parameters lie
    outside a given prior."""

    contradicted: dict[str, float] = field(default_factory=dict)

    def predict(self, path: TipPath, by: str = "prediction") -> np.ndarray:
        """The tip for the base's motion of an insertion, whose pose is taken from its rows before the base moves.

        Parameters
        ----------
        path : TipPath
            Its base and depth are used, and of its tip the ``entry_rows`` alone.
        by : str
            ``"prediction"``: the mechanics and a regression on the motion of the base, weighted by their errors in
            left-out insertions; ``"mechanics"``, ``"regression"``, ``"bicycle"`` or ``"unicycle"`` alone.

        Returns
        -------
        ndarray, shape (n, 3)
            Position of the tip [m].
        """
        return self.model.predictor.tip(path, by)

    def uncertainty(self, path: TipPath) -> np.ndarray:
        """Standard deviation of ``predict`` in each lateral direction, (n,) [m]: of the parameters, the pose and what
        the mechanics leave unexplained."""
        return self.model.predictor.uncertainty(path)

    def by_insertion(self) -> dict[str, dict[str, Any]]:
        """Insertion -> lateral error in the fit and left out of it [m]."""
        left_out = self.left_out
        return {
            name: {"rms_m": value, "left_out_rms_m": left_out.get(name, math.nan)} for name, value in self.rms.items()
        }

    def _tip_figures(self) -> "Sequence[Figure]":
        from .figures import tips

        return [tips([(path, self.predict(path)) for path in self.model.predictor.insertions])]

    @property
    def left_out(self) -> dict[str, float]:
        """Insertion -> root mean square lateral error of its prediction when it is left out of the fit [m]; linear in
        the parameters. Empty for one insertion."""
        predictor = self.model.predictor
        return {name: each.rms("prediction", predictor.weight_in(each)) for name, each in predictor.left_out.items()}

    @property
    def compared(self) -> dict[str, float]:
        """Predictor -> lateral error of left-out insertions [m], the median of their root mean squares: of the steered
        ones, or of all if none is. Empty for one insertion."""
        predictor = self.model.predictor
        names = ("prediction", "mechanics", *SIMPLE) if predictor.left_out else ()
        judged = [(each, predictor.weight_in(each)) for each in predictor.judged]
        return {by: float(np.median([each.rms(by, weight) for each, weight in judged])) for by in names}

    def remarks(self) -> list[str]:
        """What a reader should know of the intervals, and how well simple models predict."""
        predictor = self.model.predictor
        doubts = [f"{path.name}: {doubt}" for path in predictor.insertions for doubt in path.doubts]
        if self.contradicted:
            off = ", ".join(f"{name} by {each:.1f}" for name, each in self.contradicted.items())
            doubts.append(f"the data contradict the prior, which is widened there; standard deviations: {off}")
        return [*doubts, *super().remarks(), *self._comparison()]

    def _comparison(self) -> list[str]:
        if not (compared := self.compared):
            return []
        predictor, best = self.model.predictor, min(SIMPLE, key=lambda by: compared[by])
        sizes = ", ".join(f"{by} {1e3 * error:.2f}" for by, error in compared.items())
        line = f"error of left-out insertions in mm: {sizes}"
        if not predictor.compares:
            return [f"{line}; with less than two steered ones, expected errors weigh mechanics and regression"]
        share = compared["prediction"] / compared[best]
        line += f"; the mechanics have a weight of {predictor.weight:.0%}"
        line += f", and the error is {share:.0%} of that of the best simple predictor, the {best}"
        # in each: of two insertions, the median alone is often lower by chance
        if all(each.rms(best) <= each.rms("prediction", predictor.weight) for each in predictor.judged):
            line += f". The {best} predicts them as well: take predict(path, by='{best}')"
        return [line]


def identify_paths(
    insertions: Sequence[TipPath],
    needle: core.Needle,
    *,
    model: str = "yielding",
    held: str = "guide",
    prior: TissuePrior | None = None,
    progress: Progress | None = None,
) -> SteeringFit:
    """Identify tissue, tip and guide from tip paths: ``nf.steering.identify`` for ``TipPath``.

    The bending stiffness of the needle scales all forces and stiffnesses: tip paths alone give their ratios to it.
    ``model`` is a ``"linear"`` foundation, or ``"yielding"``: tissue that the shaft pushes aside beyond a force per
    length. ``prior`` is that of ``nf.steering.prior``. Raises InputError if the model is unknown, the prior is not of
    its parameters, there is no insertion, the tip is not tracked for three rows, or it was recorded in another frame
    than the base.
    """
    one_of("model", model, MODELS)
    if not insertions or any(len(path) < 3 for path in insertions):
        limit = "needed with a tip in at least three rows each"
        raise InputError("insertions", len(insertions), limit, next_step="Give nf.steering.read(file).")
    check_frame(insertions)
    parameters = within_reach(held_at(MODELS[model], held), needle.length, insertions)
    if prior and prior.names != tuple(parameter.name for parameter in parameters):
        given = f"{len(prior.names)} parameters of the {prior.form} model"
        step = "Make it of fits with the same model and held."
        raise InputError("prior", given, f"others than those of {model} with held={held!r}", next_step=step)
    errors = PathErrors([readings_of(path) for path in insertions])

    def misfit(values: dict[str, float]) -> np.ndarray:
        parts = [residuals_of(simulated_path(values, path, needle=needle), path) for path in insertions]
        return errors.whitened(parts).ravel()

    found, against = search(parameters, misfit, progress), dict[str, float]()
    if prior:
        against, prior = prior.contradicted(found.spread), prior.widened(found.spread)
        # from the mean of the prior, as what was found is often on a flat stretch; but not if the mean is far off
        found = search(parameters, misfit, progress, prior.spread, found.spread.mean if against else None)
    fitted = identified_model(
        model,
        needle,
        found.values,
        parameters=parameters,
        covariance=found.spread.covariance,
        insertions=tuple(insertions),
        prior=prior,
    )
    rms = {path.name: fitted.predictor.rms(path) for path in insertions}
    return SteeringFit(fitted, found.estimates, found.trade_offs, rms, contradicted=against)


class Response(NamedTuple):
    """Response of the tip to the base: size and direction of the part that is a turn, size of the part that is a mirror
    image, and the standard error of both, in slope or length per length."""

    turned: float
    angle: float
    mirrored: float
    error: float


def check_frame(insertions: Sequence[TipPath]) -> None:
    """Raise InputError for tip paths whose frame is a mirror image of that of the base, or turned about the axis by
    more than 30 degrees. Insertions whose base moved in both directions are judged, together.

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
