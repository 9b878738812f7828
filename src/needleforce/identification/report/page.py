# SPDX-License-Identifier: Apache-2.0
"""The page of an identification: its headline, its sections in order, and its comparison with known true values."""

import math
from collections.abc import Iterator, Sequence
from functools import partial
from numbers import Real
from typing import TYPE_CHECKING

from ...display.canvas import INK, MODEL, ON_WHITE, QUIET, Sheet, panels
from ...display.markup import Markup, element, join, listing, table
from ...display.page import Figure, Page, Section, note, section
from ...display.quantities import DASH, counted, plain, quantity
from ..result import Fit
from ..settings import LayeredSettings
from ..statistics.noise import INTERVAL
from . import force_figures, repeat_figures, tables
from .curves import anomalous_recordings, repeats, representative
from .words import by_layer, file_name, notes, quantity_name, sentence, status_name

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing

COMPARISON = ("quantity", "paper ± sd", "true", "identified", INTERVAL, "bias")
EVENT_NOTE = (
    "Events have measured forces, and indentations from the detected contact; indentations of a fit are from its "
    "fitted contact."
)


def fit_page(fit: Fit, known: Sequence[dict]) -> Page:
    """The report; ``known`` are true values, as ``Fit.report`` takes them."""
    return Page(
        title=_title(fit), kind=_kind(fit), outcome=outcome(fit), sections=_sections(fit, known), note=which_values(fit)
    )


def _layered(fit: Fit) -> bool:
    return isinstance(fit.settings, LayeredSettings)


def _sections(fit: Fit, known: Sequence[dict]) -> list[Section | None]:
    """The sections in their order; None for those without contents."""
    main, further = _figures(fit)
    measured = "Measured force and model" if fit.identified_model is not None else "Measured force"
    depths = [name for name in fit.parameters if name.endswith("puncture_depth")]
    own = depths if _layered(fit) else tables.MAIN_PARAMETERS
    recordings = tables.recording_table(fit.recordings, own, anomalous_recordings(fit.recordings))
    events = tables.event_table(fit.recordings), note(EVENT_NOTE if fit.identified_model is not None else "")
    return [
        section(measured, *main, name="measured"),
        section("Paper, true and identified values", *(comparison(known) if known else ()), name="comparison"),
        section("Identified parameters", tables.parameter_table(fit.parameters), name="parameters"),
        section("Warnings and notes", warnings(fit), notes(fit.recordings), name="warnings"),
        section("More figures", *further, name="figures"),
        section("Recordings and events", recordings, *events, name="recordings"),
        section("Laws of the model", tables.law_list(fit.model) if fit.identified_model else "", name="model"),
        section("Values held fixed", listing(fit.held_fixed), name="fixed"),
        section("Not identifiable from these recordings", listing(fit.unknown), name="unknown"),
        _choice(fit),
        section("Provenance", tables.provenance(fit.recordings, fit.settings), name="provenance"),
    ]


def _figures(fit: Fit) -> tuple[list[Figure], list[Figure]]:
    """Measured and modelled force over depth, and every other figure for which the fit has data."""
    drawn, anomalous = repeats(fit.recordings, fit.shared_contact), anomalous_recordings(fit.recordings)
    one = representative(drawn)
    if one is None:
        return [], []
    further = [force_figures.over_time(one, len(drawn))]
    if shown := force_figures.touching(drawn):
        title = "Force before the first puncture" if _layered(fit) else "Stiffness force before the puncture"
        shared = fit.shared_contact is not None
        further.append(force_figures.before_puncture(shown, fit.identified_model, shared, title))
    further += repeat_figures.two_pass_figures(fit.two_pass)
    if _layered(fit) and fit.identified_model and fit.model.deeper and one.has_model:
        further.append(force_figures.layers(fit.model, fit.parameters["contact_depth"].value, one))
    further += [*repeat_figures.residuals(drawn, fit.quality), *repeat_figures.multiples(drawn, anomalous)]
    expected = fit.new_insertion(one.fit.recording)
    return [force_figures.over_depth(drawn, one, fit.shared_contact, expected)], further


def _choice(fit: Fit) -> Section | None:
    """The choice of layers and mechanisms of a layered fit, otherwise the choice of the stiffness law."""
    if isinstance(fit.settings, LayeredSettings):
        return section("Choice of layers and mechanisms", tables.evidence_table(fit.settings), name="choice")
    return section("Choice of the stiffness law", tables.choice_table(fit.choice), name="choice")


def _title(fit: Fit) -> str:
    """The file name of one recording, the number of several."""
    names = [file_name(one.file) for one in fit.recordings]
    return f"Needle force: {names[0] if len(names) == 1 else counted(len(names), 'recording')}"


def _kind(fit: Fit) -> str:
    """The line above the title: number of recordings, and model."""
    law = "" if fit.identified_model is None else fit.model.stiffness.name.replace("_", " ")
    model = f"stiffness law {law}" if law else "no model"
    model = f"layered, {counted(len(fit.model.layers), 'layer')}" if _layered(fit) else model
    return f"{counted(len(fit.recordings), 'recording')} · {model}"


def outcome(fit: Fit) -> Markup:
    """The result in a sentence or two, with the main values."""
    answered = sum(1 for one in fit.recordings if len(one.predicted))
    if fit.identified_model is None:
        reasons = ", ".join(sorted({status_name(one.status).split(":")[0] for one in fit.recordings}))
        read = counted(len(fit.recordings), "recording")
        return join([f"No model could be identified from {read}", f" ({reasons})." if reasons else "."])
    parts = (_layers(fit),) if _layered(fit) else (_puncture(fit), _beyond(fit))
    found = join([part for part in parts if part], "; ") or "a model was identified"
    found = Markup(found[0].upper() + found[1:] + ". ")
    return join([found, _quality(fit, answered)])


def which_values(fit: Fit) -> str:
    """Why values of the headline differ from those in tables and figures; empty without a model."""
    if fit.identified_model is None:
        return ""
    if _layered(fit):
        contact = fit.parameters["contact_depth"]
        known = "" if contact.identifiable else ", which is not identifiable here"
        return (
            f"The depths above, in the order of the layers, are relative to the fitted contact depth{known}; depths in "
            "the tables are in the zero of the recordings. Events are detected punctures, not ruptures of layers."
        )
    several, peak = len(fit.recordings) > 1, fit.parameters.get("puncture_force")
    means = "The values above are means over the repeats; t" if several else "T"
    own = "he table of recordings has each recording's own fit" + ", without the second pass" * bool(fit.two_pass) + "."
    force = " The puncture force is measured just before the puncture; the model's force there can differ."
    measured = peak is not None and peak.source.startswith("measured")
    return (means + own) * (several or bool(fit.two_pass)) + force * measured


def _puncture(fit: Fit) -> Markup | None:
    """Indentation and force at the puncture, as far as they are identified."""
    depth, force = _strong(fit, "puncture_indentation"), _strong(fit, "puncture_force")
    if depth and force:
        return join(["the needle punctures the surface at a force of ", force, " and an indentation of ", depth])
    if depth or force:
        return join(["the needle punctures the surface at ", depth or force])
    return None


def _layers(fit: Fit) -> Markup:
    """The number of layers, and the depths of their ruptures, which the recordings may not have reached."""
    surface, layers = fit.parameters["contact_depth"].value, by_layer(fit.parameters)
    broken = [e["puncture_depth"] for e in layers.values() if "puncture_depth" in e]
    known = [e for e in broken if e.identifiable]
    depths = [quantity(e.value - surface, e.low - surface, e.high - surface, e.unit, max_digits=4).text for e in known]
    count = len(fit.model.layers)
    sentence = [element("strong", counted(count, "layer")), " of tissue" + ", whose forces add up" * (count > 1)]
    if known:
        *first, last = (element("strong", depth) for depth in depths)
        where = join([join(first, ", "), " and " * bool(first), last])
        some = "one of them ruptures" if len(known) == 1 else f"{len(known)} of them rupture"
        which = "it ruptures" if count == 1 else "they rupture" if len(known) == count else some
        sentence += [f"; {which} with the tip ", where, " below the surface"]
    return join(sentence)


def _beyond(fit: Fit) -> Markup | None:
    """Friction and cutting force after the puncture, as far as they are identified."""
    friction, cutting = _strong(fit, "friction_per_length"), _strong(fit, "cutting_force")
    found = [join(["the friction per embedded length is ", friction])] if friction else []
    found += [join(["the cutting force is ", cutting])] if cutting else []
    source = " (both from the two passes)" if len(found) == 2 else " (from the two passes)"
    return join([join(found, " and "), source if fit.two_pass is not None else ""]) if found else None


def _quality(fit: Fit, answered: int) -> Markup:
    """The residual of the model, over the recordings that have one."""
    count = f"{answered} of " * (answered < len(fit.recordings)) + counted(len(fit.recordings), "recording")
    if fit.quality is None:
        return join(["Identified from ", count, "."])
    rms, share = plain(fit.quality.rmse_N, "N", fit.quality.rmse_N), f"{100 * fit.quality.nrmse:.2g}\N{NO-BREAK SPACE}%"
    text = f"The residual of the model over {count} is "
    parts = [plain(part, "N", fit.quality.rmse_N) for part in (fit.quality.sliding_N, fit.quality.reversal_N)]
    split = f": {parts[0]} where the needle slides, {parts[1]} in the reversal of friction"
    split = "" if math.isnan(fit.quality.reversal_N) else split
    return join([text, element("strong", rms), f" rms, {share} of the peak force{split}."])


def _strong(fit: Fit, name: str) -> Markup | None:
    """The value of an estimate in bold, or None if it is not identifiable."""
    estimate = fit.parameters.get(name)
    if estimate is None or not estimate.identifiable:
        return None
    return element("strong", quantity(estimate.value, estimate.low, estimate.high, estimate.unit, max_digits=4).text)


def warnings(fit: Fit) -> Markup:
    """Recordings without a model, with the reason; limits that the fit and its model exceed."""
    general = dict.fromkeys([*fit.warnings, *(fit.model.warnings if fit.identified_model is not None else ())])
    found = [*_unanswered(fit), *map(sentence, general)]
    return listing(found, class_="warnings")


def _unanswered(fit: Fit) -> Iterator[Markup]:
    """Every recording without a model, with the reason."""
    for k, one in enumerate(fit.recordings, 1):
        if not len(one.predicted):
            reason = status_name(one.status) if str(one.status) != "ok" else "not used for the model"
            yield join([element("strong", f"Recording {k} has no model. "), f"{file_name(one.file)}: {reason}."])


def comparison(rows: Sequence[dict]) -> list[object]:
    """The table, and the figure if true values are known."""
    found = ratios(rows)
    caption = f"Lines are {INTERVAL}s. Filled dots: the interval excludes the true value, a bias of the method."
    title = "Identified value over true value"
    heights = 44.0 + 22.0 * len(found), 44.0 + 34.0 * len(found)
    draw = partial(ratio_figure, rows=found)
    figure = force_figures.titled("ratio", title, caption, draw, heights) if found else ""
    return [table(COMPARISON, (_row(row) for row in rows), class_="cards numbers tight"), figure]


def ratios(rows: Sequence[dict]) -> list[tuple[str, float, float, float]]:
    """Name, and identified value with its limits over the true value, of the rows that have both."""
    known = (row for row in rows if number(row.get("true")) and number(row.get("identified")))
    keys = ("identified", "low", "high")
    return [(quantity_name(row["quantity"]), *(_over(row, key) for key in keys)) for row in known]


def ratio_figure(figure: "Drawing", sheet: Sheet, rows: list[tuple[str, float, float, float]]) -> None:
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
    return value / row["true"] if number(value) and row["true"] else math.nan
