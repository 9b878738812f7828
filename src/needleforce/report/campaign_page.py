# SPDX-License-Identifier: Apache-2.0
"""The report of a campaign: one page with its conditions in a table, as small multiples, and every recording."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from ..campaign.result import Campaign
from ..display.markup import Markup, Section, element, escape, join, listing, section, table
from ..display.quantities import counted, quantity
from ..vocabulary import __version__
from .frame import framed
from .tables import OWN
from .words import quantity_name, status_name

COLOURS = 4  # as many as campaign.css has
NAMED = 6  # recordings of one reason that a caption names
SECTIONS = {"conditions": "Conditions", "figures": "Every repeat", "recordings": "Recordings", "notes": "Notes"}
OF = "repeats used"
_CLASS = "cards dense wrap"
WIDTH, HEIGHT = 300.0, 190.0
LEFT, RIGHT, TOP, BOTTOM = 30.0, 4.0, 16.0, 28.0
OFF_AXES = 5.0  # times the axis: a curve that reaches so far, as in another unit, is not drawn
OWN_SCALE = 8.0  # a panel whose forces are so many times smaller than the others' has a scale of its own
FREE = 3.0  # [mm] of free travel shown at most
ROOM = 0.04  # of the range above and below the curves


def campaign_page(campaign: Campaign, title: str | None = None) -> str:
    """The whole report as HTML text."""
    numbers = {one.file: k for k, one in enumerate(campaign.recordings, 1)}
    kicker = f"needleforce {__version__} · campaign"
    sections = _sections(campaign, numbers)
    return framed(title or _title(campaign), kicker, _outcome(campaign), sections, styles=("campaign.css",))


def _sections(campaign, numbers: dict[str, int]) -> list[Section | None]:
    conditions = campaign.conditions
    table = (_shared(conditions), condition_table(conditions)) if conditions else ()
    return [
        section(SECTIONS["conditions"], *table, name="conditions"),
        section(SECTIONS["figures"], *_figures(conditions, numbers), name="figures"),
        section(SECTIONS["recordings"], recording_table(campaign, numbers), name="recordings"),
        section(SECTIONS["notes"], listing(campaign.notes) if campaign.notes else "", name="notes"),
    ]


def _title(campaign) -> str:
    conditions = counted(len(campaign.conditions), "condition")
    return f"Needle force: {counted(len(campaign.recordings), 'recording')} of {conditions}"


def _outcome(campaign) -> Markup:
    """What came out, in a sentence or two."""
    every, conditions = campaign.recordings, campaign.conditions
    identified = sum(each.model is not None for each in conditions)
    used, out = sum(one.pooled for one in every), sum(one.left_out for one in every)
    odd = sum(bool(one.anomalies) and not one.left_out for condition in conditions for one in condition.recordings)
    silent = sum(not one.has_parameters and not one.left_out for one in every)
    said = [f"{identified} of {counted(len(conditions), 'condition')} identified, from {counted(used, 'recording')}."]
    said += [f"{counted(out, 'recording')} left out of a pooled fit, each with its reason."] * (out > 0)
    said += [f"{counted(odd, 'recording')} odd but kept."] * (odd > 0)
    said += [f"{counted(silent, 'recording')} without parameters."] * (silent > 0)
    said += [f"{counted(len(campaign.others), 'recording')} of no condition."] * bool(campaign.others)
    return join(said, " ")


def _shared(conditions) -> Markup:
    same = shared(conditions)
    said = ", ".join(f"{name.replace('_', ' ')} {value}" for name, value in same.items())
    return element("p", f"The same in all: {said}.", class_="note before") if same else Markup("")


def _figures(conditions, numbers: dict[str, int]) -> tuple:
    """A key, and the panels in a grid that fills whatever width there is."""
    if not conditions:
        return ()
    scale, fields = shared_scale(conditions), varying(conditions)
    key = [element("b", "Repeats", class_="measured"), " thin and grey, ", element("b", "pooled model", class_="model"),
           " thick and orange, what is odd in other colours, dashed where the pooled fit leaves it out. All panels "
           "have the same axes, unless one says otherwise."]  # fmt: skip
    every = (_figure(k, each, fields, scale, numbers) for k, each in enumerate(conditions, 1))
    return element("p", *key, class_="note before"), element("div", *every, class_="multiples")


def _figure(number: int, condition, fields: list[str], shared_axes, numbers: dict[str, int]) -> Markup:
    reasons = _reasons(condition)
    colours = {file: k % COLOURS for k, files in enumerate(reasons.values()) for file in files}
    own = scale_of(condition, shared_axes)
    name = (
        "\N{NO-BREAK SPACE}· ".join(condition.fields[each] for each in fields if each in condition.fields)
        or "all recordings"
    )
    used = f"{len(condition.pooled)} of {len(condition.recordings)} repeats used"
    used += "; its own axes" if own != shared_axes else ""
    used += f". {condition.why}" if condition.why else ""
    off = [numbers[one.file] for one in condition.recordings if one.shown is not None and not own.holds(one.shown)]
    used += f". Off the axes: no. {', '.join(map(str, off))}" if off else ""
    said = (_reason(k % COLOURS, why, files, numbers) for k, (why, files) in enumerate(reasons.items()))
    caption = element("figcaption", element("p", used), listing(said, class_="reasons") if reasons else "")
    image = panel(condition, own, colours, f"Force over indentation: {name}. The numbers are in the tables.")
    return element("figure", element("h3", f"{number}  {name}"), image, caption, id=f"condition-{number}")


def _reasons(condition) -> dict[str, list[str]]:
    """What is odd -> the recordings that have it, so that a sentence stands once."""
    found: dict[str, list[str]] = {}
    for one in condition.recordings:
        if one.anomalies or not one.has_parameters:
            found.setdefault(one.why, []).append(one.file)
    return found


def _reason(colour: int, why: str, files: list[str], numbers: dict[str, int]) -> Markup:
    links = [element("a", numbers[file], href=f"#recording-{numbers[file]}") for file in files[:NAMED]]
    more = f" and {len(files) - NAMED} more" if len(files) > NAMED else ""
    return join([element("b", "No. ", join(links, ", "), more, class_=f"c{colour}"), f": {why}"])


def varying(conditions) -> list[str]:
    """The fields in which the conditions differ, in their order; all of them where there is one condition."""
    names = list(dict.fromkeys(name for condition in conditions for name in condition.fields))
    if len(conditions) < 2:
        return names
    return [name for name in names if len({condition.fields.get(name) for condition in conditions}) > 1]


def shared(conditions) -> dict[str, str]:
    """The fields that are the same in all conditions."""
    apart = varying(conditions)
    return {name: value for name, value in conditions[0].fields.items() if name not in apart} if conditions else {}


def condition_table(conditions) -> Markup:
    """A row for each condition: fields, repeats used of all, main parameters with their intervals."""
    fields = varying(conditions)
    own = [name for name in OWN if any(name in each.parameters for each in conditions)]
    head = ("no.", *(name.replace("_", " ") for name in fields), OF, *map(quantity_name, own))
    return table(head, (_condition(k, each, fields, own) for k, each in enumerate(conditions, 1)), class_=_CLASS)


def _condition(number: int, condition, fields: list[str], own: list[str]) -> tuple:
    values = (condition.parameters.get(name) for name in own)
    used = f"{len(condition.pooled)} of {len(condition.recordings)}" + (": no model" if condition.model is None else "")
    return (
        element("a", number, href=f"#condition-{number}"), *(condition.fields.get(name, "") for name in fields),
        used, *("" if each is None else _value(each) for each in values),
    )  # fmt: skip


def _value(estimate) -> str:
    """A value and its ± on one line."""
    text = str(quantity(estimate.value, estimate.low, estimate.high, estimate.unit))
    return text.replace(" ± ", "\N{NO-BREAK SPACE}±\N{NO-BREAK SPACE}")


def recording_table(campaign, numbers: dict[str, int]) -> Markup:
    """Every recording: number, file, condition, status, whether it is in the pooled fit, and what is odd."""
    of = {one.file: k for k, condition in enumerate(campaign.conditions, 1) for one in condition.recordings}
    rows = (_recording(one, numbers[one.file], of.get(one.file, "none")) for one in campaign.recordings)
    return table(("no.", "file", "condition", "status", "used", "what is odd"), rows, class_=_CLASS)


def _recording(one, number: int, condition: object) -> tuple:
    status = status_name(one.status).split(":")[0]
    name = element("span", one.file, class_="file", id=f"recording-{number}")
    used = "yes" if one.pooled else element("em", "left\N{NO-BREAK SPACE}out" if one.left_out else "no")
    return number, name, condition, status, used, join([one.why])


@dataclass(frozen=True)
class Scale:
    """What a panel shows: indentation from ``left`` to ``right`` [mm], force from ``low`` to ``high`` [N]."""

    left: float
    right: float
    low: float
    high: float

    def points(self, trace) -> str:
        """A curve as the points of a polyline, in tenths of a point."""
        x = (1e3 * trace.indentation - self.left) / (self.right - self.left) * (WIDTH - LEFT - RIGHT)
        y = (self.high - trace.force) / (self.high - self.low) * (HEIGHT - TOP - BOTTOM)
        return " ".join(f"{a:g},{b:g}" for a, b in np.round(np.column_stack((x, y)), 1).tolist())

    def holds(self, trace) -> bool:
        """Whether a curve can be drawn on these axes."""
        deep, size = 1e3 * np.abs(trace.indentation).max(), np.abs(trace.force).max()
        return bool(deep <= OFF_AXES * (self.right - self.left) and size <= OFF_AXES * (self.high - self.low))


def shared_scale(conditions) -> Scale:
    """One scale for all panels, from the recordings that the models rest on; without any, from all."""
    pooled = [one.shown for each in conditions for one in each.pooled if one.shown is not None]
    models = [each.shown for each in conditions if each.shown is not None]
    return _scale([*pooled, *models] or [trace for each in conditions for trace in usual_traces(each)])


def scale_of(condition, shared: Scale) -> Scale:
    """The shared scale; one of its own where the condition's forces would be flat on it, or would leave it."""
    traces = list(usual_traces(condition))
    own = _scale(traces)
    if traces and not any(map(shared.holds, traces)):
        return own
    if own.high - own.low > (shared.high - shared.low) / OWN_SCALE or not traces:
        return shared
    return Scale(shared.left, shared.right, own.low, own.high)


def usual_traces(condition) -> Iterator:
    """The curves that set the scale: the model, and the recordings that are not left out, else all."""
    drawn = [one for one in condition.recordings if one.shown is not None]
    yield from (one.shown for one in [one for one in drawn if not one.left_out] or drawn)
    yield from () if condition.shown is None else (condition.shown,)


def panel(condition, scale: Scale, colours: dict[str, int], alt: str) -> Markup:
    """Every repeat as a thin line, the model as a thick one; ``colours`` (file -> number) marks what is odd."""
    drawn = [one for one in condition.recordings if one.shown is not None and scale.holds(one.shown)]
    usual = [one for one in drawn if one.file not in colours]
    odd = [one for one in drawn if one.file in colours]
    lines = [_line(one.shown, scale, "one") for one in usual]
    lines += [_line(one.shown, scale, f"odd c{colours[one.file]}" + " out" * one.left_out) for one in odd]
    lines += [] if condition.shown is None else [_line(condition.shown, scale, "fit")]
    inner = Markup(
        f'<svg x="{LEFT:g}" y="{TOP:g}" width="{WIDTH - LEFT - RIGHT:g}" height="{HEIGHT - TOP - BOTTOM:g}">'
        f"{join(lines)}</svg>"
    )
    view = f'viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img" aria-label="{escape(alt)}"'
    return Markup(f'<svg class="panel" {view}>{join(_axes(scale))}{inner}</svg>')


def _line(trace, scale: Scale, kind: str) -> Markup:
    return element("polyline", class_=kind, points=scale.points(trace))


def _axes(scale: Scale) -> Iterator[Markup]:
    """Ticks with light lines across, the zero of the force stronger, and the axes' names."""
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
    return element("text", text, x=f"{x:.1f}", y=f"{y:.1f}", text_anchor=anchor)


def ticks(low: float, high: float, about: int) -> list[float]:
    """Round numbers within the range, 1, 2 or 5 times a power of ten apart."""
    rough = (high - low) / about
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(each * power for each in (1.0, 2.0, 5.0, 10.0) if each * power >= 0.999 * rough)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [round(k * step, 12) + 0.0 for k in range(first, last + 1)]


def _scale(traces: Iterable) -> Scale:
    """Around all curves; a scale of some size where there is nothing to draw."""
    traces = list(traces)
    if not traces:
        return Scale(-1.0, 10.0, -1.0, 1.0)
    left, right = (1e3 * pick(pick(each.indentation) for each in traces) for pick in (min, max))
    low, high = (float(pick(pick(each.force) for each in traces)) for pick in (min, max))
    room = ROOM * (high - low) or 1.0
    return Scale(max(float(left), -FREE), max(float(right), 1e-3), low - room, high + room)
