# SPDX-License-Identifier: Apache-2.0
"""The tables of what was identified: parameters, laws, recordings, events."""

from .markup import Markup, element, join, listing, table
from .numbers import DASH, plain, quantity, with_unit
from .words import file_name, quantity_name, status_name

PARAMETERS = ("quantity", "value and 95 % interval", "sd between repeats", "identifiable", "how obtained")
EVENTS = ("no.", "event", "time", "depth", "indentation", "force", "drop", "between samples")
_FEW = 6  # recordings that a narrow screen still shows as cards
OWN = ("puncture_indentation", "puncture_force", "friction_per_length", "cutting_force")


def parameter_table(parameters: dict) -> Markup:
    """Every estimate with its interval, its scatter between repeats, and how it was obtained."""
    rows = [_parameter(estimate) for estimate in parameters.values()]
    return table(PARAMETERS, rows, class_="cards numbers parameters") if rows else Markup("")


def _parameter(estimate) -> tuple:
    shown = quantity(estimate.value, estimate.low, estimate.high, estimate.unit)
    value = element("strong", shown.text) if not shown.interval else join(_value_and_interval(shown))
    spread = estimate.between_repeats_sd
    name = join([quantity_name(estimate.name), element("code", estimate.name)])
    identifiable = "yes" if estimate.identifiable else element("em", "no")
    return name, value, "" if spread is None else _spread(estimate), identifiable, estimate.source


def _spread(estimate) -> str:
    """The scatter in the unit of its value, so that the two can be compared at a glance."""
    value, spread = estimate.value, estimate.between_repeats_sd
    shown = quantity(value, value - spread, value + spread, estimate.unit)
    return with_unit(shown.half_width, shown.unit) if shown.half_width else DASH


def _value_and_interval(shown) -> tuple:
    if "∞" in shown.value:
        return (element("strong", with_unit(shown.low, shown.unit) + f" to {shown.high}"),)
    if shown.symmetric:
        return element("strong", shown.value), f" ± {with_unit(shown.half_width, shown.unit)}"
    return element("strong", shown.text), element("span", f" ({shown.interval})", class_="interval")


def law_list(model) -> Markup:
    """The laws of the identified model, each with what it says and where it comes from."""
    laws = ((part, getattr(model, part)) for part in ("stiffness", "puncture", "friction", "cutting"))
    named = ((f"{part.capitalize()}: {law.name.replace('_', ' ')}.", law) for part, law in laws)
    return listing(join([element("strong", name), f" {law.summary} ({law.source})"]) for name, law in named)


def choice_table(choice) -> Markup:
    """The stiffness laws compared, the best first, with what each loses in BIC."""
    ranked = sorted(choice, key=lambda pair: pair[1])
    best = ranked[0][1] if ranked else 0.0
    rows = ((name.replace("_", " "), f"{bic:.1f}".replace("-", "−"), _lost(bic - best)) for name, bic in ranked)
    return table(("stiffness law", "BIC", "more than the best"), rows, class_="numbers small") if ranked else Markup("")


def _lost(difference: float) -> object:
    return element("strong", "best") if difference == 0.0 else f"+{difference:.1f}"


def recording_table(fit, odd: set[int]) -> Markup:
    """Every file and what became of it: outcome, own parameters, residual."""
    own = [name for name in OWN if any(name in one.parameters for one in fit.recordings)]
    head = ("no.", "file", "outcome", *(quantity_name(name) for name in own), "rms residual", "R²")
    rows = (_recording(k, one, own, k in odd) for k, one in enumerate(fit.recordings, 1))
    return table(head, rows, class_="cards numbers" if len(fit.recordings) <= _FEW else "numbers dense")


def _recording(number: int, one, own: list[str], odd: bool) -> tuple:
    outcome = [status_name(one.status)] + ([element("em", "; odd one out")] if odd else [])
    values = (one.parameters.get(name) for name in own)
    quality = one.quality
    return (
        number, element("span", file_name(one.file), class_="file"), join(outcome),
        *("" if e is None else quantity(e.value, e.low, e.high, e.unit).text for e in values),
        *(("", "") if quality is None else (plain(quality.rmse_N, "N", quality.rmse_N), f"{quality.r2:.4f}")),
    )  # fmt: skip


def event_table(fit) -> Markup:
    """Contact, punctures and exit of every recording."""
    rows = [row for k, one in enumerate(fit.recordings, 1) for row in _events(k, one)]
    return table(EVENTS, rows, class_="numbers dense") if rows else Markup("")


def _events(number: int, one):
    events = one.events
    surface = events.contact.depth if events.contact is not None else None
    named = (("contact", events.contact), *(("puncture", p) for p in events.punctures), ("exit", events.exit))
    for k, (name, event) in enumerate(pair for pair in named if pair[1] is not None):
        deep = None if surface is None else event.depth - surface
        yield (
            "" if k else number, name, _milli(event.time, "s"), _milli(1e3 * event.depth, "mm"),
            "" if deep is None else _milli(1e3 * deep, "mm"), _milli(event.force, "N"),
            _milli(event.drop, "N") if hasattr(event, "drop") else "", f"{event.low}–{event.high}",
        )  # fmt: skip


def _milli(value: float, unit: str) -> str:
    """Three decimals: the millisecond, micrometre and millinewton, finer than any of the sensors."""
    return f"{value:.3f}\N{NO-BREAK SPACE}{unit}".replace("-", "−")
