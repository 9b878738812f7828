# SPDX-License-Identifier: Apache-2.0
"""The figures of two insertions at one site: friction of the second, and the difference of the two."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from ...display.axes import FORCE, INDENTATION
from ...display.canvas import (
    MEASURED,
    MODEL,
    QUIET,
    SECOND,
    SLATE,
    THICK,
    THIN,
    Labels,
    Sheet,
    axis_names,
    columns_for,
    line,
    panels,
)
from ...display.markup import Markup, join, listing
from ...display.page import Figure
from ...display.quantities import counted, plain
from ..two_pass.result import Site, TwoPass
from .words import IN_TABLES


def two_pass_figures(two_pass: TwoPass | None) -> list[Figure]:
    """Friction of the second pass, and the difference of the two passes; none without sites."""
    if two_pass is None or not two_pass.sites:
        return []
    sites = two_pass.sites
    both = partial(both_passes, sites=sites, upper_bound=two_pass.upper_bound, limits=two_pass.cutting_range)
    slopes = Figure(
        name="friction",
        title="Friction",
        caption=_friction_words(sites),
        alt=f"Friction. {IN_TABLES}",
        draw=partial(friction, sites=sites),
        heights=(250, 230),
        side_caption=True,
    )
    title = "Two insertions at one site"
    alt, words = f"{title}. {IN_TABLES}", _pass_words(two_pass)
    return [slopes, Figure(name="passes", title=title, caption=words, alt=alt, draw=both, heights=(240, 440))]


def _friction_words(sites: Sequence[Site]) -> str:
    """Caption of the figure of friction."""
    slopes = ", ".join(plain(site.friction_slope, "N/m") for site in sites[:5])
    slopes += f" and {len(sites) - 5} more" if len(sites) > 5 else ""
    reasons = "; ".join(dict.fromkeys(site.friction_end_reason for site in sites if site.friction_end_reason))
    ended = f" The dashed line is the end of the window: {reasons}." if reasons else ""
    count = counted(len(sites), "site")
    return (
        f"The second pass through the same hole at {count}, with the slope of its least-squares line: {slopes}.{ended}"
    )


def _pass_words(two_pass: TwoPass) -> Markup:
    """Caption of the figure of both passes, with the biases of the subtraction."""
    many = len(two_pass.sites) > 1
    words = "Both passes at the site with the median cutting force; " if many else "Both passes; "
    words += f"then the first minus the second pass, with the mean{' ± sd over sites' if many else ''}."
    if two_pass.upper_bound:
        words += (
            " The second pass still has a deformation or a drop: the difference is an upper bound of the cutting force."
        )
    return join([words, listing(two_pass.biases)])


def middle_site(sites: Sequence[Site]) -> Site:
    """The site with the median cutting force."""
    return sorted(sites, key=lambda site: site.cutting)[(len(sites) - 1) // 2]


def friction(figure: Drawing, sheet: Sheet, sites: Sequence[Site]) -> None:
    """The second pass over indentation, its least-squares line, and the end of the window (fig. 6)."""
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
    axis_names(axes, INDENTATION, FORCE)
    window = np.full(2, 1e3 * end), axes.get_ylim()
    labels = Labels(axes, [*curves, *beyond, window])
    labels.on(f"{'mean ' if len(sites) > 1 else ''}line: {plain(slope, 'N/m')}", *curves[-1], MODEL)
    labels.on("second pass", *curves[0], SECOND)
    labels.on("end of the window", *window, QUIET)


def _inside(site: Site) -> np.ndarray:
    """True for the samples from the surface to the end of the window; the others are not used and drawn in grey."""
    return (site.friction_depth >= 0.0) & (site.friction_depth <= site.friction_end)


def both_passes(
    figure: Drawing,
    sheet: Sheet,
    sites: Sequence[Site],
    upper_bound: bool,
    limits: tuple[float, float] = (np.nan, np.nan),
) -> None:
    """The two passes at one site, and their difference at every site with its mean (fig. 7).

    ``limits`` [N] is the range of the cutting force including the biases.
    """
    rows, columns = (2, 1) if sheet.narrow else (1, 2)
    left, right = panels(figure, sheet, rows, columns).ravel()
    _passes(left, sheet, middle_site(sites))
    _difference(right, sheet, sites, upper_bound, limits)


def _passes(axes: Axes, sheet: Sheet, site: Site) -> None:
    """The two passes at one site over indentation."""
    first = line(axes, 1e3 * site.grid, site.first, sheet.columns // 2, color=MEASURED, lw=1.0)
    second = line(axes, 1e3 * site.grid, site.second, sheet.columns // 2, color=SECOND, lw=1.4)
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    axis_names(axes, INDENTATION, FORCE)
    labels = Labels(axes, [first, second])
    labels.on("first pass", *first, SLATE)
    labels.on("second pass, same hole", *second, SECOND)


def _difference(
    axes: Axes, sheet: Sheet, sites: Sequence[Site], upper_bound: bool, limits: tuple[float, float]
) -> None:
    """The first minus the second pass at every site, its mean ± sd, and the range including the biases."""
    columns = min(columns_for(len(sites), sheet.columns), sheet.columns // 2)
    style = {"color": MEASURED, "lw": THIN, "alpha": 0.7}
    curves = [line(axes, 1e3 * site.grid, site.difference, columns, **style) for site in sites]
    cutting = np.array([site.cutting for site in sites])
    mean, spread = cutting.mean(), cutting.std(ddof=1) if len(cutting) > 1 else 0.0
    axes.axhspan(mean - spread, mean + spread, color=MODEL, alpha=0.14, lw=0)
    axes.axhline(mean, color=MODEL, lw=THICK)
    axes.set_ylim(*_limits(np.concatenate([*(y for _, y in curves), limits]), mean))
    axis_names(axes, INDENTATION, "first − second [N]")
    mean_line = axes.get_xlim(), (mean, mean)
    name = "upper bound of cutting" if upper_bound else "mean cutting force"
    bracket = np.full(2, 1e3 * sites[0].grid[len(sites[0].grid) // 20]), np.array(limits)
    axes.plot(*bracket, color=SLATE, lw=1.0, marker="_", ms=6)
    labels = Labels(axes, [*curves, mean_line, bracket] if np.isfinite(limits).all() else [*curves, mean_line])
    labels.on(f"{name} {plain(mean, 'N')}", *mean_line, MODEL)
    if np.isfinite(limits).all():
        labels.on("range including biases", *bracket, SLATE)


def _limits(values: np.ndarray, mean: float) -> tuple[float, float]:
    """Limits that include zero, the mean and all values, with space for a label."""
    values = np.append(values[np.isfinite(values)], [0.0, mean])
    spread = np.ptp(values) or 1.0
    return values.min() - 0.06 * spread, values.max() + 0.15 * spread
