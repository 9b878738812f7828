# SPDX-License-Identifier: Apache-2.0
"""The tables of a fit: parameters, laws, choices, recordings, events, and where they are from."""

import math
from collections.abc import Iterable, Sequence

from ...display.markup import Markup, element, join, listing, table
from ...display.page import definitions, note
from ...display.quantities import DASH, Quantity, percent, plain, with_unit
from ...models.model import Model
from ...segmentation.events import EVENT_HEAD
from ...vocabulary import __version__
from ..estimates import Estimate
from ..recording_fit import RecordingFit
from ..settings import Choice, Evidence, FitSettings, LayeredSettings
from ..statistics.noise import INTERVAL
from .words import by_layer, file_name, quantity_name, status_name

PARAMETERS = (
    *("quantity", f"value and {INTERVAL}", "sd between repeats", "error within a run (sd)", "identifiable"),
    "how obtained",
)
OMITTED_LAWS = ("no_relaxation",)
MAX_NORMAL_SIZE_ROWS = 6  # tables with more recordings have smaller text
MAIN_PARAMETERS = ("puncture_indentation", "puncture_force", "friction_per_length", "cutting_force")
EVIDENCE = (
    *("choice", "parameters", "residual / peak", "BIC above the lowest", "error on held-out repeats / peak"),
    "verdict",
)
_FILE_COLUMNS = ("no.", "file")
_CARD_COLUMNS = (
    *("sha256", "samples", "rate", "duration", "source", "needle", "tissue", "rig", "filter"),
    "assumed in reading",
)


def parameter_table(parameters: dict[str, Estimate]) -> Markup:
    """Every estimate with its interval, its scatter between repeats and its source; a table for each layer."""
    sources = {estimate.source for estimate in parameters.values()}
    common = sources.pop() if len(sources) == 1 and len(parameters) > 1 else None
    how = note(f"How obtained: {common}." if common else "")
    return join([*(_layer_table(*each, common) for each in by_layer(parameters).items()), how])


def _layer_table(layer: str, parameters: dict[str, Estimate], common: str | None) -> Markup:
    """A table under the name of its layer; a source common to all estimates is not in the rows."""
    rows = [_parameter(name, estimate, common) for name, estimate in parameters.items()]
    heading = element("h3", layer.capitalize()) if layer else ""
    return join([heading, table(PARAMETERS, rows, class_="cards numbers parameters" + " layer" * bool(layer))])


def _parameter(own_name: str, estimate: Estimate, common: str | None) -> tuple:
    """The row of one estimate."""
    shown = estimate.shown
    value = element("strong", shown.text) if not shown.interval else join(_value_and_interval(shown))
    if estimate.systematic_share == "most":
        value = join([value, element("span", ", mostly systematic", class_="interval")])
    name = join([quantity_name(own_name), element("code", estimate.name)])
    spreads = (
        "" if sd is None else element("span", estimate.spread(sd), class_="spread")
        for sd in (estimate.between_repeats_sd, estimate.within_run_sd)
    )
    identifiable = "yes" if estimate.identifiable else element("em", estimate.known)
    return name, value, *spreads, identifiable, "" if common else estimate.source


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
    meaning = "BIC combines misfit and number of parameters. The lowest is preferred, decisively by 10 or more."
    rows = (
        (
            each.name.replace("_", " "),
            f"{each.bic:.1f}".replace("-", "−"),
            element("strong", "best") if each.bic - best == 0.0 else f"+{each.bic - best:.1f}",
            *[percent(each.puncture_ratio)] * shown,
        )
        for each in ranked
    )
    head = ("stiffness law", "BIC", "above the lowest", *["modelled over measured puncture force"] * shown)
    return join([table(head, rows, class_="numbers small"), note(meaning)])


def recording_table(recordings: Sequence[RecordingFit], names: Iterable[str], anomalous: set[int]) -> Markup:
    """Every file with its status, the parameters ``names`` of its own fit, and the residual."""
    own = [name for name in names if any(name in one.parameters for one in recordings)]
    head = ("no.", "file", "status", *(quantity_name(name) for name in own), "rms residual", "R²")
    rows = (_recording(k, one, own, k in anomalous) for k, one in enumerate(recordings, 1))
    return table(head, rows, class_="cards numbers" + " dense" * (len(recordings) > MAX_NORMAL_SIZE_ROWS))


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
    if estimate.name.endswith("puncture_depth") and estimate.high == math.inf:
        return "not reached"
    return estimate.doubt + estimate.shown.text


def event_table(recordings: Sequence[RecordingFit]) -> Markup:
    """Contact, punctures and exit of every recording."""
    rows = (
        ("" if k else number, *row)
        for number, one in enumerate(recordings, 1)
        for k, row in enumerate(one.events.cells()[1])
    )
    return table(("no.", *EVENT_HEAD), rows, class_="cards numbers dense")


def evidence_rows(evidence: Sequence[Evidence]) -> list[tuple[str, ...]]:
    """Every choice tried as text under ``EVIDENCE``, with its BIC above the lowest."""
    lowest = min(row.bic for row in evidence)
    return [
        (row.choice, str(row.parameters), _share(row.residual), f"{row.bic - lowest:.0f}", _share(row.left_out),
         "chosen" if row.chosen else "ties" if row.ties else "")
        for row in evidence
    ]  # fmt: skip


def evidence_table(settings: LayeredSettings) -> Markup:
    """The choices as an HTML table, the word ``chosen`` in bold, with the criterion under it."""
    bold = {"chosen": element("strong", "chosen")}
    rows = ((*row[:-1], bold.get(row[-1], row[-1])) for row in evidence_rows(settings.evidence))
    each = (
        "A choice with a comma omits one mechanism from the chosen number of layers. Parameters are all that are "
        "fitted."
    )
    return join([table(EVIDENCE, rows, class_="cards numbers tight"), note(f"{evidence_words(settings)} {each}")])


def evidence_words(settings: LayeredSettings) -> str:
    """The criterion of the choice, and what a tie is."""
    by_bic = (
        "With fewer than three repeats the choice with the lowest BIC is taken; those within 10 of it tie. BIC is over "
        "the complete cycle and counts correlated samples as one."
    )
    by_repeats = (
        "Of the choices that predict held-out repeats as well as the best, within one standard error or 2 % "
        "(geometric mean over the repeats), the one with the fewest parameters is chosen. A choice ties if its "
        "error differs from that of the chosen one by no more than the noise between repeats: these recordings do "
        "not distinguish the two. BIC, over the complete cycle and counting correlated samples as one, is shown for "
        "comparison and may favour fewer parameters."
    )
    given = sum("," not in row.choice for row in settings.evidence) == 1
    fixed = " The number of layers was given." if given else ""
    return (by_repeats if settings.evidence[0].left_out is not None else by_bic) + fixed


def _share(share: float | None) -> str:
    """A share of the peak in per cent, with one decimal."""
    return DASH if share is None else f"{100.0 * share:.1f}\N{NO-BREAK SPACE}%"


def provenance(recordings: Sequence[RecordingFit], settings: FitSettings | None) -> Markup:
    """A table of the files as read; properties common to all files, settings and version in a list."""
    files = [_file(k, one) for k, one in enumerate(recordings, 1)]
    shared = _shared(files)
    columns = [name for name in (files[0] if files else ()) if name not in shared]
    rows = ([_shown(name, file[name]) for name in columns] for file in files)
    run = {} if settings is None else vars(settings)
    own = ((name, value) for name, value in run.items() if name != "evidence")  # which has its own section
    listed = [("needleforce", __version__), *own, *shared.items()]
    pairs = ((name.replace("_", " "), _setting(value)) for name, value in listed)
    return join([table(columns, rows, class_="cards numbers provenance"), definitions(pairs)])


def _file(number: int, one: RecordingFit) -> dict[str, object]:
    """The properties of one file by name; empty if unknown."""
    recording = one.recording
    if recording is None or len(recording) < 2:
        return dict.fromkeys((*_FILE_COLUMNS, *_CARD_COLUMNS), "") | {"no.": number, "file": file_name(one.file)}
    card, time = recording.card, recording.time
    rate, duration = with_unit(f"{recording.rate:.4g}", "Hz"), with_unit(f"{time[-1] - time[0]:.4g}", "s")
    length = f"average of {card.filter_length} samples" if card.filter_length > 1 else ""
    source = "" if one.file in (card.source, recording.place) else file_name(card.source)
    origin = source, card.needle, card.tissue, card.rig, length, card.assumptions
    known = card.sha256, f"{len(time):,}".replace(",", "\N{NARROW NO-BREAK SPACE}"), rate, duration, *origin
    return {"no.": number, "file": file_name(one.file), **dict(zip(_CARD_COLUMNS, known))}


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


def _setting(value: object) -> object:
    """A setting as text."""
    if isinstance(value, (list, tuple)) and value:
        return listing(map(_setting, value))
    return f"{value:.6g}" if isinstance(value, float) else "none" if value in (None, "", (), []) else str(value)
