# SPDX-License-Identifier: Apache-2.0
"""``needleforce identify``: identify a force model from recordings."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import msgspec
import typer

from ..errors import InputError
from ..recording.options import ReadOptions
from .files import MACHINE_HELP, MOTION_HELP, NEEDLE_HELP, ReadFiles, read_all, read_or_ask, screen_recordings
from .flags import takes_flags
from .output import JSON_HELP, ReportFlags, check_outputs, progress, say, table, write_file, write_json

if TYPE_CHECKING:
    from ..identification import Fit, RecordingFit
    from ..identification.settings import LayeredSettings

MODEL_NAMES = (
    "Names: paper (quadratic), cone_cylinder, power_law, okamura or simone (second-order polynomial), or maurin "
    "(exponential). cubic_foundation, hyperbolic_foundation or tanh_foundation: friction of a bent shaft, beyond the "
    "paper's line. gradual_cone, gradual_cone_cylinder or gradual_power_law: a contact that ruptures gradually. "
    "layered, layered_yielding (both passive) or layered_as_fitted: complete cycles of layers that are dragged along, "
    "rupture and relax, from repeats with hold and withdrawal. gradual_layers: insertions alone through layers that "
    "rupture one after another."
)
MODEL_HELP = (
    "A name, or a preset, preset file or fit with the same laws; default: paper or cone_cylinder, by the BIC of the "
    f"loading curve, or what describes the recordings where these do not. {MODEL_NAMES}"
)
LAYERS_HELP = (
    "Layers of a layered model, 1 to 3; default: the fewest that predict held-out repeats equally well. Of "
    "gradual_layers; default: one for each puncture."
)
MACHINE_FOUND_HELP = f"{MACHINE_HELP} Default: none, unless the recordings show one."


class IdentifyFlags(msgspec.Struct, frozen=True, kw_only=True):
    """The flags of ``identify``."""

    second_pass: Annotated[
        list[Path], typer.Option(help="Second insertion at the same site; repeated once for each file.")
    ] = []
    needle: Annotated[str | None, typer.Option(help=NEEDLE_HELP)] = None
    model: Annotated[str | None, typer.Option(help=MODEL_HELP)] = None
    layers: Annotated[int | None, typer.Option(help=LAYERS_HELP)] = None
    machine_stiffness_N_mm: Annotated[
        float | None, typer.Option("--machine-stiffness-N-mm", help=MACHINE_FOUND_HELP)
    ] = None
    reading: ReadOptions
    motion: Annotated[list[Path], typer.Option(help=MOTION_HELP)] = []
    bending: Annotated[Path | None, typer.Option(help="CSV file of a cantilever test of the needle.")] = None
    tension: Annotated[Path | None, typer.Option(help="CSV file of a tension test of the tissue.")] = None
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None
    page: ReportFlags
    save: Annotated[Path | None, typer.Option(help="Write the identified model as a preset file.")] = None
    csv: Annotated[Path | None, typer.Option(help="Write all estimates as a CSV table.")] = None
    draws: Annotated[
        Path | None, typer.Option(help="Write 4000 draws of the identified parameters, .csv or .json.")
    ] = None


@takes_flags("motion", "start_depth", "filter_length")
def run(
    files: Annotated[list[Path], typer.Argument(help="Recordings, repeats of one condition.", show_default=False)],
    given: IdentifyFlags,
) -> None:
    """Identify a force model from recordings: events, parameters and their intervals."""
    identify_files(files, given)


def identify_files(files: list[Path], given: IdentifyFlags, look: Callable[[ReadFiles], None] | None = None) -> None:
    """Identify the recordings of the files, after a ``look`` at what was read."""
    from ..identification.export import check_draws_target
    from ..preset_files import needle_of

    check_outputs(
        [given.json, given.page.check(), given.save, given.csv, given.draws],
        [*files, *given.second_pass, *given.motion, given.needle, given.bending, given.tension],
    )
    if given.draws is not None:
        check_draws_target(given.draws)
    body = needle_of(given.needle) if given.needle else None
    motion = given.motion[: len(files)] if given.second_pass else given.motion
    done, reading = read_or_ask(files, given.reading, motion)
    seconds = read_all(given.second_pass, reading, given.motion[len(files) :], "second pass")
    done = screen_recordings(done)
    _print_assumptions(done + seconds)
    if look is not None:
        look(done)
    bench = {"bending": given.bending, "tension": given.tension}
    machine = None if given.machine_stiffness_N_mm is None else 1e3 * given.machine_stiffness_N_mm
    chosen = {"model": given.model, "layers": given.layers, "machine_stiffness": machine}
    fit = _identified(done, seconds, **chosen, needle=body, **bench, progress=progress)
    _show(fit, quiet=given.json == "-")
    _write(fit, given)
    if fit.identified_model is None:
        raise typer.Exit(1)


def _identified(done: ReadFiles, seconds: ReadFiles, **options: Any) -> "Fit":
    """The fit of the readable recordings; a first pass with an unreadable second pass is used without it."""
    from ..identification import identify
    from ..identification.result import with_unreadable

    if seconds and len(seconds) != len(done):
        limit, step = f"there are {len(done)} first passes", "Give one for each first pass, in the same order."
        raise InputError("number of --second-pass files", len(seconds), limit, next_step=step)
    kept = [k for k, (_, recording) in enumerate(done) if not isinstance(recording, InputError)]
    firsts = [done[k][1] for k in kept]
    others = [None if isinstance(seconds[k][1], InputError) else seconds[k][1] for k in kept] if seconds else []
    unreadable = [(str(file), problem) for file, problem in done + seconds if isinstance(problem, InputError)]
    return with_unreadable(identify(firsts, second_pass=others, **options) if firsts else None, unreadable)


def _print_assumptions(done: ReadFiles) -> None:
    """Print each assumption once, with the number of files that share it."""
    counts: dict[str, int] = {}
    for _, recording in done:
        for sentence in getattr(getattr(recording, "card", None), "assumptions", ()):
            counts[sentence] = counts.get(sentence, 0) + 1
    for sentence, count in counts.items():
        say(f"assumed: {sentence}" + (f" ({count} files)" if count > 1 else ""))


def _write(fit: "Fit", given: IdentifyFlags) -> None:
    write_json(fit.to_json(), given.json)
    given.page.write(fit.report)
    if fit.identified_model is not None:
        write_file("model", given.save, fit.save)
    elif given.save is not None:
        say(f"{given.save}: not written, because no model was identified")
    write_file("estimates", given.csv, fit.to_csv)
    if given.draws is None:
        return
    try:
        drawn = fit.draws()
    except InputError as error:
        say(f"{given.draws}: not written: {error}")
    else:
        write_file("draws", given.draws, drawn.save)


def _show(fit: "Fit", quiet: bool) -> None:
    for each in fit.recordings:
        if not each.parameters:
            notes = (note if note.endswith(".") else f"{note}." for note in each.notes)
            say(f"{each.file}: {each.status}: " + " ".join(notes))
    if quiet:
        return
    table("events", ["file", "status", "contact", "punctures", "exit"], [_events(each) for each in fit.recordings])
    _show_parameters(fit)
    if fit.quality is not None:
        say(f"residual: {fit.quality}")
    if hasattr(fit.settings, "evidence"):
        _show_evidence(fit.settings)
    ratio = None if fit.settings is None else fit.settings.lateral_over_axial_force
    if ratio is not None:
        say(f"lateral forces: {100 * ratio:.0f} % of the axial force")
    for warning in fit.warnings:
        say(f"warning: {warning}")
    _show_notes(fit)
    for bias in fit.two_pass.biases if fit.two_pass else ():
        say(f"two passes: {bias}")


def _show_notes(fit: "Fit") -> None:
    """Print the notes on the recordings with parameters, each once, with the files that it is about if not all."""
    noted: dict[str, list[str]] = {}
    for each in fit.recordings:
        for note in each.notes if each.parameters else ():
            noted.setdefault(note, []).append(Path(each.file).name)
    for note, files in noted.items():
        say(f"note: {note}" if len(files) == len(fit.recordings) else f"note: {', '.join(files)}: {note}")


def _show_parameters(fit: "Fit") -> None:
    """Print one table of parameters, or one for each layer with the names within the layer."""
    from ..identification.report.words import by_layer
    from ..identification.statistics.noise import INTERVAL

    repeated = any(estimate.between_repeats_sd is not None for estimate in fit.parameters.values())
    systematic = any(estimate.systematic_share for estimate in fit.parameters.values())
    within = any(estimate.within_run_sd is not None for estimate in fit.parameters.values())
    spread = ["sd between repeats" + ", within run" * within] if repeated else []
    sources = {estimate.source for estimate in fit.parameters.values()}
    many = len(sources) > 1
    for layer, parameters in by_layer(fit.parameters).items():
        rows = [
            [
                *(name, e.shown),
                *[e.systematic_share] * systematic,
                *[", ".join(filter(None, map(e.spread, (e.between_repeats_sd, e.within_run_sd))))] * repeated,
                *(e.known, *[e.source] * many),
            ]
            for name, e in parameters.items()
        ]
        heads = ["quantity", f"value, {INTERVAL}", *["systematic"] * systematic, *spread, "identifiable"]
        heads += ["how"] * many
        table(f"identified, {layer}" if layer else "identified", heads, rows)
    if sources and not many:
        say(f"how: {sources.pop()}")


def _show_evidence(settings: "LayeredSettings") -> None:
    from ..identification.report.tables import EVIDENCE, evidence_rows, evidence_words

    table("choice of layers and mechanisms", EVIDENCE, evidence_rows(settings.evidence))
    say(f"choice: {evidence_words(settings)}")


def _events(each: "RecordingFit") -> list[str]:
    events = each.events
    place = [f"{1e3 * event.depth:.2f} mm" if event is not None else "-" for event in (events.contact, events.exit)]
    punctures = ", ".join(f"{1e3 * p.depth:.2f} mm {p.force:.3g} N" for p in events.punctures) or "-"
    return [Path(each.file).name, str(each.status), place[0], punctures, place[1]]
