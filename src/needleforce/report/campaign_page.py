# SPDX-License-Identifier: Apache-2.0
"""The report of a campaign: one page with its conditions in a table, as small multiples, and every recording."""

from pathlib import Path
from string import Template

from ..vocabulary import __version__
from .campaign_panels import panel, scale_of, shared_scale
from .markup import Markup, element, escape, join, listing, section, table
from .numbers import quantity
from .tables import OWN
from .words import counted, quantity_name, status_name

HERE = Path(__file__).parent
COLOURS = 4  # as many as campaign.css has
NAMED = 6  # recordings of one reason that a caption names
SECTIONS = {"conditions": "Conditions", "figures": "Every repeat", "recordings": "Recordings", "notes": "Notes"}
OF = "repeats used"
_CLASS = "cards dense wrap"


def campaign_page(campaign, title: str | None = None) -> str:
    """The whole report as HTML text."""
    numbers = {one.file: k for k, one in enumerate(campaign.recordings, 1)}
    found = [part for part in _sections(campaign, numbers) if part]
    links = (
        element("a", name, href=f"#{key}") for key, name in SECTIONS.items() if any(f'id="{key}"' in p for p in found)
    )
    style = "".join((HERE / name).read_text(encoding="utf-8") for name in ("page.css", "campaign.css"))
    return Template((HERE / "page.html").read_text(encoding="utf-8")).substitute(
        title=escape(title or _title(campaign)),
        style=style,
        kicker=escape(f"needleforce {__version__} · campaign"),
        outcome=_outcome(campaign),
        contents=element("nav", *links),
        sections=join(found),
    )


def _sections(campaign, numbers: dict[str, int]) -> list[Markup]:
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
    odd = sum(bool(one.oddities) and not one.left_out for condition in conditions for one in condition.recordings)
    silent = sum(not one.answers and not one.left_out for one in every)
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
        if one.oddities or not one.answers:
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
