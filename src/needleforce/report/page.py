# SPDX-License-Identifier: Apache-2.0
"""The page of an identification: its sections in order, and the provenance of its values."""

from collections.abc import Iterable

from ..display.markup import Markup, Section, element, join, listing, section, table
from ..display.quantities import counted, with_unit
from ..identification.layered.result import LayeredFit
from ..identification.recording_fit import RecordingFit
from ..identification.result import Fit
from ..vocabulary import __version__
from .curves import anomalous_recordings, repeats
from .frame import framed
from .gallery import gallery, main_figure, ratio_figure
from .layers import evidence_note, evidence_table
from .tables import choice_table, comparison_table, event_table, law_list, parameter_table, recording_table
from .words import file_name, notes, outcome, warnings, which_values

_FILE_COLUMNS = ("no.", "file")
_CARD_COLUMNS = (
    "sha256",
    "samples",
    "rate",
    "duration",
    "source",
    "needle",
    "tissue",
    "rig",
    "filter",
    "assumed in reading",
)


def page(fit: Fit, title: str | None = None, table: list[dict] | None = None) -> str:
    """The report as HTML text."""
    summary = outcome(fit)
    return framed(title or _title(fit), _kicker(fit), summary, _sections(fit, table or []), note=which_values(fit))


def _sections(fit: Fit, table: list[dict]) -> list[Section | None]:
    """The sections in their order; None for those without contents."""
    drawn, anomalous = repeats(fit), anomalous_recordings(fit)
    measured = "Measured force and model" if fit.model is not None else "Measured force"
    compared = (comparison_table(table), ratio_figure(table)) if table else ()
    recordings = recording_table(fit, anomalous), event_table(fit), _recording_note(fit)
    return [
        section(measured, main_figure(fit, drawn), name="measured"),
        section("Paper, true and identified values", *compared, name="comparison"),
        section("Identified parameters", parameter_table(fit.parameters), name="parameters"),
        section("Warnings and notes", warnings(fit), notes(fit), name="warnings"),
        section("More figures", gallery(fit, drawn), name="figures"),
        section("Recordings and events", *recordings, name="recordings"),
        section("Laws of the model", law_list(fit.model) if fit.model is not None else "", name="model"),
        section("Values held fixed", listing(fit.held_fixed) if fit.held_fixed else "", name="fixed"),
        section("Not identifiable from these recordings", listing(fit.unknown) if fit.unknown else "", name="unknown"),
        _choice(fit),
        section("Provenance", provenance(fit), name="provenance"),
    ]


def _recording_note(fit: Fit) -> object:
    """Which zero and which force the values of events have."""
    note = (
        "Events have measured forces, and indentations from the detected contact; indentations of a fit are from its "
        "fitted contact."
    )
    return element("p", note, class_="note") if fit.model is not None else ""


def _choice(fit: Fit) -> Section | None:
    """The choice of layers and mechanisms of a layered fit, otherwise the choice of the stiffness law."""
    if isinstance(fit, LayeredFit):
        shown = evidence_table(fit.settings.evidence), evidence_note(fit.settings)
        return section("Choice of layers and mechanisms", *shown, name="choice")
    note = "BIC combines misfit and number of parameters. The lowest is preferred, decisively by 10 or more."
    text = element("p", note, class_="note") if fit.choice else ""
    return section("Choice of the stiffness law", choice_table(fit.choice), text, name="choice")


def _title(fit: Fit) -> str:
    """The file name of one recording, the number of several."""
    names = [file_name(one.file) for one in fit.recordings]
    return f"Needle force: {names[0] if len(names) == 1 else counted(len(names), 'recording')}"


def _kicker(fit: Fit) -> str:
    """The line above the title: number of recordings, and model."""
    model = "no model" if fit.model is None else f"stiffness law {fit.model.stiffness.name.replace('_', ' ')}"
    model = f"layered, {counted(len(fit.model.layers), 'layer')}" if isinstance(fit, LayeredFit) else model
    return f"needleforce · {counted(len(fit.recordings), 'recording')} · {model}"


def provenance(fit: Fit) -> Markup:
    """A table of the files as read; properties common to all files, settings and version in a list."""
    files = [_file(k, one) for k, one in enumerate(fit.recordings, 1)]
    shared = _shared(files)
    columns = [name for name in (files[0] if files else ()) if name not in shared]
    rows = ([_shown(name, file[name]) for name in columns] for file in files)
    run = {} if fit.settings is None else vars(fit.settings)
    own = ((name, value) for name, value in run.items() if name != "evidence")  # which has its own section
    settings = [("needleforce", __version__), *own, *shared.items()]
    return join([table(tuple(columns), rows, class_="cards numbers provenance"), _definitions(settings)])


def _file(number: int, one: RecordingFit) -> dict[str, object]:
    """The properties of one file by name; empty if unknown."""
    recording = one.recording
    if recording is None or len(recording) < 2:
        return dict.fromkeys((*_FILE_COLUMNS, *_CARD_COLUMNS), "") | {"no.": number, "file": one.file}
    card, time = recording.card, recording.time
    rate, duration = with_unit(f"{recording.rate:.4g}", "Hz"), with_unit(f"{time[-1] - time[0]:.4g}", "s")
    length = f"average of {card.filter_length} samples" if card.filter_length > 1 else ""
    source = "" if one.file in (card.source, recording.place) else card.source
    origin = source, card.needle, card.tissue, card.rig, length, card.assumptions
    known = card.sha256, _thousands(len(time)), rate, duration, *origin
    return {"no.": number, "file": one.file, **dict(zip(_CARD_COLUMNS, known))}


def _shared(files: list[dict]) -> dict[str, object]:
    """The properties that are the same for all files; for one file all except name, hash and samples."""
    apart = (*_FILE_COLUMNS, "sha256", "samples")
    same = (name for name in _CARD_COLUMNS if name not in apart and len({file[name] for file in files}) == 1)
    return {name: files[0][name] for name in same if files[0][name]}


def _shown(name: str, value: object) -> object:
    """A property of a file as the content of a table cell."""
    if name == "file":
        return element("span", value, class_="file")
    if name == "sha256" and value:
        return element("code", value)
    return listing(value) if isinstance(value, tuple) and value else value or ""


def _definitions(pairs: Iterable[tuple[str, object]]) -> Markup:
    """Names and values as a definition list."""
    rows = (join([element("dt", str(name).replace("_", " ")), element("dd", _value(value))]) for name, value in pairs)
    return element("dl", *rows)


def _value(value: object) -> object:
    """A setting as text."""
    if isinstance(value, (list, tuple)) and value:
        return listing(map(_value, value))
    return f"{value:.6g}" if isinstance(value, float) else "none" if value in (None, "", (), []) else str(value)


def _thousands(number: int) -> str:
    """A number with a space between groups of three digits."""
    return f"{number:,}".replace(",", "\N{NARROW NO-BREAK SPACE}")
