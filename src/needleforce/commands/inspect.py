# SPDX-License-Identifier: Apache-2.0
"""``needleforce inspect``: what a file is, what is assumed of it, what is missing, and the command that reads it;
``needleforce FILE``: a short look, its model and a report, or of a folder the command for its recordings."""

import filecmp
import os
import shlex
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import chain, count
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import msgspec
import typer

from ..display.quantities import span_scale
from ..errors import InputError
from ..recording.options import ReadOptions
from .files import ReadFiles
from .flags import takes_flags
from .identify import IdentifyFlags, identify_files
from .output import check_outputs, progress, say, show, table

if TYPE_CHECKING:
    import numpy as np

    from ..recording import Recording
    from ..recording.look import Look
    from ..segmentation import Events

SAVE_HELP = (
    "Keep the options under a name, for --as, or in a TOML file; one named needleforce.toml applies to its folder."
)
PLACE = "FILE"  # of a file or folder instead of a command
_DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))  # of a Braille character, by row and column
_BRAILLE, _UPPER_HALF = 0x2800, 0x1B


@takes_flags("motion", "start_depth")
def run(
    file: Annotated[Path, typer.Argument(help="A file of any format, or the folder of a bag.", show_default=False)],
    *,
    reading: ReadOptions,
    plot: Annotated[bool, typer.Option(help="Draw the force over the depth in the terminal.")] = True,
    figure: Annotated[Path | None, typer.Option(help="Write the plot as a picture: .png, .svg or .pdf.")] = None,
    save: Annotated[str | None, typer.Option(help=SAVE_HELP)] = None,
) -> None:
    """Look at a file: its format, recordings, columns and units, what is assumed, and what is missing."""
    from ..recording.reader import read_file

    check_outputs([figure], [file, reading.motion])
    found = None
    for _ in progress([None], "reading"):
        found = read_file(file, replace(reading, dry_run=True))
    _show(found)
    if found.recording is None:
        say(found.problem)
        raise typer.Exit(1)
    if plot:
        _plot(found.recording, _events(found.recording))
    if figure is not None:
        _save_figure(found, figure)
    if save is not None:
        from ..recording.mappings import save_mapping

        say(f"mapping: {save_mapping(replace(found.options, part=None), save)}")
        found = _with_mapping(found, save)
    show(f"\nRead by:\n  {found.command}")


def _with_mapping(found: "Look", saved: str) -> "Look":
    """The look with the command that uses the options that were saved; those of the folder apply without an option."""
    from ..recording.mappings import IN_FOLDER

    own = ReadOptions(part=found.given.part, motion=found.given.motion)
    of_folder = Path(saved).absolute() == Path(found.path).absolute().with_name(IN_FOLDER)
    return replace(found, given=own if of_folder else replace(own, mapping=saved))


def _show(found: "Look") -> None:
    for title, headers, rows in found.tables():
        table(title, list(headers), [list(row) for row in rows])
    if found.recording is None:
        return
    show(_contact(found.recording, _events(found.recording)))
    for sentence in found.recording.card.assumptions:
        show(f"assumed: {sentence}")
    for note in found.recording.notes:
        show(f"note: {note.message}")


def _contact(recording: "Recording", events: "Events | None") -> str:
    """Where the contact is, and the free travel before it."""
    if events is None or events.contact is None:
        return "no contact is found"
    depth = recording.depth
    factor, unit = span_scale(float(depth.min()), float(depth.max()), "m")
    free = factor * (events.contact.depth - float(depth[0]))
    return f"contact at {factor * events.contact.depth:.3f} {unit}" + (
        f", after {free:.3f} {unit} of free travel" if free >= 0.0 else ""
    )


def _events(recording: "Recording") -> "Events | None":
    """Its events; None where it is too short for any."""
    import needleforce as nf

    try:
        return nf.segment(recording)
    except (InputError, ValueError, IndexError):
        return None


def _scaled(recording: "Recording") -> list[tuple[Any, float, str]]:
    """Depth and force in units of a readable size, each with its factor from SI and the label of its axis."""
    axes = []
    for name, values, unit in (("depth", recording.depth, "m"), ("force", recording.force, "N")):
        factor, shown = span_scale(float(values.min()), float(values.max()), unit)
        axes.append((factor * values, factor, f"{name} [{shown}]"))
    return axes


def _plot(recording: "Recording", events: "Events | None") -> None:
    """Draw the force over the depth, with the contact (C) and the punctures (P)."""
    (depth, to_depth, of_depth), (force, to_force, of_force) = _scaled(recording)
    marked = [] if events is None else [("C", events.contact), *(("P", each) for each in events.punctures)]
    marks = [(to_depth * at.depth, to_force * at.force, letter) for letter, at in marked if at is not None]
    show(terminal_plot(depth, force, of_depth, of_force, marks))


def _save_figure(found: "Look", figure: Path) -> None:
    from ..display.axes import axes_for, finish
    from ..display.canvas import MEASURED

    (depth, _, of_depth), (force, _, of_force) = _scaled(found.recording)
    axes = axes_for()
    axes.plot(depth, force, color=MEASURED, lw=0.9)
    finish(axes, of_depth, of_force, found.recording.name).figure.savefig(figure)
    say(f"figure: {figure}")


def terminal_plot(
    x: "np.ndarray",
    y: "np.ndarray",
    x_label: str,
    y_label: str,
    marks: Sequence[tuple[float, float, str]] = (),
    *,
    height: int = 14,
) -> str:
    """``y`` over ``x``, finite (n,), as dots of at most 64 by ``height`` characters, with the limits of both axes and
    the letters of ``marks`` at their places; without Unicode, or where the terminal is narrow, in what it has."""
    import shutil

    import numpy as np

    if not len(x):
        return ""
    braille = (sys.stdout.encoding or "").lower().startswith("utf") and os.environ.get("TERM") not in ("linux", "dumb")
    limits = [f"{y.max():.4g}", *[""] * (height - 2), f"{y.min():.4g}"]
    margin = max(map(len, limits))
    width = max(16, min(64, shutil.get_terminal_size().columns - margin - 4))
    columns = _positions(np.append(x, [mark[0] for mark in marks]), x, 2 * width)
    rows = 4 * height - 1 - _positions(np.append(y, [mark[1] for mark in marks]), y, 4 * height)
    cells = np.zeros((height, width), int)
    for row, column in set(zip(rows[: len(x)].tolist(), columns[: len(x)].tolist(), strict=True)):
        cells[row // 4, column // 2] |= _DOTS[row % 4][column % 2]
    lines = [[_character(cell, braille) for cell in line] for line in cells.tolist()]
    for (_, _, letter), row, column in zip(marks, rows[len(x) :], columns[len(x) :], strict=True):
        lines[row // 4][column // 2] = letter
    edge = "┤" if braille else "|"
    drawn = [f"{limit:>{margin}} {edge}{''.join(line)}" for limit, line in zip(limits, lines, strict=True)]
    ends = f"{x.min():.4g}", f"{x.max():.4g}"
    below = " " * (margin + 2) + ends[0] + x_label.center(width - len(ends[0]) - len(ends[1])) + ends[1]
    return "\n".join([" " * (margin + 2) + y_label, *drawn, below])


def _character(cell: int, braille: bool) -> str:
    """The dots of a cell; without Braille whether any are in its upper and in its lower half."""
    return chr(_BRAILLE + cell) if braille else " '.:"[bool(cell & _UPPER_HALF) + 2 * bool(cell & ~_UPPER_HALF)]


def _positions(values: "np.ndarray", scale: "np.ndarray", count: int) -> "np.ndarray":
    """Indices from 0 to ``count - 1`` of the values, in proportion from the least to the largest of ``scale``."""
    import numpy as np

    span = float(np.ptp(scale))
    share = (values - scale.min()) / span if span > 0.0 else np.zeros(len(values))
    return np.rint(np.clip(share, 0.0, 1.0) * (count - 1)).astype(int)


@takes_flags("motion", "start_depth", "filter_length")
def first_look(
    files: Annotated[
        list[Path],
        typer.Argument(metavar="FILE", help="A recording, repeats of one, or a folder of recordings."),
    ],
    given: IdentifyFlags,
) -> None:
    """Look at a recording: its curve, its model, and a report. Of a folder: the command for all in it."""
    from ..recording.formats.detect import ROS2_BAG, format_of

    if files[0].is_dir() and format_of(files[0]) != ROS2_BAG:
        _propose_campaign(files)
        return
    # never over a file that is there
    folder = Path() if os.access(os.curdir, os.W_OK) else Path(tempfile.gettempdir())
    *taken, report = [given.page.report] if given.page.report else _names(folder / f"{files[0].stem}_report.html")
    given = msgspec.structs.replace(given, page=msgspec.structs.replace(given.page, report=report))
    identify_files(files, given, lambda done: _glance(done, given))
    if taken and taken[-1].is_file() and not given.page.open and filecmp.cmp(taken[-1], report, shallow=False):
        report.unlink()
        say(f"{report}: removed, as {taken[-1]} is the same")


def _names(path: Path) -> Iterator[Path]:
    """The path, then with numbers before its ending, up to the first that is not there."""
    for each in chain([path], (path.with_name(f"{path.stem}_{number}{path.suffix}") for number in count(2))):
        yield each
        if not os.path.lexists(each):
            return


def _glance(done: ReadFiles, given: IdentifyFlags) -> None:
    """A line and a plot of each recording; the columns of a file that is not read. Ends where none is."""
    from ..recording.reader import read_file

    for file, recording in done:
        if not isinstance(recording, InputError):
            if given.json != "-":
                show(f"{file}: {', '.join(f'{name} {text}' for name, text in recording.cells()[1])}")
                _plot(recording, _events(recording))
        elif len(done) == 1:
            with suppress(InputError):  # such as a file that is missing
                _show(read_file(file, replace(given.reading, dry_run=True)))
            say(str(recording))
            raise typer.Exit(1)


def _propose_campaign(folders: list[Path]) -> None:
    """Print how many recordings are in the folders, and the command that identifies all of them."""
    from ..campaign.campaign import campaign_files

    recordings, others = campaign_files(folders)
    show(f"{', '.join(map(str, folders))}: recordings: {len(recordings)}, other files: {len(others)}")
    name = folders[0].resolve().name or "campaign"
    outputs = ["--table", f"{name}.csv", "--report", f"{name}.html", "--open"]
    show(
        f"\nEach condition is identified by:\n  {shlex.join(['needleforce', 'campaign', *map(str, folders), *outputs])}"
    )
