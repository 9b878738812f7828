# SPDX-License-Identifier: Apache-2.0
"""The report of a campaign: its conditions in a table and as small multiples, and a table of every recording."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..display.axes import FORCE, INDENTATION
from ..display.canvas import MEASURED, MEDIUM, MODEL, QUIET, THICK, THIN, Sheet, axis_names, panels, svg
from ..display.markup import Markup, element, join, listing, table
from ..display.page import Page, Section, note, section
from ..display.quantities import counted
from ..identification.estimates import Estimate
from ..identification.report.tables import MAIN_PARAMETERS
from ..identification.report.words import quantity_name, sentence, status_name
from ..identification.statistics.noise import INTERVAL
from .recording_result import RecordingResult, Trace
from .result import Campaign, Condition, quality_cells

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = ("#0072b2", "#a3428a", "#00735c", "#6a4fb3")  # of anomalies, as in campaign.css
MAX_LINKS = 6  # to recordings, for one reason
SECTIONS = {"conditions": "Conditions", "figures": "Repeats and models", "recordings": "Recordings",
            "reasons": "Reasons", "notes": "Notes"}  # fmt: skip
USED = "repeats used"
UNITS = {"mm_s": "mm/s", "m_s": "m/s", "mm": "mm", "deg": "°", "N": "N", "Hz": "Hz", "s": "s"}  # ends of field names
_CLASS = "cards dense wrap"
PANEL, HEIGHT = Sheet(260.0), 170.0  # of a condition [points]
OFF_AXES_FACTOR = 5.0  # a curve that exceeds the axis by this factor, as in another unit, is not drawn
OWN_SCALE_FACTOR = 8.0  # a panel whose forces are smaller than the others' by this factor has its own scale
MAX_FREE_TRAVEL = 3.0  # [mm] shown before contact
AXIS_MARGIN = 0.04  # of the range, above and below the curves


def campaign_page(campaign: Campaign) -> Page:
    """The report."""
    recordings = counted(len(campaign.recordings), "recording")
    return Page(
        title=f"Needle force: {recordings} under {counted(len(campaign.conditions), 'condition')}",
        kind="campaign",
        outcome=_outcome(campaign),
        sections=_sections(campaign),
        note=_counts_note(campaign),
        style="campaign.css",
    )


def _sections(campaign: Campaign) -> list[Section | None]:
    """The sections; recordings and reasons are numbered."""
    conditions = campaign.conditions
    numbers = {one.file: k for k, one in enumerate(campaign.recordings, 1)}
    files = _by_reason(campaign.recordings)
    reasons = {reason: k for k, reason in enumerate(files, 1)}
    listed = (_listed(reasons[reason], reason, each, numbers) for reason, each in files.items())
    table = (condition_table(conditions), _shared(conditions)) if conditions else ()
    return [
        section(SECTIONS["conditions"], *table, name="conditions"),
        section(SECTIONS["figures"], *_figures(conditions, numbers, reasons), name="figures"),
        section(SECTIONS["recordings"], recording_table(campaign, numbers, reasons), name="recordings"),
        section(SECTIONS["reasons"], listing(listed, class_="reasons"), name="reasons"),
        section(SECTIONS["notes"], listing(campaign.all_notes), name="notes"),
    ]


def _outcome(campaign: Campaign) -> str:
    """The numbers of conditions and recordings by result."""
    every, conditions = campaign.recordings, campaign.conditions
    identified = sum(each.model is not None for each in conditions)
    used, out = sum(one.pooled for one in every), sum(one.left_out for one in every)
    kept = sum(bool(one.anomalies) and not one.left_out for condition in conditions for one in condition.recordings)
    unidentified = sum(not one.has_parameters and not one.left_out for one in every)
    text = [f"{identified} of {counted(len(conditions), 'condition')} identified, from {counted(used, 'recording')}."]
    text += [f"{counted(out, 'anomalous recording')} left out of a pooled fit, each with its reason."] * (out > 0)
    text += [f"{counted(kept, 'anomalous recording')} not left out."] * (kept > 0)
    text += [f"{counted(unidentified, 'recording')} without parameters."] * (unidentified > 0)
    text += [f"{counted(len(campaign.others), 'recording')} without a condition."] * bool(campaign.others)
    return " ".join(text)


def _counts_note(campaign: Campaign) -> str:
    """What the values of a condition are, and that the counts overlap."""
    overlap = "A recording can be in more than one of these counts. " if campaign.others else ""
    values = (
        f"Values of a condition are pooled over the repeats used, with {INTERVAL}s; the panels show its repeats and "
        "the pooled model along the motion of one of them."
    )
    return overlap + values


def _shared(conditions: Sequence[Condition]) -> Markup:
    """The fields that have the same value in all conditions."""
    same = ", ".join(f"{field_name(name)} {value}" for name, value in shared(conditions).items())
    return note(f"The same in all conditions: {same}." if same else "")


def field_name(name: str) -> str:
    """A field of a condition in words, with its unit in brackets: ``speed_mm_s`` is ``speed [mm/s]``."""
    for end, unit in UNITS.items():
        if name.endswith(f"_{end}"):
            return f"{name.removesuffix(f'_{end}').replace('_', ' ')} [{unit}]"
    return name.replace("_", " ")


def _figures(conditions: Sequence[Condition], numbers: dict[str, int], reasons: dict[str, int]) -> tuple:
    """A key, and the panels in a grid as wide as the page."""
    if not conditions:
        return ()
    scale, fields = shared_scale(conditions), varying(conditions)
    key = [element("b", "Repeats", class_="measured"), " thin and grey, ", element("b", "pooled model", class_="model"),
           " thick and orange. Anomalous repeats have other colours and are dashed if left out of the pooled fit. "
           "All panels have the same axes unless stated otherwise. Titles are the fields of the table."]  # fmt: skip
    every = (_figure(k, each, fields, scale, numbers=numbers, reasons=reasons) for k, each in enumerate(conditions, 1))
    return note(join(key), "note before"), element("div", *every, class_="multiples")


def _figure(
    number: int,
    condition: Condition,
    fields: list[str],
    shared_axes: "Scale",
    numbers: dict[str, int],
    reasons: dict[str, int],
) -> Markup:
    """The panel of one condition, with its caption; ``reasons`` have their numbers."""
    own_reasons = _by_reason(condition.recordings)
    colours = {file: k % len(COLOURS) for k, files in enumerate(own_reasons.values()) for file in files}
    own = scale_of(condition, shared_axes)
    name = (
        "\N{NO-BREAK SPACE}· ".join(condition.fields[each] for each in fields if each in condition.fields)
        or "all recordings"
    )
    used = f"{len(condition.pooled)} of {len(condition.recordings)} repeats used"
    used += "; different axes" if own != shared_axes else ""
    used += f". {condition.why}" if condition.why and not own_reasons else ""
    off = [numbers[one.file] for one in condition.recordings if one.shown is not None and not own.holds(one.shown)]
    used += f". Outside the axes: no. {', '.join(map(str, off))}" if off else ""
    listed = (
        join([element("b", *_links(files, numbers), class_=f"c{k % len(COLOURS)}"), ": ", _link(reasons[reason])])
        for k, (reason, files) in enumerate(own_reasons.items())
    )
    caption = element("figcaption", element("p", used), listing(listed, class_="reasons"))
    draw = partial(draw_panel, condition=condition, scale=own, colours=colours)
    image = svg(
        f"condition-{number}", draw, PANEL, HEIGHT, f"Force over indentation: {name}. The values are in the tables."
    )
    return element("figure", element("h3", f"{number}  {name}"), image, caption, id=f"condition-{number}")


def _by_reason(recordings: Iterable[RecordingResult]) -> dict[str, list[str]]:
    """Each reason, with the recordings to which it applies."""
    found: dict[str, list[str]] = {}
    for one in recordings:
        if reason := _reason(one):
            found.setdefault(reason, []).append(one.file)
    return found


def _reason(one: RecordingResult) -> str:
    """Why a recording is anomalous or has no parameters, in words that do not name it: equal ones are stated once."""
    name = Path(one.file)
    return one.why.replace(f"{name}: ", "").replace(f"{name.name}: ", "").replace(f"'{name.stem}'", "its name")


def _link(reason: int) -> Markup:
    """A link to a reason by its number."""
    return element("a", f"reason {reason}", href=f"#reason-{reason}")


def _links(files: list[str], numbers: dict[str, int]) -> tuple[object, ...]:
    """Links to recordings by their numbers."""
    links = [element("a", numbers[file], href=f"#recording-{numbers[file]}") for file in files[:MAX_LINKS]]
    return "No. ", join(links, ", "), f" and {len(files) - MAX_LINKS} more" if len(files) > MAX_LINKS else ""


def _listed(number: int, reason: str, files: list[str], numbers: dict[str, int]) -> Markup:
    """A reason with its number and its recordings."""
    return element(
        "span", element("b", f"{number}."), f" {sentence(reason)} ", *_links(files, numbers), id=f"reason-{number}"
    )


def varying(conditions: Sequence[Condition]) -> list[str]:
    """The fields in which the conditions differ, in their order; all fields of a single condition."""
    names = list(dict.fromkeys(name for condition in conditions for name in condition.fields))
    if len(conditions) < 2:
        return names
    return [name for name in names if len({condition.fields.get(name) for condition in conditions}) > 1]


def shared(conditions: Sequence[Condition]) -> dict[str, str]:
    """The fields that are the same in all conditions."""
    different = varying(conditions)
    return {name: value for name, value in conditions[0].fields.items() if name not in different} if conditions else {}


def condition_table(conditions: Sequence[Condition]) -> Markup:
    """A row for each condition: fields, number of repeats used, main parameters with their intervals."""
    fields = varying(conditions)
    found = [name for name in MAIN_PARAMETERS if any(name in each.parameters for each in conditions)]
    head = ("no.", *map(field_name, fields), USED, "residual / peak", "R²", *map(quantity_name, found))
    return table(head, (_condition(k, each, fields, found) for k, each in enumerate(conditions, 1)), class_=_CLASS)


def _condition(number: int, condition: Condition, fields: list[str], found: list[str]) -> tuple:
    """The row of one condition."""
    values = (condition.parameters.get(name) for name in found)
    used = f"{len(condition.pooled)} of {len(condition.recordings)}" + (": no model" if condition.model is None else "")
    return (
        element("a", number, href=f"#condition-{number}"), *(condition.fields.get(name, "") for name in fields),
        used, *quality_cells(condition.quality), *("" if each is None else _value(each) for each in values),
    )  # fmt: skip


def _value(estimate: Estimate) -> str:
    """A value and its interval, on one line if symmetric."""
    return f"{estimate.doubt}{estimate.shown}".replace(" ± ", "\N{NO-BREAK SPACE}±\N{NO-BREAK SPACE}")


def recording_table(campaign: Campaign, numbers: dict[str, int], reasons: dict[str, int]) -> Markup:
    """Every recording: number, file, condition, status, whether it is in the pooled fit, and the number of the reason
    for an anomaly or for missing parameters."""
    condition_of = {one.file: k for k, condition in enumerate(campaign.conditions, 1) for one in condition.recordings}
    rows = (
        _recording(one, numbers[one.file], condition_of.get(one.file, "none"), reasons.get(_reason(one)))
        for one in campaign.recordings
    )
    return table(("no.", "file", "condition", "status", "used", "reason"), rows, class_=f"{_CLASS} recordings")


def _recording(one: RecordingResult, number: int, condition: object, reason: int | None) -> tuple:
    """The row of one recording."""
    status = status_name(one.status).split(":")[0]
    name = element("span", one.file, class_="file", id=f"recording-{number}")
    used = "yes" if one.pooled else element("em", "left out" if one.left_out else "no")
    return number, name, condition, status, used, _link(reason) if reason else ""


@dataclass(frozen=True)
class Scale:
    """The axes of a panel: indentation from ``left`` to ``right`` [mm], force from ``low`` to ``high`` [N]."""

    left: float
    right: float
    low: float
    high: float

    def holds(self, trace: Trace) -> bool:
        """Whether a curve can be drawn on these axes."""
        depth, size = 1e3 * np.abs(trace.indentation).max(), np.abs(trace.force).max()
        return bool(
            depth <= OFF_AXES_FACTOR * (self.right - self.left) and size <= OFF_AXES_FACTOR * (self.high - self.low)
        )


def shared_scale(conditions: Sequence[Condition]) -> Scale:
    """One scale for all panels, from the pooled recordings and models; without any, from all recordings."""
    pooled = [one.shown for each in conditions for one in each.pooled if one.shown is not None]
    models = [each.shown for each in conditions if each.shown is not None]
    return _scale([*pooled, *models] or [trace for each in conditions for trace in reference_traces(each)])


def scale_of(condition: Condition, shared: Scale) -> Scale:
    """The shared scale, or a different one if the condition's forces are too small for it or exceed it."""
    traces = list(reference_traces(condition))
    own = _scale(traces)
    if traces and not any(map(shared.holds, traces)):
        return own
    if own.high - own.low > (shared.high - shared.low) / OWN_SCALE_FACTOR or not traces:
        return shared
    return Scale(shared.left, shared.right, own.low, own.high)


def reference_traces(condition: Condition) -> Iterator[Trace]:
    """The curves that set the scale: the model, and the recordings not left out, or all if all are left out."""
    drawn = [one for one in condition.recordings if one.shown is not None]
    yield from (one.shown for one in [one for one in drawn if not one.left_out] or drawn)
    yield from () if condition.shown is None else (condition.shown,)


def draw_panel(figure: "Figure", sheet: Sheet, condition: Condition, scale: Scale, colours: dict[str, int]) -> None:
    """Every repeat as a thin line, the model as a thick one; ``colours`` of anomalous repeats are by file."""
    axes = panels(figure, sheet, margins={"left": 34.0})[0, 0]
    axes.set(xlim=(scale.left, scale.right), ylim=(scale.low, scale.high))
    axes.axhline(0.0, color=QUIET, lw=0.6)
    drawn = [one for one in condition.recordings if one.shown is not None and scale.holds(one.shown)]
    for one in sorted(drawn, key=lambda one: one.file in colours):
        _draw_trace(axes, one.shown, **_line_of(one, colours))
    if condition.shown is not None:
        _draw_trace(axes, condition.shown, color=MODEL, lw=THICK, alpha=0.9)
    axes.locator_params(nbins=6)
    axis_names(axes, INDENTATION, FORCE)


def _line_of(one: RecordingResult, colours: dict[str, int]) -> dict[str, Any]:
    """The line of a repeat: grey, or in the colour of its anomaly and dashed if it is left out."""
    if one.file not in colours:
        return {"color": MEASURED, "lw": THIN, "alpha": 0.8}
    return {"color": COLOURS[colours[one.file]], "lw": MEDIUM, "ls": (0, (4, 3)) if one.left_out else "-"}


def _draw_trace(axes: "Axes", trace: Trace, **style: Any) -> None:
    axes.plot(1e3 * trace.indentation, trace.force, **style)


def _scale(traces: Iterable[Trace]) -> Scale:
    """A scale that holds all curves; an arbitrary one without curves."""
    traces = list(traces)
    if not traces:
        return Scale(-1.0, 10.0, -1.0, 1.0)
    left, right = (1e3 * pick(pick(each.indentation) for each in traces) for pick in (min, max))
    low, high = (float(pick(pick(each.force) for each in traces)) for pick in (min, max))
    margin = AXIS_MARGIN * (high - low) or 1.0
    return Scale(max(float(left), -MAX_FREE_TRAVEL), max(float(right), 1e-3), low - margin, high + margin)
