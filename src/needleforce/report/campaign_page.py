# SPDX-License-Identifier: Apache-2.0
"""The report of a campaign: its conditions in a table and as small multiples, and a table of every recording."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..campaign.recording_result import RecordingResult
from ..campaign.result import Campaign, Condition, quality_cells
from ..campaign.summary import Trace
from ..display.markup import Markup, Section, element, escape, join, listing, section, table
from ..display.quantities import counted, quantity
from ..identification.estimates import Estimate
from ..identification.statistics.noise import INTERVAL
from ..vocabulary import __version__
from .frame import framed
from .tables import MAIN_PARAMETERS
from .words import quantity_name, status_name

N_COLOURS = 4  # of anomalies, as in campaign.css
MAX_LINKS = 6  # to recordings, for one reason in a caption
SECTIONS = {"conditions": "Conditions", "figures": "Repeats and models", "recordings": "Recordings", "notes": "Notes"}
USED = "repeats used"
UNITS = {"mm_s": "mm/s", "m_s": "m/s", "mm": "mm", "deg": "°", "N": "N", "Hz": "Hz", "s": "s"}  # ends of field names
_CLASS = "cards dense wrap"
WIDTH, HEIGHT = 300.0, 190.0
LEFT, RIGHT, TOP, BOTTOM = 30.0, 4.0, 16.0, 28.0
OFF_AXES_FACTOR = 5.0  # a curve that exceeds the axis by this factor, as in another unit, is not drawn
OWN_SCALE_FACTOR = 8.0  # a panel whose forces are smaller than the others' by this factor has its own scale
MAX_FREE_TRAVEL = 3.0  # [mm] shown before contact
AXIS_MARGIN = 0.04  # of the range, above and below the curves


def campaign_page(campaign: Campaign, title: str | None = None) -> str:
    """The report as HTML text."""
    numbers = {one.file: k for k, one in enumerate(campaign.recordings, 1)}
    kicker = f"needleforce {__version__} · campaign"
    sections = _sections(campaign, numbers)
    summary, note = _outcome(campaign), _counts_note(campaign)
    return framed(title or _title(campaign), kicker, summary, sections, note=note, styles=("campaign.css",))


def _sections(campaign: Campaign, numbers: dict[str, int]) -> list[Section | None]:
    """The sections; ``numbers`` are those of the recordings by file."""
    conditions = campaign.conditions
    table = (condition_table(conditions), _shared(conditions)) if conditions else ()
    return [
        section(SECTIONS["conditions"], *table, name="conditions"),
        section(SECTIONS["figures"], *_figures(conditions, numbers), name="figures"),
        section(SECTIONS["recordings"], recording_table(campaign, numbers), name="recordings"),
        section(SECTIONS["notes"], listing(campaign.all_notes) if campaign.all_notes else "", name="notes"),
    ]


def _title(campaign: Campaign) -> str:
    """The numbers of recordings and conditions."""
    conditions = counted(len(campaign.conditions), "condition")
    return f"Needle force: {counted(len(campaign.recordings), 'recording')} under {conditions}"


def _outcome(campaign: Campaign) -> Markup:
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
    return join(text, " ")


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
    return element("p", f"The same in all conditions: {same}.", class_="note") if same else Markup("")


def field_name(name: str) -> str:
    """A field of a condition in words, with its unit in brackets: ``speed_mm_s`` is ``speed [mm/s]``."""
    for end, unit in UNITS.items():
        if name.endswith(f"_{end}"):
            return f"{name.removesuffix(f'_{end}').replace('_', ' ')} [{unit}]"
    return name.replace("_", " ")


def _figures(conditions: Sequence[Condition], numbers: dict[str, int]) -> tuple:
    """A key, and the panels in a grid as wide as the page."""
    if not conditions:
        return ()
    scale, fields = shared_scale(conditions), varying(conditions)
    key = [element("b", "Repeats", class_="measured"), " thin and grey, ", element("b", "pooled model", class_="model"),
           " thick and orange. Anomalous repeats have other colours and are dashed if left out of the pooled fit. "
           "All panels have the same axes unless stated otherwise. Titles are the fields of the table."]  # fmt: skip
    every = (_figure(k, each, fields, scale, numbers) for k, each in enumerate(conditions, 1))
    return element("p", *key, class_="note before"), element("div", *every, class_="multiples")


def _figure(
    number: int, condition: Condition, fields: list[str], shared_axes: "Scale", numbers: dict[str, int]
) -> Markup:
    """The panel of one condition, with its caption."""
    reasons = _reasons(condition)
    colours = {file: k % N_COLOURS for k, files in enumerate(reasons.values()) for file in files}
    own = scale_of(condition, shared_axes)
    name = (
        "\N{NO-BREAK SPACE}· ".join(condition.fields[each] for each in fields if each in condition.fields)
        or "all recordings"
    )
    used = f"{len(condition.pooled)} of {len(condition.recordings)} repeats used"
    used += "; different axes" if own != shared_axes else ""
    used += f". {condition.why}" if condition.why else ""
    off = [numbers[one.file] for one in condition.recordings if one.shown is not None and not own.holds(one.shown)]
    used += f". Outside the axes: no. {', '.join(map(str, off))}" if off else ""
    listed = (_reason(k % N_COLOURS, why, files, numbers) for k, (why, files) in enumerate(reasons.items()))
    caption = element("figcaption", element("p", used), listing(listed, class_="reasons") if reasons else "")
    image = panel(condition, own, colours, f"Force over indentation: {name}. The values are in the tables.")
    return element("figure", element("h3", f"{number}  {name}"), image, caption, id=f"condition-{number}")


def _reasons(condition: Condition) -> dict[str, list[str]]:
    """Each reason, anomaly or missing result, with the recordings to which it applies."""
    found: dict[str, list[str]] = {}
    for one in condition.recordings:
        if one.anomalies or not one.has_parameters:
            found.setdefault(one.why, []).append(one.file)
    return found


def _reason(colour: int, why: str, files: list[str], numbers: dict[str, int]) -> Markup:
    """A reason with links to its recordings, in the colour of their curves."""
    links = [element("a", numbers[file], href=f"#recording-{numbers[file]}") for file in files[:MAX_LINKS]]
    more = f" and {len(files) - MAX_LINKS} more" if len(files) > MAX_LINKS else ""
    return join([element("b", "No. ", join(links, ", "), more, class_=f"c{colour}"), f": {why}"])


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
    text = str(quantity(estimate.value, estimate.low, estimate.high, estimate.unit))
    text = text if estimate.identifiable else f"not identified: {text}"
    return text.replace(" ± ", "\N{NO-BREAK SPACE}±\N{NO-BREAK SPACE}")


def recording_table(campaign: Campaign, numbers: dict[str, int]) -> Markup:
    """Every recording: number, file, condition, status, whether it is in the pooled fit, and its anomalies."""
    condition_of = {one.file: k for k, condition in enumerate(campaign.conditions, 1) for one in condition.recordings}
    rows = (_recording(one, numbers[one.file], condition_of.get(one.file, "none")) for one in campaign.recordings)
    return table(
        ("no.", "file", "condition", "status", "used", "anomalies and notes"), rows, class_=f"{_CLASS} recordings"
    )


def _recording(one: RecordingResult, number: int, condition: object) -> tuple:
    """The row of one recording."""
    status = status_name(one.status).split(":")[0]
    name = element("span", one.file, class_="file", id=f"recording-{number}")
    used = "yes" if one.pooled else element("em", "left out" if one.left_out else "no")
    return number, name, condition, status, used, join([one.why])


@dataclass(frozen=True)
class Scale:
    """The axes of a panel: indentation from ``left`` to ``right`` [mm], force from ``low`` to ``high`` [N]."""

    left: float
    right: float
    low: float
    high: float

    def points(self, trace: Trace) -> str:
        """A curve as the points of a polyline, rounded to a tenth."""
        x = (1e3 * trace.indentation - self.left) / (self.right - self.left) * (WIDTH - LEFT - RIGHT)
        y = (self.high - trace.force) / (self.high - self.low) * (HEIGHT - TOP - BOTTOM)
        return " ".join(f"{a:g},{b:g}" for a, b in np.round(np.column_stack((x, y)), 1).tolist())

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


def panel(condition: Condition, scale: Scale, colours: dict[str, int], alt: str) -> Markup:
    """Every repeat as a thin line, the model as a thick one; ``colours`` of anomalous repeats are by file."""
    drawn = [one for one in condition.recordings if one.shown is not None and scale.holds(one.shown)]
    normal = [one for one in drawn if one.file not in colours]
    anomalous = [one for one in drawn if one.file in colours]
    lines = [_line(one.shown, scale, "one") for one in normal]
    lines += [
        _line(one.shown, scale, f"anomalous c{colours[one.file]}" + " excluded" * one.left_out) for one in anomalous
    ]
    lines += [] if condition.shown is None else [_line(condition.shown, scale, "fit")]
    inner = Markup(
        f'<svg x="{LEFT:g}" y="{TOP:g}" width="{WIDTH - LEFT - RIGHT:g}" height="{HEIGHT - TOP - BOTTOM:g}">'
        f"{join(lines)}</svg>"
    )
    view = f'viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img" aria-label="{escape(alt)}"'
    return Markup(f'<svg class="panel" {view}>{join(_axes(scale))}{inner}</svg>')


def _line(trace: Trace, scale: Scale, kind: str) -> Markup:
    """A curve of the class ``kind``."""
    return element("polyline", class_=kind, points=scale.points(trace))


def _axes(scale: Scale) -> Iterator[Markup]:
    """Ticks, light grid lines, a darker line at zero force, and the names of the axes."""
    right, floor = WIDTH - RIGHT, HEIGHT - BOTTOM
    for force in ticks(scale.low, scale.high, 6):
        y = TOP + (scale.high - force) / (scale.high - scale.low) * (floor - TOP)
        yield element("path", class_="zero" if force == 0.0 else "grid", d=f"M{LEFT:g} {y:.1f}H{right:g}")
        yield _text(LEFT - 4, y + 3.5, f"{force:g}".replace("-", "−"), "end")
    for depth in ticks(scale.left, scale.right, 5):
        x = LEFT + (depth - scale.left) / (scale.right - scale.left) * (right - LEFT)
        yield element("path", class_="tick", d=f"M{x:.1f} {floor:g}v3")
        yield _text(x, floor + 13, f"{depth:g}".replace("-", "−"), "middle")
    yield _text(0.0, 9.0, "force [N]", "start")
    yield _text(right, HEIGHT - 3, "indentation [mm]", "end")


def _text(x: float, y: float, text: str, anchor: str) -> Markup:
    """Text at (x, y)."""
    return element("text", text, x=f"{x:.1f}", y=f"{y:.1f}", text_anchor=anchor)


def ticks(low: float, high: float, about: int) -> list[float]:
    """Round numbers within the range, at steps of 1, 2 or 5 times a power of ten; ``about`` is their number."""
    rough = (high - low) / about
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(each * power for each in (1.0, 2.0, 5.0, 10.0) if each * power >= 0.999 * rough)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [round(k * step, 12) + 0.0 for k in range(first, last + 1)]


def _scale(traces: Iterable[Trace]) -> Scale:
    """A scale that holds all curves; an arbitrary one without curves."""
    traces = list(traces)
    if not traces:
        return Scale(-1.0, 10.0, -1.0, 1.0)
    left, right = (1e3 * pick(pick(each.indentation) for each in traces) for pick in (min, max))
    low, high = (float(pick(pick(each.force) for each in traces)) for pick in (min, max))
    margin = AXIS_MARGIN * (high - low) or 1.0
    return Scale(max(float(left), -MAX_FREE_TRAVEL), max(float(right), 1e-3), low - margin, high + margin)
