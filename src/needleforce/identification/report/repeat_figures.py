# SPDX-License-Identifier: Apache-2.0
"""What several insertions show, with titles and captions: residuals, every recording, and both passes at one site."""

import math
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ...display.axes import FORCE, INDENTATION, TIME
from ...display.canvas import (
    INK,
    MEASURED,
    MEDIUM,
    MODEL,
    QUIET,
    SECOND,
    SLATE,
    TEXT,
    THICK,
    THIN,
    Labels,
    Sheet,
    axis_names,
    columns_for,
    line,
    panels,
)
from ...display.markup import Markup, join, listing, visible
from ...display.page import Figure
from ...display.quantities import counted, plain
from ..estimates import Quality
from ..two_pass.result import Site, TwoPass
from .curves import FORCE_SHARE, RESIDUAL_FACTOR, DrawnRepeat, binned
from .force_figures import KEY, repeat_style, titled
from .words import file_name, spans

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Drawing

RESIDUAL = "measured − model [N]"
SHOWN = 0.95  # share of the depths whose residuals the axis holds
OFFSET = {"textcoords": "offset points", "va": "bottom"}


def residuals(drawn: Sequence[DrawnRepeat], quality: Quality | None) -> list[Figure]:
    """Residuals over depth; none without a model."""
    shown = tuple(one for one in drawn if one.has_model)
    if not shown or quality is None:
        return []
    rms = quality.rmse_N
    lines = (
        "Lines: mean residual of each repeat at each depth" if len(shown) > 1 else "Line: mean residual at each depth"
    )
    among = " without anomalous recordings" if any(one.anomalous for one in shown) else ""
    band = f"Orange band: ± the rms residual, {plain(rms, 'N', rms)}."
    limit, largest = _reach(shown)
    beyond = f" The axis holds {100 * SHOWN:.0f} % of the depths; the largest residual is {plain(largest, 'N', rms)}."
    caption = f"{lines}. Grey: range of all samples{among}. {band}{beyond if limit < largest else ''}"
    draw = partial(draw_residuals, drawn=shown, rmse=rms, limit=max(limit, 1.3 * rms))
    return [titled("residuals", "Residuals over depth", caption, draw, (220, 400))]


def _reach(drawn: Sequence[DrawnRepeat]) -> tuple[float, float]:
    """The residual [N] that all but a few of the depths do not exceed, as where friction reverses, and the largest."""
    parts = [binned(one.indentation[each], one.residual[each], _edges(drawn)) for one in drawn for each in one.strokes]
    sizes = np.abs(np.concatenate([np.concatenate(limits) for _, *limits in parts]))
    sizes = sizes[np.isfinite(sizes)]
    return 1.15 * float(np.quantile(sizes, SHOWN)), float(sizes.max())


def _edges(drawn: Sequence[DrawnRepeat]) -> np.ndarray:
    """Limits of the depths [mm] of which residuals are means."""
    return np.linspace(0.0, max(one.indentation.max() for one in drawn), 141)


def draw_residuals(figure: "Drawing", sheet: Sheet, drawn: Sequence[DrawnRepeat], rmse: float, limit: float) -> None:
    """Measured minus modelled force over indentation up to ± ``limit`` [N], a panel for each stroke, with ± the rms."""
    rows, columns = (2, 1) if sheet.narrow else (1, 2)
    both = panels(figure, sheet, rows, columns, sharex=True, sharey=True).ravel()
    for axes, name, stroke in zip(both, ("insertion", "withdrawal"), (0, 1)):
        axes.axhspan(-rmse, rmse, color=MODEL, alpha=0.2, lw=0)
        _bins(axes, drawn, stroke)
        axes.set_ylim(-limit, limit)
        axes.axhline(0.0, color=MODEL, lw=1.0)
        axes.tick_params(labelbottom=True, labelleft=True)
        axis_names(axes, INDENTATION, RESIDUAL)
        axes.annotate(name, (1.0, 1.0), (0, 8), xycoords="axes fraction", ha="right", color=QUIET, **OFFSET)
    place = {"xycoords": both[-1].get_yaxis_transform(), **OFFSET}
    both[-1].annotate("± rms", (1.0, rmse), (-2, 1), ha="right", color=MODEL, fontsize=TEXT - 1, **place)


def _bins(axes: "Axes", drawn: Sequence[DrawnRepeat], stroke: int) -> None:
    """The mean residual of each repeat at each depth as a line, over the grey range of all samples of all repeats."""
    edges = _edges(drawn)
    found = [binned(one.indentation[one.strokes[stroke]], one.residual[one.strokes[stroke]], edges) for one in drawn]
    middle = 0.5 * (edges[1:] + edges[:-1])
    normal = [bins for one, bins in zip(drawn, found) if not one.anomalous] or found
    low, high = np.fmin.reduce([low for _, low, _ in normal]), np.fmax.reduce([high for _, _, high in normal])
    axes.fill_between(middle, low, high, color="#d9dcdf", lw=0)
    for one, (mean, _, _) in zip(drawn, found):
        line(axes, middle, mean, len(middle), **repeat_style(one, len(drawn)))


def multiples(drawn: Sequence[DrawnRepeat], anomalous: set[int]) -> list[Figure]:
    """Every recording over time; none with fewer than two."""
    if len(drawn) < 2:
        return []
    heights = multiples_height(len(drawn), False), multiples_height(len(drawn), True)
    caption = join([KEY if any(one.has_model for one in drawn) else "", _anomaly_words(anomalous)])
    draw = partial(draw_multiples, drawn=drawn)
    return [titled("recordings", "Every recording, on the same axes", caption, draw, heights)]


def _anomaly_words(anomalous: set[int]) -> str:
    """Which recordings are anomalous, and by which rule."""
    rule = f"a residual above {RESIDUAL_FACTOR:g} times the median"
    rule += f", or a puncture force more than {100 * FORCE_SHARE:.0f}\N{NO-BREAK SPACE}% from the median"
    named = f"Anomalous (blue): no. {spans(anomalous)}, with {rule}."
    return named if anomalous else f"No recording is anomalous: none has {rule}."


def panels_per_row(count: int, narrow: bool) -> int:
    """Number of small panels in a row."""
    return 2 if narrow else count if count <= 4 else 3 if count <= 6 else 4


def multiples_height(count: int, narrow: bool) -> float:
    """Height [points] of a drawing with ``count`` small panels."""
    row = panels_per_row(count, narrow)
    return 40.0 + (100.0 if narrow else 105.0 + 60.0 * (row < 4)) * math.ceil(count / row)


def draw_multiples(figure: "Drawing", sheet: Sheet, drawn: Sequence[DrawnRepeat]) -> None:
    """Every recording over time, measured and modelled, on the same axes; anomalous ones in another colour."""
    row = panels_per_row(len(drawn), sheet.narrow)
    margins = {"top": 32.0, "across": 18.0, "down": 32.0}
    grid = panels(figure, sheet, math.ceil(len(drawn) / row), row, margins, sharex=True, sharey=True).ravel()
    budget = min(columns_for(len(drawn), sheet.columns), sheet.columns // row)
    for k, (axes, one) in enumerate(zip(grid, drawn)):
        line(axes, one.time, one.measured, budget, color=SECOND if one.anomalous else MEASURED, lw=THIN)
        if one.has_model:
            line(axes, one.time, one.model, budget, color=MODEL, lw=MEDIUM, alpha=0.9)
        _heading(axes, one, 16 if sheet.narrow else 24)
        axes.tick_params(labelbottom=k + row >= len(drawn))
        axes.set_label(FORCE)
    grid[0].set_xlim(0.0, max(one.time[-1] for one in drawn))
    for axes in grid[len(drawn) :]:
        axes.set_visible(False)
    grid[len(drawn) - 1].set_xlabel(TIME, loc="right")
    grid[0].annotate(FORCE, (0.0, 1.0), (-32.0, 18.0), xycoords="axes fraction", **OFFSET)


def _heading(axes: "Axes", one: DrawnRepeat, longest: int) -> None:
    """Number and file name above a small panel, the name cut to its last ``longest`` characters."""
    name = file_name(one.fit.file).removesuffix(".csv")
    name = name if len(name) <= longest else f"…{name[1 - longest :]}"
    style = {"xycoords": "axes fraction", "fontsize": TEXT - 1, "color": SECOND if one.anomalous else INK}
    axes.annotate(f"{one.number}  {visible(name)}", (0.0, 1.0), (0, 4), **style, **OFFSET)
    if one.anomalous:
        axes.annotate("anomalous", (1.0, 1.0), (0, -11), ha="right", **style, **OFFSET)


def two_pass_figures(two_pass: TwoPass | None) -> list[Figure]:
    """Friction of the second pass, and the difference of the two passes; none without sites."""
    if two_pass is None or not two_pass.sites:
        return []
    sites = two_pass.sites
    both = partial(both_passes, sites=sites, upper_bound=two_pass.upper_bound, limits=two_pass.cutting_range)
    lines = partial(friction, sites=sites)
    slopes = titled("friction", "Friction", _friction_words(sites), lines, (250, 230), side_caption=True)
    return [slopes, titled("passes", "Two insertions at one site", _pass_words(two_pass), both, (240, 440))]


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


def friction(figure: "Drawing", sheet: Sheet, sites: Sequence[Site]) -> None:
    """The second pass over indentation, its least-squares line, and the end of the window (fig. 6)."""
    axes = panels(figure, sheet)[0, 0]
    columns = min(columns_for(len(sites), sheet.columns), sheet.columns)
    beyond, curves = [], []
    for site in sites:
        depth, force = 1e3 * site.friction_depth, site.friction_force
        # used are those from the surface to the end of the window, the others are drawn in grey
        out = site.friction_depth > site.friction_end
        inside = (site.friction_depth >= 0.0) & (site.friction_depth <= site.friction_end)
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


def both_passes(
    figure: "Drawing",
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


def _passes(axes: "Axes", sheet: Sheet, site: Site) -> None:
    """The two passes at one site over indentation."""
    first = line(axes, 1e3 * site.grid, site.first, sheet.columns // 2, color=MEASURED, lw=1.0)
    second = line(axes, 1e3 * site.grid, site.second, sheet.columns // 2, color=SECOND, lw=1.4)
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    axis_names(axes, INDENTATION, FORCE)
    labels = Labels(axes, [first, second])
    labels.on("first pass", *first, SLATE)
    labels.on("second pass, same hole", *second, SECOND)


def _difference(
    axes: "Axes", sheet: Sheet, sites: Sequence[Site], upper_bound: bool, limits: tuple[float, float]
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
