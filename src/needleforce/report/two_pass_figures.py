# SPDX-License-Identifier: Apache-2.0
"""The paper's own procedure drawn: friction of the second pass (fig. 6), both passes and their difference (fig. 7)."""

import numpy as np

from .canvas import MEASURED, MODEL, QUIET, SECOND, SLATE, THICK, THIN, axis_names, panels
from .curves import columns_for
from .figures import DEPTH, FORCE, line
from .labels import Labels
from .numbers import plain


def middle_site(sites):
    """The site with the median cutting force."""
    return sorted(sites, key=lambda site: site.cutting)[(len(sites) - 1) // 2]


def friction(figure, sheet, sites) -> None:
    """The second pass over indentation, the line of friction through it, and where its window ends (fig. 6)."""
    axes = panels(figure, sheet)[0, 0]
    columns = min(columns_for(len(sites), sheet.columns), sheet.columns)
    beyond, curves = [], []
    for site in sites:
        depth, force = 1e3 * site.friction_depth, site.friction_force
        out, inside = site.friction_depth > site.friction_end, _inside(site)
        beyond.append(line(axes, depth[out], force[out], columns, color=QUIET, lw=THIN, alpha=0.5))
        curves.append(line(axes, depth[inside], force[inside], columns, color=SECOND, lw=THIN, alpha=0.8))
    names = ("friction_end", "friction_slope", "friction_intercept")
    end, slope, intercept = (float(np.mean([getattr(site, name) for site in sites])) for name in names)
    depth = np.array([0.0, end])
    curves.append(line(axes, 1e3 * depth, slope * depth + intercept, 2, color=MODEL, lw=THICK, zorder=4))
    axes.axvline(1e3 * end, color=QUIET, lw=0.8, ls=(0, (2, 2)))
    axes.set_xlim(left=0.0)
    axis_names(axes, DEPTH, FORCE)
    window = np.full(2, 1e3 * end), axes.get_ylim()
    labels = Labels(axes, [*curves, *beyond, window])
    labels.on(f"{'mean ' if len(sites) > 1 else ''}line: {plain(slope, 'N/m')}", *curves[-1], MODEL)
    labels.on("second pass", *curves[0], SECOND)
    labels.on("end of the window", *window, QUIET)


def _inside(site) -> np.ndarray:
    """The samples from the surface to the end of the window; those beyond it do not count and are drawn in grey."""
    return (site.friction_depth >= 0.0) & (site.friction_depth <= site.friction_end)


def both_passes(figure, sheet, sites, upper_bound: bool, limits=(np.nan, np.nan)) -> None:
    """Left, the two passes at one site; right, their difference at every site and its mean (fig. 7).

    ``limits`` [N] is the range of the cutting force with the biases.
    """
    rows, columns = (2, 1) if sheet.narrow else (1, 2)
    left, right = panels(figure, sheet, rows, columns).ravel()
    _passes(left, sheet, middle_site(sites))
    _difference(right, sheet, sites, upper_bound, limits)


def _passes(axes, sheet, site) -> None:
    first = line(axes, 1e3 * site.grid, site.first, sheet.columns // 2, color=MEASURED, lw=1.0)
    second = line(axes, 1e3 * site.grid, site.second, sheet.columns // 2, color=SECOND, lw=1.4)
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    axis_names(axes, DEPTH, FORCE)
    labels = Labels(axes, [first, second])
    labels.on("first pass", *first, SLATE)
    labels.on("second pass, same hole", *second, SECOND)


def _difference(axes, sheet, sites, upper_bound: bool, limits) -> None:
    columns = min(columns_for(len(sites), sheet.columns), sheet.columns // 2)
    style = {"color": MEASURED, "lw": THIN, "alpha": 0.7}
    curves = [line(axes, 1e3 * site.grid, site.difference, columns, **style) for site in sites]
    cutting = np.array([site.cutting for site in sites])
    mean, spread = cutting.mean(), cutting.std(ddof=1) if len(cutting) > 1 else 0.0
    axes.axhspan(mean - spread, mean + spread, color=MODEL, alpha=0.14, lw=0)
    axes.axhline(mean, color=MODEL, lw=THICK)
    axes.set_ylim(*_limits(np.concatenate([*(y for _, y in curves), limits]), mean))
    axis_names(axes, DEPTH, "first − second [N]")
    across = axes.get_xlim(), (mean, mean)
    words = "upper bound of cutting" if upper_bound else "mean cutting force"
    bracket = np.full(2, 1e3 * sites[0].grid[len(sites[0].grid) // 20]), np.array(limits)
    axes.plot(*bracket, color=SLATE, lw=1.0, marker="_", ms=6)
    labels = Labels(axes, [*curves, across, bracket] if np.isfinite(limits).all() else [*curves, across])
    labels.on(f"{words} {plain(mean, 'N')}", *across, MODEL)
    if np.isfinite(limits).all():
        labels.on("range with its biases", *bracket, SLATE)


def _limits(values: np.ndarray, mean: float) -> tuple[float, float]:
    """Limits that show zero, the mean and all values, with room for a label."""
    values = np.append(values[np.isfinite(values)], [0.0, mean])
    spread = np.ptp(values) or 1.0
    return values.min() - 0.06 * spread, values.max() + 0.15 * spread
