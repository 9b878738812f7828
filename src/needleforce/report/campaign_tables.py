# SPDX-License-Identifier: Apache-2.0
"""The tables of a campaign: its conditions, and every recording with what is odd in it."""

from .markup import Markup, element, join, table
from .numbers import quantity
from .tables import OWN
from .words import quantity_name, status_name

OF = "repeats used"
_CLASS = "cards dense wrap"


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
