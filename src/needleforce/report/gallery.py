# SPDX-License-Identifier: Apache-2.0
"""The figures a fit gives, each with its title and a caption in words: the force against the model, residuals, every
recording next to the others, the two passes."""

import math
from functools import partial

import numpy as np

from ..display.markup import Markup, element, join, listing, visible
from ..display.quantities import counted, plain
from ..identification.layered.result import LayeredFit
from ..identification.result import Fit
from . import figures, layers, tables
from .canvas import (
    BESIDE,
    FULL,
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
    axis_names,
    drawing,
    panels,
)
from .curves import FORCE_SHARE, RESIDUAL_FACTOR, DrawnRepeat, binned, columns_for, odd_ones, representative
from .figures import DEPTH, FORCE, TIME, line, repeat_style
from .words import file_name, spans

_MEASURED = element("b", "Measured", class_="measured")
_POPULATION = (
    "Dashed: the law for an insertion that was not recorded, its ruptures spread over their scatter between repeats. "
)
_KEY = join([_MEASURED, " thin and grey, ", element("b", "model", class_="model"), " thick and orange. "])
_OFFSET = {"textcoords": "offset points", "va": "bottom"}
RESIDUAL = "measured − model [N]"


def main_figure(fit: Fit, drawn: tuple[DrawnRepeat, ...]) -> Markup:
    """Measured and modelled force over depth; empty where nothing can be drawn."""
    one = representative(drawn)
    return Markup("") if one is None else _over_depth(fit, drawn, one)


def gallery(fit: Fit, drawn: tuple[DrawnRepeat, ...]) -> Markup:
    """Every other figure that the fit can fill."""
    one = representative(drawn)
    if one is None:
        return Markup("")
    first = _over_time(one, len(drawn)), _before_puncture(fit, drawn), _two_pass(fit.two_pass)
    return join([*first, _layers(fit, one), _residuals(fit, drawn), _multiples(fit, drawn)])


def ratio_figure(rows: list[dict]) -> Markup:
    """Identified over true, where a comparison with known truth is given."""
    found = tables.ratios(rows)
    if not found:
        return Markup("")
    caption = "With the 95 % interval. Filled dots: the interval misses the truth, a bias of the method."
    draw = partial(tables.ratio_figure, rows=found)
    heights = 44.0 + 22.0 * len(found), 44.0 + 30.0 * len(found)
    return _figure("ratio", "Identified over true", caption, draw, heights)


def _figure(name: str, title: str, caption: object, draw, heights, beside: bool = False) -> Markup:
    alt = f"{title}. The numbers are in the tables of this page."
    image = drawing(name, draw, heights, alt, BESIDE if beside else FULL)
    parts = element("h3", title), element("div", image, class_="drawing"), element("figcaption", caption)
    return element("figure", *parts, class_="beside" if beside else None, id=f"figure-{name}")


def _over_time(one, among: int) -> Markup:
    which = f"Recording {one.number}, the one with the median residual. " if among > 1 and one.has_model else ""
    bands = "Bands are the phases of the insertion; circles mark the events."
    caption = join([which, _KEY if one.has_model else "", bands])
    return _figure("time", "Force over time", caption, partial(figures.over_time, one=one), (280, 240))


def _before_puncture(fit, drawn) -> Markup:
    shown = tuple(one for one in drawn if one.fit.events.contact is not None)
    if not shown:
        return Markup("")
    its = "the identified" if fit.shared_contact is not None else "its own"
    every = f"Every repeat from {its} contact on; circles are" if len(shown) > 1 else "From contact on; the circle is"
    caption = join([f"{every} the measured first puncture. ", _law(fit.model)])
    draw = partial(figures.before_puncture, drawn=shown, model=fit.model)
    layered = isinstance(fit, LayeredFit)
    title = "Force before the first puncture" if layered else "Stiffness force before the puncture"
    return _figure("stiffness", title, caption, draw, (250, 230), beside=True)


def _law(model) -> str:
    if model is None:
        return ""
    said = "The layers that the tip has reached add up, at the mean speed." if model.deeper else model.stiffness.summary
    return f"{said} The curve ends at the identified puncture."


def _two_pass(two_pass) -> Markup:
    if two_pass is None or not two_pass.sites:
        return Markup("")
    sites = two_pass.sites
    lines = partial(friction, sites=sites)
    options = {"upper_bound": two_pass.upper_bound, "limits": two_pass.cutting_range}
    both = partial(both_passes, sites=sites, **options)
    slopes = _figure("friction", "Friction", _friction_words(sites), lines, (250, 230), beside=True)
    return join([slopes, _figure("passes", "Two insertions at one site", _pass_words(two_pass), both, (240, 440))])


def _friction_words(sites) -> str:
    slopes = ", ".join(plain(site.friction_slope, "N/m") for site in sites[:5])
    slopes += f" and {len(sites) - 5} more" if len(sites) > 5 else ""
    reasons = "; ".join(dict.fromkeys(site.friction_end_reason for site in sites if site.friction_end_reason))
    ended = f" The window ends where the dashed line stands: {reasons}." if reasons else ""
    of = counted(len(sites), "site")
    return f"The second pass through the same hole, {of}, and its least-squares line: {slopes}.{ended}"


def _pass_words(two_pass) -> Markup:
    many = len(two_pass.sites) > 1
    words = "Both passes at the site with the median cutting force; " if many else "Both passes; "
    words += f"then first minus second pass, with the mean{' ± sd over sites' if many else ''}."
    if two_pass.upper_bound:
        words += " The second pass still deforms or drops: the difference is an upper bound of the cutting force."
    return join([words, listing(two_pass.biases) if two_pass.biases else ""])


def _over_depth(fit, drawn, one) -> Markup:
    shown = tuple(each for each in drawn if each.fit.events.contact is not None) or (one,)
    model = f"The model is run along recording {one.number}. " if len(shown) > 1 and one.has_model else ""
    counted_from = "the identified" if fit.shared_contact is not None else "each recording's own"
    population = layers.population_force(fit, one)
    dashed = "" if population is None else _POPULATION
    words = [_KEY if one.has_model else "", model, dashed, f"Indentation counts from {counted_from} contact."]
    draw = partial(figures.over_depth, drawn=shown, chosen=one, population=population)
    caption = join(words)
    return _figure("depth", "Complete force over depth", caption, draw, (300, 260))


def _layers(fit, one) -> Markup:
    """What each of several layers carries."""
    if not isinstance(fit, LayeredFit) or not (fit.model and fit.model.deeper and one.has_model):
        return Markup("")
    caption = f"The layers one by one along recording {one.number}; they add up to the model. Grey: measured."
    draw = partial(layers.shares, one=one, forces=layers.layer_forces(fit, one))
    return _figure("layers", "What each layer carries", caption, draw, (260, 240))


def _residuals(fit, drawn) -> Markup:
    shown = tuple(one for one in drawn if one.has_model)
    if not shown or fit.quality is None:
        return Markup("")
    rms = fit.quality.rmse_N
    lines = "Lines are each repeat's" if len(shown) > 1 else "The line is the"
    but = " but the odd one's" if any(one.odd for one in shown) else ""
    band = f"orange ± the rms residual, {plain(rms, 'N', rms)}"
    caption = f"{lines} mean along depth, grey the range of all samples{but}, {band}."
    draw = partial(residuals, drawn=shown, rmse=rms)
    return _figure("residuals", "Residuals over depth", caption, draw, (220, 400))


def _multiples(fit, drawn) -> Markup:
    if len(drawn) < 2:
        return Markup("")
    heights = multiples_height(len(drawn), False), multiples_height(len(drawn), True)
    caption = join([_KEY if any(one.has_model for one in drawn) else "", _odd_words(odd_ones(fit))])
    draw = partial(multiples, drawn=drawn)
    return _figure("recordings", "Every recording, on the same axes", caption, draw, heights)


def _odd_words(odd: set[int]) -> str:
    rule = f"a residual above {RESIDUAL_FACTOR:g} times the median"
    rule += f", or a puncture force more than {100 * FORCE_SHARE:.0f}\N{NO-BREAK SPACE}% off it"
    return f"Odd one out (blue): no. {spans(odd)}, with {rule}." if odd else f"None is an odd one out: none has {rule}."


def residuals(figure, sheet, drawn, rmse: float) -> None:
    """Measured minus modelled force over indentation, one panel a stroke, with the band of ± the rms residual."""
    rows, columns = (2, 1) if sheet.narrow else (1, 2)
    both = panels(figure, sheet, rows, columns, sharex=True, sharey=True).ravel()
    edges = np.linspace(0.0, max(one.indentation.max() for one in drawn), 141)
    for axes, name, stroke in zip(both, ("insertion", "withdrawal"), ("inward", "outward")):
        axes.axhspan(-rmse, rmse, color=MODEL, alpha=0.2, lw=0)
        _bins(axes, drawn, stroke, edges)
        axes.axhline(0.0, color=MODEL, lw=1.0)
        axes.tick_params(labelbottom=True, labelleft=True)
        axis_names(axes, DEPTH, RESIDUAL)
        axes.annotate(name, (1.0, 1.0), (0, 8), xycoords="axes fraction", ha="right", color=QUIET, **_OFFSET)
    place = {"xycoords": both[-1].get_yaxis_transform(), **_OFFSET}
    both[-1].annotate("± rms", (1.0, rmse), (-2, 1), ha="right", color=MODEL, fontsize=TEXT - 1, **place)


def _bins(axes, drawn, stroke: str, edges: np.ndarray) -> None:
    """Each repeat's mean residual along depth as a line, over the grey range of all samples of all repeats."""
    found = [binned(one.indentation[getattr(one, stroke)], one.residual[getattr(one, stroke)], edges) for one in drawn]
    middle = 0.5 * (edges[1:] + edges[:-1])
    usual = [bins for one, bins in zip(drawn, found) if not one.odd] or found
    low, high = np.fmin.reduce([low for _, low, _ in usual]), np.fmax.reduce([high for _, _, high in usual])
    axes.fill_between(middle, low, high, color="#d9dcdf", lw=0)
    for one, (mean, _, _) in zip(drawn, found):
        line(axes, middle, mean, len(middle), **repeat_style(one, len(drawn)))


def across(count: int, narrow: bool) -> int:
    """Small panels in a row."""
    return 2 if narrow else count if count <= 4 else 3 if count <= 6 else 4


def multiples(figure, sheet, drawn) -> None:
    """Every recording over time, measured and modelled, on the same axes; the odd one out in its own colour."""
    row = across(len(drawn), sheet.narrow)
    margins = {"top": 32.0, "across": 18.0, "down": 32.0}
    grid = panels(figure, sheet, math.ceil(len(drawn) / row), row, margins, sharex=True, sharey=True).ravel()
    budget = min(columns_for(len(drawn), sheet.columns), sheet.columns // row)
    for k, (axes, one) in enumerate(zip(grid, drawn)):
        line(axes, one.time, one.measured, budget, color=SECOND if one.odd else MEASURED, lw=THIN)
        if one.has_model:
            line(axes, one.time, one.model, budget, color=MODEL, lw=MEDIUM, alpha=0.9)
        _heading(axes, one, 16 if sheet.narrow else 24)
        axes.tick_params(labelbottom=k + row >= len(drawn))
    grid[0].set_xlim(0.0, max(one.time[-1] for one in drawn))
    for axes in grid[len(drawn) :]:
        axes.set_visible(False)
    grid[len(drawn) - 1].set_xlabel(TIME, loc="right")
    grid[0].annotate(FORCE, (0.0, 1.0), (-32.0, 18.0), xycoords="axes fraction", **_OFFSET)


def multiples_height(count: int, narrow: bool) -> float:
    """Height [points] of a drawing of that many small panels."""
    row = across(count, narrow)
    return 40.0 + (100.0 if narrow else 105.0 + 60.0 * (row < 4)) * math.ceil(count / row)


def _heading(axes, one, longest: int) -> None:
    name = file_name(one.fit.file).removesuffix(".csv")
    name = name if len(name) <= longest else f"…{name[1 - longest :]}"
    style = {"xycoords": "axes fraction", "fontsize": TEXT - 1, "color": SECOND if one.odd else INK}
    axes.annotate(f"{one.number}  {visible(name)}", (0.0, 1.0), (0, 4), **style, **_OFFSET)
    if one.odd:
        axes.annotate("odd one out", (1.0, 1.0), (0, -11), ha="right", **style, **_OFFSET)


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
