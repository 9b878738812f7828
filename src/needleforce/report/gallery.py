# SPDX-License-Identifier: Apache-2.0
"""The figures of a fit with titles and captions: measured and modelled force, residuals, recordings, two passes."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..display.markup import Markup, element, join, listing
from ..display.quantities import counted, plain
from ..identification.layered.result import LayeredFit
from ..identification.result import Fit
from ..identification.statistics.noise import INTERVAL
from ..identification.two_pass.result import Site, TwoPass
from ..models.model import Model
from . import figures, layers, tables
from .canvas import (
    FULL,
    MEASURED,
    MODEL,
    QUIET,
    SECOND,
    SLATE,
    TEXT,
    THICK,
    THIN,
    WITH_SIDE_CAPTION,
    Labels,
    Sheet,
    axis_names,
    drawing,
    panels,
)
from .curves import FORCE_SHARE, RESIDUAL_FACTOR, DrawnRepeat, anomalous_recordings, binned, columns_for, representative
from .figures import DEPTH, FORCE, OFFSET, line, repeat_style
from .words import spans

_MEASURED = element("b", "Measured", class_="measured")
_POPULATION = "Dashed: prediction for a new insertion, its ruptures distributed over their scatter between repeats. "
_KEY = join([_MEASURED, " thin and grey, ", element("b", "model", class_="model"), " thick and orange. "])
RESIDUAL = "measured − model [N]"


def main_figure(fit: Fit, drawn: tuple[DrawnRepeat, ...]) -> Markup:
    """Measured and modelled force over depth; empty without a drawable recording."""
    one = representative(drawn)
    return Markup("") if one is None else _over_depth(fit, drawn, one)


def gallery(fit: Fit, drawn: tuple[DrawnRepeat, ...]) -> Markup:
    """Every other figure for which the fit has data."""
    one = representative(drawn)
    if one is None:
        return Markup("")
    first = _over_time(one, len(drawn)), _before_puncture(fit, drawn), _two_pass(fit.two_pass)
    return join([*first, _layers(fit, one), _residuals(fit, drawn), _multiples(fit, drawn)])


def ratio_figure(rows: list[dict]) -> Markup:
    """Identified over true value, if the true values are known."""
    found = tables.ratios(rows)
    if not found:
        return Markup("")
    caption = f"Lines are {INTERVAL}s. Filled dots: the interval excludes the true value, a bias of the method."
    draw = partial(tables.ratio_figure, rows=found)
    heights = 44.0 + 22.0 * len(found), 44.0 + 34.0 * len(found)
    return _figure("ratio", "Identified value over true value", caption, draw, heights)


def _figure(
    name: str, title: str, caption: object, draw: Callable, heights: tuple[float, float], side_caption: bool = False
) -> Markup:
    """A figure with its title and caption; a side caption is next to the drawing on a wide page."""
    alt = f"{title}. The values are in the tables of this page."
    image = drawing(name, draw, heights, alt, WITH_SIDE_CAPTION if side_caption else FULL)
    parts = element("h3", title), element("div", image, class_="drawing"), element("figcaption", caption)
    return element("figure", *parts, class_="side-caption" if side_caption else None, id=f"figure-{name}")


def _over_time(one: DrawnRepeat, among: int) -> Markup:
    """Force over time of the recording with the median residual."""
    which = f"Recording {one.number}, the one with the median residual. " if among > 1 and one.has_model else ""
    bands = "Bands are phases; circles are the detected events with their measured force."
    caption = join([which, _KEY if one.has_model else "", bands])
    return _figure("time", "Force over time", caption, partial(figures.over_time, one=one), (280, 240))


def _before_puncture(fit: Fit, drawn: Sequence[DrawnRepeat]) -> Markup:
    """Force before the puncture of every repeat, and of the model."""
    shown = tuple(one for one in drawn if one.fit.events.contact is not None)
    if not shown:
        return Markup("")
    contact = "the identified" if fit.shared_contact is not None else "its own"
    start = f"Every repeat from {contact} contact; circles are" if len(shown) > 1 else "From contact; the circle is"
    caption = join([f"{start} the first puncture as measured. ", _law(fit.model)])
    draw = partial(figures.before_puncture, drawn=shown, model=fit.model)
    layered = isinstance(fit, LayeredFit)
    title = "Force before the first puncture" if layered else "Stiffness force before the puncture"
    return _figure("stiffness", title, caption, draw, (250, 230), side_caption=True)


def _law(model: Model | None) -> str:
    """What the model's curve before the puncture is."""
    if model is None:
        return ""
    layers_sum = "The model is the sum of the layers that the tip has reached, at the mean speed."
    summary = layers_sum if model.deeper else model.stiffness.summary
    return f"{summary} The model's curve ends at the identified puncture."


def _two_pass(two_pass: TwoPass | None) -> Markup:
    """Friction of the second pass, and the difference of the two passes."""
    if two_pass is None or not two_pass.sites:
        return Markup("")
    sites = two_pass.sites
    lines = partial(friction, sites=sites)
    options = {"upper_bound": two_pass.upper_bound, "limits": two_pass.cutting_range}
    both = partial(both_passes, sites=sites, **options)
    slopes = _figure("friction", "Friction", _friction_words(sites), lines, (250, 230), side_caption=True)
    return join([slopes, _figure("passes", "Two insertions at one site", _pass_words(two_pass), both, (240, 440))])


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
    return join([words, listing(two_pass.biases) if two_pass.biases else ""])


def _over_depth(fit: Fit, drawn: Sequence[DrawnRepeat], one: DrawnRepeat) -> Markup:
    """Force over depth of every repeat, and of the model along ``one``."""
    shown = tuple(each for each in drawn if each.fit.events.contact is not None) or (one,)
    model = f"The model follows the motion of recording {one.number}. " if len(shown) > 1 and one.has_model else ""
    shared = fit.shared_contact is not None
    identified = shared or "contact_depth" in one.fit.parameters
    contact = f"the {'identified' if identified else 'detected'} contact"
    contact += "" if shared or len(shown) == 1 else " of each recording"
    population = layers.population_force(fit, one)
    dashed = "" if population is None else _POPULATION
    words = [_KEY if one.has_model else "", model, dashed, f"Indentation is measured from {contact}."]
    draw = partial(figures.over_depth, drawn=shown, chosen=one, population=population)
    caption = join(words)
    return _figure("depth", "Force over depth, insertion and withdrawal", caption, draw, (300, 260))


def _layers(fit: Fit, one: DrawnRepeat) -> Markup:
    """The force of each of several layers."""
    if not isinstance(fit, LayeredFit) or not (fit.model and fit.model.deeper and one.has_model):
        return Markup("")
    caption = f"Force of each layer along the motion of recording {one.number}; their sum is the model. Grey: measured."
    draw = partial(layers.layer_force_figure, one=one, forces=layers.layer_forces(fit, one))
    return _figure("layers", "Force of each layer", caption, draw, (260, 240))


def _residuals(fit: Fit, drawn: Sequence[DrawnRepeat]) -> Markup:
    """Residuals over depth; empty without a model."""
    shown = tuple(one for one in drawn if one.has_model)
    if not shown or fit.quality is None:
        return Markup("")
    rms = fit.quality.rmse_N
    lines = (
        "Lines: mean residual of each repeat at each depth" if len(shown) > 1 else "Line: mean residual at each depth"
    )
    among = " without anomalous recordings" if any(one.anomalous for one in shown) else ""
    band = f"Orange band: ± the rms residual, {plain(rms, 'N', rms)}."
    caption = f"{lines}. Grey: range of all samples{among}. {band}"
    draw = partial(residuals, drawn=shown, rmse=rms)
    return _figure("residuals", "Residuals over depth", caption, draw, (220, 400))


def _multiples(fit: Fit, drawn: Sequence[DrawnRepeat]) -> Markup:
    """Every recording over time; empty with fewer than two."""
    if len(drawn) < 2:
        return Markup("")
    heights = figures.multiples_height(len(drawn), False), figures.multiples_height(len(drawn), True)
    caption = join([_KEY if any(one.has_model for one in drawn) else "", _anomaly_words(anomalous_recordings(fit))])
    draw = partial(figures.multiples, drawn=drawn)
    return _figure("recordings", "Every recording, on the same axes", caption, draw, heights)


def _anomaly_words(anomalous: set[int]) -> str:
    """Which recordings are anomalous, and by which rule."""
    rule = f"a residual above {RESIDUAL_FACTOR:g} times the median"
    rule += f", or a puncture force more than {100 * FORCE_SHARE:.0f}\N{NO-BREAK SPACE}% from the median"
    named = f"Anomalous (blue): no. {spans(anomalous)}, with {rule}."
    return named if anomalous else f"No recording is anomalous: none has {rule}."


def residuals(figure: Figure, sheet: Sheet, drawn: Sequence[DrawnRepeat], rmse: float) -> None:
    """Measured minus modelled force over indentation, a panel for each stroke, with a band of ± the rms residual."""
    rows, columns = (2, 1) if sheet.narrow else (1, 2)
    both = panels(figure, sheet, rows, columns, sharex=True, sharey=True).ravel()
    edges = np.linspace(0.0, max(one.indentation.max() for one in drawn), 141)
    for axes, name, stroke in zip(both, ("insertion", "withdrawal"), ("inward", "outward")):
        axes.axhspan(-rmse, rmse, color=MODEL, alpha=0.2, lw=0)
        _bins(axes, drawn, stroke, edges)
        axes.axhline(0.0, color=MODEL, lw=1.0)
        axes.tick_params(labelbottom=True, labelleft=True)
        axis_names(axes, DEPTH, RESIDUAL)
        axes.annotate(name, (1.0, 1.0), (0, 8), xycoords="axes fraction", ha="right", color=QUIET, **OFFSET)
    place = {"xycoords": both[-1].get_yaxis_transform(), **OFFSET}
    both[-1].annotate("± rms", (1.0, rmse), (-2, 1), ha="right", color=MODEL, fontsize=TEXT - 1, **place)


def _bins(axes: Axes, drawn: Sequence[DrawnRepeat], stroke: str, edges: np.ndarray) -> None:
    """The mean residual of each repeat at each depth as a line, over the grey range of all samples of all repeats."""
    found = [binned(one.indentation[getattr(one, stroke)], one.residual[getattr(one, stroke)], edges) for one in drawn]
    middle = 0.5 * (edges[1:] + edges[:-1])
    normal = [bins for one, bins in zip(drawn, found) if not one.anomalous] or found
    low, high = np.fmin.reduce([low for _, low, _ in normal]), np.fmax.reduce([high for _, _, high in normal])
    axes.fill_between(middle, low, high, color="#d9dcdf", lw=0)
    for one, (mean, _, _) in zip(drawn, found):
        line(axes, middle, mean, len(middle), **repeat_style(one, len(drawn)))


def middle_site(sites: Sequence[Site]) -> Site:
    """The site with the median cutting force."""
    return sorted(sites, key=lambda site: site.cutting)[(len(sites) - 1) // 2]


def friction(figure: Figure, sheet: Sheet, sites: Sequence[Site]) -> None:
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
    axis_names(axes, DEPTH, FORCE)
    window = np.full(2, 1e3 * end), axes.get_ylim()
    labels = Labels(axes, [*curves, *beyond, window])
    labels.on(f"{'mean ' if len(sites) > 1 else ''}line: {plain(slope, 'N/m')}", *curves[-1], MODEL)
    labels.on("second pass", *curves[0], SECOND)
    labels.on("end of the window", *window, QUIET)


def _inside(site: Site) -> np.ndarray:
    """True for the samples from the surface to the end of the window; the others are not used and drawn in grey."""
    return (site.friction_depth >= 0.0) & (site.friction_depth <= site.friction_end)


def both_passes(
    figure: Figure,
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
    axis_names(axes, DEPTH, FORCE)
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
    axis_names(axes, DEPTH, "first − second [N]")
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
