# SPDX-License-Identifier: Apache-2.0
"""The tables of a fit: parameters, laws, recordings and events; and the comparison with known true values."""

import math
from collections.abc import Iterable, Iterator
from numbers import Real

import numpy as np
from matplotlib.figure import Figure

from ..display.markup import Markup, element, join, listing, table
from ..display.quantities import DASH, Quantity, percent, plain, quantity, with_unit
from ..identification.estimates import Estimate
from ..identification.layered.result import LayeredFit
from ..identification.recording_fit import RecordingFit
from ..identification.result import Choice, Fit
from ..identification.statistics.noise import INTERVAL
from ..models.model import Model
from .canvas import INK, MODEL, ON_WHITE, QUIET, Sheet, panels
from .words import by_layer, file_name, quantity_name, status_name

PARAMETERS = (
    *("quantity", f"value and {INTERVAL}", "sd between repeats", "error within a run (sd)", "identifiable"),
    "how obtained",
)
EVENTS = ("no.", "event", "time", "depth", "indentation", "force", "drop", "between samples")
OMITTED_LAWS = ("no_relaxation",)
MAX_NORMAL_SIZE_ROWS = 6  # tables with more recordings have smaller text
MAIN_PARAMETERS = ("puncture_indentation", "puncture_force", "friction_per_length", "cutting_force")
COMPARISON = ("quantity", "paper ± sd", "true", "identified", INTERVAL, "bias")


def parameter_table(parameters: dict[str, Estimate]) -> Markup:
    """Every estimate with its interval, its scatter between repeats and its source; a table for each layer."""
    sources = {estimate.source for estimate in parameters.values()}
    common = sources.pop() if len(sources) == 1 and len(parameters) > 1 else None
    note = element("p", f"How obtained: {common}.", class_="note") if common else ""
    return join([*(_of_layer(*each, common) for each in by_layer(parameters).items()), note])


def _of_layer(layer: str, parameters: dict[str, Estimate], common: str | None) -> Markup:
    """A table under the name of its layer; a source common to all estimates is not in the rows."""
    rows = [_parameter(name, estimate, common) for name, estimate in parameters.items()]
    heading = element("h3", layer.capitalize()) if layer else ""
    return join([heading, table(PARAMETERS, rows, class_="cards numbers parameters" + " layer" * bool(layer))])


def _parameter(own_name: str, estimate: Estimate, common: str | None) -> tuple:
    """The row of one estimate."""
    shown = quantity(estimate.value, estimate.low, estimate.high, estimate.unit)
    value = element("strong", shown.text) if not shown.interval else join(_value_and_interval(shown))
    name = join([quantity_name(own_name), element("code", estimate.name)])
    spreads = (
        _spread(estimate.value, sd, estimate.unit) for sd in (estimate.between_repeats_sd, estimate.within_run_sd)
    )
    identifiable = "yes" if estimate.identifiable else element("em", "no")
    return name, value, *spreads, identifiable, "" if common else estimate.source


def _spread(value: float, spread: float | None, unit: str) -> Markup | str:
    """The scatter, in the unit of its value."""
    if spread is None:
        return ""
    shown = quantity(value, value - spread, value + spread, unit)
    return element("span", with_unit(shown.half_width, shown.unit) if shown.half_width else DASH, class_="spread")


def _value_and_interval(shown: Quantity) -> tuple:
    """Value in bold and interval; for an infinite value only its interval."""
    if "∞" in shown.value:
        return (element("strong", with_unit(shown.low, shown.unit) + f" to {shown.high}"),)
    if shown.symmetric:
        return element("strong", shown.value), f" ± {with_unit(shown.half_width, shown.unit)}"
    return element("strong", shown.text), element("span", f" ({shown.interval})", class_="interval")


def law_list(model: Model) -> Markup:
    """The laws of the identified model with their summaries and sources, each once for all layers."""
    laws = {
        law.name: (law.family, law) for layer in model.layers for law in layer.parts if law.name not in OMITTED_LAWS
    }
    named = ((f"{family.capitalize()}: {law.name.replace('_', ' ')}.", law) for family, law in laws.values())
    return listing(join([element("strong", name), f" {law.summary} ({law.source})"]) for name, law in named)


def choice_table(choice: Iterable[Choice]) -> Markup:
    """The stiffness laws compared, the best first, with their BIC and its difference from the lowest."""
    ranked = sorted(choice, key=lambda each: each.bic)
    if not ranked:
        return Markup("")
    best, shown = ranked[0].bic, any(not math.isnan(each.puncture_ratio) for each in ranked)
    rows = (
        (
            each.name.replace("_", " "),
            f"{each.bic:.1f}".replace("-", "−"),
            _above(each.bic - best),
            *[percent(each.puncture_ratio)] * shown,
        )
        for each in ranked
    )
    head = ("stiffness law", "BIC", "above the lowest", *["modelled over measured puncture force"] * shown)
    return table(head, rows, class_="numbers small")


def _above(difference: float) -> object:
    """A BIC above the lowest."""
    return element("strong", "best") if difference == 0.0 else f"+{difference:.1f}"


def recording_table(fit: Fit, anomalous: set[int]) -> Markup:
    """Every file with its status, the parameters of its own fit, and the residual."""
    layered = isinstance(fit, LayeredFit)
    names = [name for name in fit.parameters if name.endswith("puncture_depth")] if layered else MAIN_PARAMETERS
    own = [name for name in names if any(name in one.parameters for one in fit.recordings)]
    head = ("no.", "file", "status", *(quantity_name(name) for name in own), "rms residual", "R²")
    rows = (_recording(k, one, own, k in anomalous) for k, one in enumerate(fit.recordings, 1))
    return table(head, rows, class_="cards numbers" + " dense" * (len(fit.recordings) > MAX_NORMAL_SIZE_ROWS))


def _recording(number: int, one: RecordingFit, own: list[str], anomalous: bool) -> tuple:
    """The row of one recording."""
    status = [status_name(one.status)] + ([element("em", "; anomalous")] if anomalous else [])
    values = (one.parameters.get(name) for name in own)
    quality = one.quality
    return (
        number, element("span", file_name(one.file), class_="file"), join(status),
        *(_value(e) for e in values),
        *(("", "") if quality is None else (plain(quality.rmse_N, "N", quality.rmse_N), f"{quality.r2:.4f}")),
    )  # fmt: skip


def _value(estimate: Estimate | None) -> str:
    """A value of a recording's own fit; a puncture that it did not reach has none."""
    if estimate is None:
        return ""
    reached = estimate.identifiable or not estimate.name.endswith("puncture_depth")
    return quantity(estimate.value, estimate.low, estimate.high, estimate.unit).text if reached else "not reached"


def event_table(fit: Fit) -> Markup:
    """Contact, punctures and exit of every recording."""
    rows = [row for k, one in enumerate(fit.recordings, 1) for row in _events(k, one)]
    return table(EVENTS, rows, class_="cards numbers dense") if rows else Markup("")


def _events(number: int, one: RecordingFit) -> Iterator[tuple]:
    """The rows of the events of one recording."""
    events = one.events
    surface = events.contact.depth if events.contact is not None else None
    named = (("contact", events.contact), *(("puncture", p) for p in events.punctures), ("exit", events.exit))
    for k, (name, event) in enumerate(pair for pair in named if pair[1] is not None):
        indentation = None if surface is None else event.depth - surface
        yield (
            "" if k else number, name, _milli(event.time, "s"), _milli(1e3 * event.depth, "mm"),
            "" if indentation is None else _milli(1e3 * indentation, "mm"), _milli(event.force, "N"),
            _milli(event.drop, "N") if hasattr(event, "drop") else "", f"{event.low}–{event.high}",
        )  # fmt: skip


def _milli(value: float, unit: str) -> str:
    """A value with three decimals: milliseconds, micrometres and millinewtons, finer than the sensors resolve."""
    return f"{value:.3f}\N{NO-BREAK SPACE}{unit}".replace("-", "−")


def comparison_table(rows: list[dict]) -> Markup:
    """Quantity, paper ± sd, true value, identified value with its interval, and bias in per cent of the true value."""
    return table(COMPARISON, (_row(row) for row in rows), class_="cards numbers tight")


def ratios(rows: list[dict]) -> list[tuple[str, float, float, float]]:
    """Name, and identified value with its limits over the true value, of the rows that have both."""
    known = (row for row in rows if number(row.get("true")) and number(row.get("identified")))
    keys = ("identified", "low", "high")
    return [(quantity_name(row["quantity"]), *(_over(row, key) for key in keys)) for row in known]


def ratio_figure(figure: Figure, sheet: Sheet, rows: list[tuple[str, float, float, float]]) -> None:
    """Identified over true value, a dot with its interval for each quantity; 1 is the true value."""
    margins = {"top": 4.0, "left": 8.0 if sheet.narrow else 190.0, "right": 44.0}
    axes = panels(figure, sheet, margins=margins)[0, 0]
    axes.axvline(1.0, color=QUIET, lw=0.9)
    for k, (name, value, low, high) in enumerate(rows):
        includes_true = low <= 1.0 <= high
        axes.plot([low, high], [-k, -k], color=INK, lw=1.4, solid_capstyle="butt")
        axes.plot([value], [-k], "o", ms=5.5, mec=MODEL, mfc="white" if includes_true else MODEL, mew=1.4)
        place = {"xycoords": axes.get_yaxis_transform(), "textcoords": "offset points"}
        on_white = ON_WHITE if sheet.narrow else None
        axes.annotate(name, (0.0, -k), (0, 7) if sheet.narrow else (-190, -3), bbox=on_white, **place)
        axes.annotate(_percent(value), (1.0, -k), (40, -3), ha="right", color=INK if includes_true else MODEL, **place)
    far = max((abs(x - 1.0) for _, *values in rows for x in values if math.isfinite(x)), default=0.1)
    axes.set_xlim(1.0 - 1.1 * far, 1.0 + 1.1 * far)
    axes.set_ylim(0.4 - len(rows), 0.9)
    axes.set_yticks([])
    axes.grid(True, axis="x")
    axes.spines["left"].set_visible(False)
    axes.set_xlabel("identified / true [1]", loc="right")


def number(value: object) -> bool:
    """Whether a cell has a finite number, neither None nor text such as "not yet"."""
    return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)


def _row(row: dict) -> tuple:
    """One row of the comparison with known true values."""
    value, unit = row.get("identified"), row.get("unit", "")
    found = quantity(value, *_limits(row), unit) if number(value) else None
    like = _half(row)
    return (
        quantity_name(row["quantity"]), _paper(row), _cell(row.get("true"), unit, like),
        element("strong", found.text) if found else _cell(value, unit, None),
        found.interval if found else "", _bias(row),
    )  # fmt: skip


def _limits(row: dict) -> tuple:
    """Limits of the interval; None if unknown."""
    return tuple(row.get(key) if number(row.get(key)) else None for key in ("low", "high"))


def _half(row: dict) -> float | None:
    """Half width of the interval, or None without one."""
    low, high = _limits(row)
    return None if low is None or high is None else 0.5 * (high - low)


def _cell(value: object, unit: str, half: float | None) -> str:
    """A number with the digits that the interval supports; text unchanged; a dash for None."""
    if not number(value):
        return DASH if value is None or isinstance(value, float) else str(value)
    limits = (None, None) if half is None else (value - half, value + half)
    return quantity(value, *limits, unit).text


def _paper(row: dict) -> str:
    """The paper's value and its standard deviation."""
    value, spread, unit = row.get("paper"), row.get("paper_sd"), row.get("unit", "")
    if number(value) and number(spread) and spread > 0:
        return str(quantity(value, value - spread, value + spread, unit))
    return _cell(value, unit, None)


def _bias(row: dict) -> str:
    """Identified minus true value in per cent of the true value; empty without both."""
    true, value = row.get("true"), row.get("identified")
    if not (number(true) and number(value)) or true == 0.0:
        return ""
    return _percent(value / true)


def _percent(ratio: float) -> str:
    """A ratio as its signed difference from 1 in per cent."""
    percent = round(100.0 * (ratio - 1.0), 1) or 0.0  # no minus before a zero
    return f"{percent:+.1f}\N{NO-BREAK SPACE}%".replace("-", "−")


def _over(row: dict, key: str) -> float:
    """A value of the row over the true value."""
    value = row.get(key)
    return value / row["true"] if number(value) and row["true"] else np.nan
