# SPDX-License-Identifier: Apache-2.0
"""The page of an identification: its sections in order, where the values come from, in the frame of every report."""

from ..display.markup import Markup, Section, element, join, listing, section, table
from ..display.quantities import counted, with_unit
from ..identification.layered.result import LayeredFit
from ..identification.result import Fit
from ..vocabulary import __version__
from .curves import odd_ones, repeats
from .frame import framed
from .gallery import gallery, main_figure, ratio_figure
from .layers import evidence_note, evidence_table
from .tables import choice_table, comparison_table, event_table, law_list, parameter_table, recording_table
from .words import file_name, notes, outcome, warnings

_OWN = ("no.", "file")
_NAMES = ("sha256", "samples", "rate", "duration", "source", "needle", "tissue", "rig", "filter", "assumed in reading")


def page(fit: Fit, title: str | None = None, table: list[dict] | None = None) -> str:
    """The whole report as HTML text."""
    return framed(title or _title(fit), _kicker(fit), outcome(fit), _sections(fit, table or []))


def _sections(fit: Fit, table: list[dict]) -> list[Section | None]:
    drawn, odd = repeats(fit), odd_ones(fit)
    measured = "Measured against model" if fit.model is not None else "What was measured"
    compared = (comparison_table(table), ratio_figure(table)) if table else ()
    recordings = (_own_note(fit), recording_table(fit, odd), event_table(fit))
    return [
        section(measured, main_figure(fit, drawn), name="measured"),
        section("Paper, truth and identified", *compared, name="comparison"),
        section("What was identified", parameter_table(fit.parameters), name="parameters"),
        section("What to keep in mind", warnings(fit), notes(fit), name="warnings"),
        section("Figures", gallery(fit, drawn), name="figures"),
        section("Recordings and events", *recordings, name="recordings"),
        section("The model", law_list(fit.model) if fit.model is not None else "", name="model"),
        section("Held fixed", listing(fit.held_fixed) if fit.held_fixed else "", name="fixed"),
        section("What these recordings cannot identify", listing(fit.unknown) if fit.unknown else "", name="unknown"),
        _choice(fit),
        section("Provenance", provenance(fit), name="provenance"),
    ]


def _own_note(fit: Fit) -> object:
    note = (
        "This table has the values of each recording's own complete fit; friction and cutting force in the headline "
        "and in the table of parameters are those of the two passes. Events count from the detected contact, the fit "
        "from the contact that its law implies."
    )
    return element("p", note, class_="note") if fit.two_pass is not None else ""


def _choice(fit: Fit) -> Section | None:
    """Of a layered fit the number of layers and their mechanisms, otherwise the stiffness law."""
    if isinstance(fit, LayeredFit):
        shown = evidence_table(fit.settings.evidence), evidence_note(fit.settings)
        return section("Choice of layers and mechanisms", *shown, name="choice")
    note = "BIC weighs misfit against the number of parameters: the lowest is preferred, by 10 and more decisively."
    text = element("p", note, class_="note") if fit.choice else ""
    return section("Choice of law", choice_table(fit.choice), text, name="choice")


def _title(fit: Fit) -> str:
    names = [file_name(one.file) for one in fit.recordings]
    return f"Needle force: {names[0] if len(names) == 1 else counted(len(names), 'recording')}"


def _kicker(fit: Fit) -> str:
    model = "no model" if fit.model is None else f"stiffness law {fit.model.stiffness.name.replace('_', ' ')}"
    model = f"layered, {counted(len(fit.model.layers), 'layer')}" if isinstance(fit, LayeredFit) else model
    return f"needleforce · {counted(len(fit.recordings), 'recording')} · {model}"


def provenance(fit: Fit) -> Markup:
    """The files as they were read, what all share only once; then settings and version."""
    files = [_file(k, one) for k, one in enumerate(fit.recordings, 1)]
    shared = _shared(files)
    columns = [name for name in (files[0] if files else ()) if name not in shared]
    rows = ([_shown(name, file[name]) for name in columns] for file in files)
    run = {} if fit.settings is None else vars(fit.settings)
    own = ((name, value) for name, value in run.items() if name != "evidence")  # has its own section
    settings = [("needleforce", __version__), *own, *shared.items()]
    return join([table(tuple(columns), rows, class_="cards numbers provenance"), _definitions(settings)])


def _file(number: int, one) -> dict[str, object]:
    """What is known of one file, by name; empty where nothing is."""
    recording = one.recording
    if recording is None or len(recording) < 2:
        return dict.fromkeys((*_OWN, *_NAMES), "") | {"no.": number, "file": one.file}
    card, time = recording.card, recording.time
    rate, duration = with_unit(f"{recording.rate:.4g}", "Hz"), with_unit(f"{time[-1] - time[0]:.4g}", "s")
    length = f"average of {card.filter_length} samples" if card.filter_length > 1 else ""
    source = card.source if card.source != one.file else ""
    origin = source, card.needle, card.tissue, card.rig, length, card.assumptions
    known = card.sha256, _thousands(len(time)), rate, duration, *origin
    return {"no.": number, "file": one.file, **dict(zip(_NAMES, known))}


def _shared(files: list[dict]) -> dict[str, object]:
    """What is the same for all files: of one file everything but its name and hash."""
    apart = (*_OWN, "sha256", "samples")
    same = (name for name in _NAMES if name not in apart and len({file[name] for file in files}) == 1)
    return {name: files[0][name] for name in same if files[0][name]}


def _shown(name: str, value: object) -> object:
    if name == "file":
        return element("span", value, class_="file")
    if name == "sha256" and value:
        return element("code", value)
    return listing(value) if isinstance(value, tuple) and value else value or ""


def _definitions(pairs) -> Markup:
    rows = (join([element("dt", str(name).replace("_", " ")), element("dd", _value(value))]) for name, value in pairs)
    return element("dl", *rows)


def _value(value: object) -> object:
    if isinstance(value, (list, tuple)) and value:
        return listing(map(_value, value))
    return f"{value:.6g}" if isinstance(value, float) else "none" if value in (None, "", (), []) else str(value)


def _thousands(number: int) -> str:
    return f"{number:,}".replace(",", "\N{NARROW NO-BREAK SPACE}")
