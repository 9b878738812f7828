# SPDX-License-Identifier: Apache-2.0
"""The figures a fit gives, each with its title and a caption in words."""

from functools import partial

from . import figures, layers, repeats, truth_table, two_pass_figures
from .canvas import BESIDE, FULL, drawing
from .curves import FORCE_SHARE, RESIDUAL_FACTOR, odd_ones, representative
from .markup import Markup, element, join, listing
from .notes import spans
from .numbers import plain
from .words import counted

_MEASURED = element("b", "Measured", class_="measured")
_FORETOLD = (
    "Dashed: the law for an insertion not seen yet, whose ruptures are spread over their scatter between repeats. "
)
_KEY = join([_MEASURED, " thin and grey, ", element("b", "model", class_="model"), " thick and orange. "])


def gallery(fit, drawn) -> Markup:
    """Every figure the fit can fill, in the order of the paper's."""
    one = representative(drawn)
    if one is None:
        return Markup("")
    first = _over_time(one, len(drawn)), _before_puncture(fit, drawn), _two_pass(fit.two_pass)
    over_depth = _over_depth(fit, drawn, one), _layers(fit, one)
    return join([*first, *over_depth, _residuals(fit, drawn), _multiples(fit, drawn)])


def ratio_figure(rows: list[dict]) -> Markup:
    """Identified over true, where a comparison with known truth is given."""
    found = truth_table.ratios(rows)
    if not found:
        return Markup("")
    caption = "With the 95 % interval. Filled dots: the interval misses the truth, a bias of the method."
    draw = partial(truth_table.ratio_figure, rows=found)
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
    its = "its own" if fit.ruptures is None else "the identified"
    every = f"Every repeat from {its} contact on; circles are" if len(shown) > 1 else "From contact on; the circle is"
    caption = join([f"{every} the measured first puncture. ", _law(fit.model)])
    draw = partial(figures.before_puncture, drawn=shown, model=fit.model)
    title = "Stiffness force before the puncture" if fit.ruptures is None else "Force before the first puncture"
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
    line = partial(two_pass_figures.friction, sites=sites)
    options = {"upper_bound": two_pass.upper_bound, "limits": two_pass.cutting_range}
    both = partial(two_pass_figures.both_passes, sites=sites, **options)
    friction = _figure("friction", "Friction", _friction_words(sites), line, (250, 230), beside=True)
    return join([friction, _figure("passes", "Two insertions at one site", _pass_words(two_pass), both, (240, 440))])


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
    counted_from = "each recording's own" if fit.ruptures is None else "the identified"
    population = layers.population_force(fit, one)
    foretold = "" if population is None else _FORETOLD
    said = [_KEY if one.has_model else "", model, foretold, f"Indentation counts from {counted_from} contact."]
    draw = partial(figures.over_depth, drawn=shown, chosen=one, population=population)
    caption = join(said)
    return _figure("depth", "Complete force over depth", caption, draw, (300, 260))


def _layers(fit, one) -> Markup:
    """What each of several layers carries."""
    if fit.ruptures is None or not (fit.model and fit.model.deeper and one.has_model):
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
    draw = partial(repeats.residuals, drawn=shown, rmse=rms)
    return _figure("residuals", "Residuals over depth", caption, draw, (220, 400))


def _multiples(fit, drawn) -> Markup:
    if len(drawn) < 2:
        return Markup("")
    heights = repeats.multiples_height(len(drawn), False), repeats.multiples_height(len(drawn), True)
    caption = join([_KEY if any(one.has_model for one in drawn) else "", _odd_words(odd_ones(fit))])
    draw = partial(repeats.multiples, drawn=drawn)
    return _figure("recordings", "Every recording, on the same axes", caption, draw, heights)


def _odd_words(odd: set[int]) -> str:
    rule = f"a residual above {RESIDUAL_FACTOR:g} times the median"
    rule += f", or a puncture force more than {100 * FORCE_SHARE:.0f}\N{NO-BREAK SPACE}% off it"
    return f"Odd one out (blue): no. {spans(odd)}, with {rule}." if odd else f"None is an odd one out: none has {rule}."
