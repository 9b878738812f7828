# SPDX-License-Identifier: Apache-2.0
"""The exact posterior of one cycle: a grid over contact, saturation and puncture, times a Gaussian for the
coefficients, in O(1) from running sums."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..one_layer.cycle_values import CycleFit
from ..strokes import Strokes

MAX_LOG_RATIO = 20.0  # a point exp(-20) times as likely as the best one has no weight
N_CONTACTS, N_SATURATIONS = 97, 96  # nodes of the grid
GRID_HALF_WIDTH = 6.5  # [standard errors of the contact at a given saturation]
N_ROUNDS, NARROWING = 6, 8.0  # a search of 33 nodes, each time over an eighth of the range
MAX_NOISE_RATIO = 2.0  # of the two strokes; beyond, the fit, which weights all samples equally, is not the mode
MIN_NOISE_SHARE = 1e-4  # [of the peak force] smaller noise is lost in the rounding of running sums
MIN_LOADING_SAMPLES = 8
N, H, H2, H3, H4, F, FH, FH2, F2 = range(9)  # rows of RunningSums


def can_be_exact(fit: CycleFit) -> bool:
    """True for a complete fit whose noise is resolved by running sums and similar in both strokes, and the only error
    in its intervals."""
    noises = [noise.long_run for noise in fit.residuals.noises if noise.count]
    too_small = fit.residuals.rmse <= MIN_NOISE_SHARE * abs(fit.values["puncture_force"])
    return not (fit.by_stages or fit.causes or too_small) and max(noises) <= MAX_NOISE_RATIO * min(noises)


Grid = np.ndarray | float | int


class RunningSums:
    """Sums over any run of samples of a stroke: their number, h to h^4, and F, F h, F h^2, F^2.

    ``h`` (n,) is the depth below the fitted contact over the fitted indentation; past the contact it is the embedded
    length. ``force`` F is (n,) [N]; ``direction`` is +1 for an insertion, -1 for a withdrawal.
    """

    def __init__(self, h: np.ndarray, force: np.ndarray, direction: float):
        self.size, self.direction = len(h), direction
        self.farthest = np.maximum.accumulate(direction * h) if len(h) else h
        squared = h * h
        columns = (np.ones_like(h), h, squared, squared * h, squared * squared)
        columns += (force, force * h, force * squared, force * force)
        self.rows = np.zeros((9, len(h) + 1))
        np.cumsum(columns, axis=1, out=self.rows[:, 1:])

    def passing(self, h: Grid) -> np.ndarray:
        """Number of samples before the stroke first passes h."""
        return np.searchsorted(self.farthest, self.direction * h, side="right")

    def between(self, first: Grid, last: Grid) -> np.ndarray:
        """The sums (9, ...) over samples first to last - 1."""
        first, last = np.broadcast_arrays(first, last)
        return self.rows[:, last] - self.rows[:, first]


class Linear(NamedTuple):
    """For each contact, saturation and puncture: ``misfit``, the residual sum of squares over the variance, ``volume``,
    the logarithm of the Gaussian's volume, the means of c, f', f_c and the zero b, and their Gaussian as a chain: b;
    then c and f', which given b are independent; then f_c given b and f'. f_c has -1 by b."""

    misfit: np.ndarray
    volume: np.ndarray
    stiffness: np.ndarray
    friction: np.ndarray
    cutting: np.ndarray
    zero: np.ndarray
    stiffness_sd: np.ndarray
    friction_sd: np.ndarray
    cutting_sd: np.ndarray
    zero_sd: np.ndarray
    stiffness_by_zero: np.ndarray
    friction_by_zero: np.ndarray
    cutting_by_friction: np.ndarray

    @property
    def log_density(self) -> np.ndarray:
        """Logarithm of the posterior density of contact, saturation and puncture, up to a constant."""
        return self.volume - 0.5 * self.misfit


class CycleSums(NamedTuple):
    """Both strokes, the noise variance [N^2], and the samples left out on each side of a step."""

    insertion: RunningSums
    withdrawal: RunningSums
    variance: float
    left_out: int

    def linear(self, contact: Grid, saturation: Grid, puncture: Grid) -> Linear:
        """The coefficients for contacts, saturation depths and punctures, counted in samples before, of any shape."""
        z, saturation, puncture = np.broadcast_arrays(contact, saturation, puncture)
        g, gg, fg = self._loading(z, saturation, puncture - self.left_out)
        has_loading = gg > 0.0
        gg = np.where(has_loading, gg, 1.0)
        n, h, hh, f, fh, out_h = self._line(z, puncture + self.left_out)
        slope_weight, slope_force = hh - h * h / n, fh - h * f / n  # f_c eliminated
        count, force = self._level(puncture - self.left_out)
        zero_weight = count - g * g / gg - out_h * out_h / slope_weight
        level = force - g * fg / gg + out_h * slope_force / slope_weight
        zero = level / zero_weight
        friction = (slope_force + zero * out_h) / slope_weight
        explained = fg * fg / gg + slope_force**2 / slope_weight + zero * level + f * f / n
        sd = np.sqrt(self.variance)
        volume = np.where(has_loading, -0.5 * np.log(gg * slope_weight * zero_weight * n), -np.inf)
        return Linear(
            misfit=(self._squares(puncture) - explained) / self.variance,
            volume=volume,
            stiffness=(fg - zero * g) / gg,
            friction=friction,
            cutting=f / n - zero - friction * h / n,
            zero=zero,
            stiffness_sd=sd / np.sqrt(gg),
            friction_sd=sd / np.sqrt(slope_weight),
            cutting_sd=sd / np.sqrt(n),
            zero_sd=sd / np.sqrt(zero_weight),
            stiffness_by_zero=-g / gg,
            friction_by_zero=out_h / slope_weight,
            cutting_by_friction=-h / n,
        )

    def _level(self, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Number and force of the samples that show b without f_c: the insertion's up to ``end``, the withdrawal's."""
        before = self.insertion.between(0, end)
        out = self.withdrawal.between(min(self.left_out, self.withdrawal.size), self.withdrawal.size)
        return before[N] + out[N], before[F] + out[F]

    def _line(self, z: np.ndarray, first: np.ndarray) -> tuple[np.ndarray, ...]:
        """Sums of 1, h, h^2, F and F h over the insertion's samples from ``first`` on, and of h^2 and -F h over the
        withdrawal's below the contact, where h is the embedded length: for f' of both strokes and f_c; last, the sum of
        h over the withdrawal's."""
        line = self.insertion.between(first, self.insertion.size - self.left_out)
        skipped = min(self.left_out, self.withdrawal.size)
        out = self.withdrawal.between(skipped, np.maximum(self.withdrawal.passing(z), skipped))
        n, h, f = line[N], line[H] - z * line[N], line[F]
        hh = line[H2] - z * (2.0 * line[H] - z * line[N]) + out[H2] - z * (2.0 * out[H] - z * out[N])
        return n, h, hh, f, line[FH] - z * f - (out[FH] - z * out[F]), out[H] - z * out[N]

    def _loading(self, contact: np.ndarray, saturation: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, ...]:
        """Sums of g, g^2 and F g between contact and puncture: g = h^2, then 2 s h - s^2. The second is 0 where there
        are too few samples between them, less than a fiftieth of all, as in the fit."""
        start = np.minimum(self.insertion.passing(contact), end)
        saturated = np.clip(self.insertion.passing(contact + saturation), start, end)
        m, s = self.insertion.between(start, saturated), self.insertion.between(saturated, end)
        z = contact
        gg = m[H4] - z * (4.0 * m[H3] - z * (6.0 * m[H2] - z * (4.0 * m[H] - z * m[N])))
        fg = m[FH2] - z * (2.0 * m[FH] - z * m[F])
        g = m[H2] - z * (2.0 * m[H] - z * m[N])
        slope = np.where(np.isfinite(saturation), 2.0 * saturation, 0.0)
        offset = -slope * (z + 0.25 * slope)
        gg = gg + slope * (slope * s[H2] + 2.0 * offset * s[H]) + offset * offset * s[N]
        enough = end - start >= max(self.insertion.size // 50, MIN_LOADING_SAMPLES)
        return g + slope * s[H] + offset * s[N], np.where(enough, gg, 0.0), fg + slope * s[FH] + offset * s[F]

    def _squares(self, puncture: np.ndarray) -> np.ndarray:
        """Sum of F^2 over every sample that is not left out."""
        w, inside, outside = self.left_out, self.insertion.rows[F2], self.withdrawal.rows[F2]
        used = inside[puncture - w] + inside[self.insertion.size - w] - inside[puncture + w]
        return used + outside[-1] - outside[min(w, self.withdrawal.size)]


@dataclass(frozen=True, eq=False, kw_only=True)
class Posterior:
    """The grid with each cell's weight and the coefficients' Gaussian in it.

    Depths are measured from ``origin`` [m] in units of ``depth_unit`` [m], the indentation; forces are in N.
    ``contacts`` (r, n) has a row for each of ``saturations`` (r,), one infinite where the law has none. ``weights``
    (k, r, n), of sum 1, and all of ``linear`` are for ``punctures`` (k,), each the number of samples before it.
    """

    origin: float
    depth_unit: float
    punctures: np.ndarray
    saturations: np.ndarray
    contacts: np.ndarray
    weights: np.ndarray
    linear: Linear

    @property
    def steps(self) -> np.ndarray:
        """Widths (2, 1) of a cell: of the contact, and of the saturation, 0 for a given saturation."""
        across = self.saturations[1] - self.saturations[0] if len(self.saturations) > 1 else 0.0
        return np.array([[self.contacts[0, 1] - self.contacts[0, 0]], [across]])

    def places(self, cell: np.ndarray, along: np.ndarray, across: np.ndarray) -> tuple[np.ndarray, ...]:
        """Contact depth [m], saturation depth [m] and samples before the puncture, (d,) each, in cells (d,) of the
        flattened grid, ``along`` and ``across`` (d,) from their nodes."""
        each, here = divmod(cell, self.contacts.size)
        row = here // N_CONTACTS
        contact = np.take(self.contacts, here) + along
        if len(self.saturations) > 1:
            contact += across * np.gradient(self.contacts[:, 0], self.saturations)[row]
        unit = self.depth_unit
        return self.origin + unit * contact, unit * (self.saturations[row] + across), self.punctures[each]

    def interpolated(self, values: np.ndarray, cell: np.ndarray, along: np.ndarray, across: np.ndarray) -> np.ndarray:
        """``values`` (k, r, n) of the grid between its nodes, (d,)."""
        found = np.take(values, cell) + along * np.take(np.gradient(values, self.steps[0, 0], axis=2), cell)
        if len(self.saturations) > 1:
            found += across * np.take(np.gradient(values, self.steps[1, 0], axis=1), cell)
        return found


def posterior_of(fit: CycleFit, strokes: Strokes) -> Posterior:
    """The posterior of a complete fit of ``strokes``.

    Flat priors: contact over depth, saturation over depths up to the indentation, puncture over samples, c and f' not
    below 0, f_c over forces. The noise is assumed known: squares are divided by the long-run variance, so that
    correlated samples are not counted as independent. Behind a filter, which smears the puncture, the puncture is held.
    """
    cycle, puncture = cycle_sums(fit, strokes), fit.puncture.before
    unit = fit.values["puncture_indentation"]
    given = np.array([fit.values["saturation_depth"] / unit])
    saturations = _likely_saturations(cycle, puncture) if fit.saturation_sought else given
    centres, width = ridge(cycle, saturations, puncture)
    contacts = centres[:, None] + width * np.linspace(-GRID_HALF_WIDTH, GRID_HALF_WIDTH, N_CONTACTS)
    punctures = _likely_punctures(fit, cycle, centres, saturations)
    linear = Linear(*np.stack([cycle.linear(contacts, saturations[:, None], k) for k in punctures], axis=1))
    weights = np.exp(_from_best(linear.log_density))
    return Posterior(
        origin=fit.values["contact_depth"],
        depth_unit=unit,
        punctures=punctures,
        saturations=saturations,
        contacts=contacts,
        weights=weights / weights.sum(),
        linear=linear,
    )


def cycle_sums(fit: CycleFit, strokes: Strokes) -> CycleSums:
    """Running sums of both strokes from the fitted contact on, in units of the indentation."""
    origin, unit = fit.values["contact_depth"], fit.values["puncture_indentation"]
    pairs = (strokes.depth_in, strokes.force_in, 1.0), (strokes.depth_out, strokes.force_out, -1.0)
    sums = [RunningSums((depth - origin) / unit, force, direction) for depth, force, direction in pairs]
    variance = sum(noise.count * noise.long_run for noise in fit.residuals.noises) / fit.residuals.count
    return CycleSums(*sums, variance, fit.puncture.left_out)


def _log_density(cycle: CycleSums, contact: Grid, saturation: Grid, puncture: Grid) -> np.ndarray:
    return cycle.linear(contact, saturation, puncture).log_density


def _from_best(log: np.ndarray) -> np.ndarray:
    return log - log.max()


def _likely_saturations(cycle: CycleSums, puncture: int) -> np.ndarray:
    """Nodes (r,) over the saturation depths that have weight, none beyond the indentation."""
    low, high = 0.0, 1.0
    for _ in range(3):
        nodes = low + (high - low) * (np.arange(N_SATURATIONS) + 0.5) / N_SATURATIONS
        centres, _ = ridge(cycle, nodes, puncture)
        likely = np.flatnonzero(_from_best(_log_density(cycle, centres, nodes, puncture)) > -MAX_LOG_RATIO)
        half = 0.5 * (high - low) / N_SATURATIONS
        low, high = max(nodes[likely[0]] - half, 0.0), min(nodes[likely[-1]] + half, 1.0)
    return low + (high - low) * (np.arange(N_SATURATIONS) + 0.5) / N_SATURATIONS


def ridge(cycle: CycleSums, saturations: np.ndarray, puncture: int) -> tuple[np.ndarray, float]:
    """The most likely contact (r,) at each saturation depth, and the largest of their standard errors."""
    rows, centres, half = saturations[:, None], np.zeros(len(saturations)), 0.5
    for _ in range(N_ROUNDS):
        nodes = centres[:, None] + half * np.linspace(-1.0, 1.0, 33)
        best = _log_density(cycle, nodes, rows, puncture).argmax(axis=1)
        centres, half = nodes[np.arange(len(nodes)), best], half / NARROWING
    width = np.full(len(centres), 1e-3)
    for _ in range(4):
        sides = _log_density(cycle, centres[:, None] + width[:, None] * np.array([-1.0, 0.0, 1.0]), rows, puncture)
        curvature = np.clip(2.0 * sides[:, 1] - sides[:, 0] - sides[:, 2], 1e-6, 25.0)
        width = np.clip(width / np.sqrt(curvature), 1e-9, 0.5)
    return centres, float(width.max())


def _likely_punctures(fit: CycleFit, cycle: CycleSums, centres: np.ndarray, saturations: np.ndarray) -> np.ndarray:
    """Numbers of samples before the puncture (k,) that have weight, near the fit's own interval."""
    best = fit.puncture.before
    if fit.puncture.left_out:
        return np.array([best])
    margin = 20 * (fit.puncture.high - fit.puncture.low + 1)
    near = np.arange(max(best - margin, 1), min(best + margin, cycle.insertion.size - MIN_LOADING_SAMPLES))
    row = _log_density(cycle, centres, saturations, best).argmax()
    log = _log_density(cycle, centres[row], saturations[row], near)
    return near[_from_best(log) > -MAX_LOG_RATIO]
