# SPDX-License-Identifier: Apache-2.0
"""``needleforce inspect``: what a file is, what is assumed of it, what is missing, and the command that reads it."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..display.quantities import span_scale
from ..errors import InputError
from ..recording.options import ReadOptions
from .flags import takes_flags
from .output import check_outputs, progress, say, show, table

if TYPE_CHECKING:
    import numpy as np

    from ..recording.look import Look

NAME = "inspect"
SAVE_HELP = (
    "Keep the options under a name, for --as, or in a TOML file; one named needleforce.toml applies to its folder."
)
_DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))  # of a Braille character, by row and column
_BRAILLE = 0x2800


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
        _plot(found)
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
    show(_contact(found))
    for sentence in found.recording.card.assumptions:
        show(f"assumed: {sentence}")
    for note in found.recording.notes:
        show(f"note: {note.message}")


def _contact(found: "Look") -> str:
    """Where the contact is, and the free travel before it."""
    import needleforce as nf

    try:
        contact = nf.segment(found.recording).contact
    except (InputError, ValueError, IndexError):
        contact = None
    if contact is None:
        return "no contact is found"
    depth = found.recording.depth
    factor, unit = span_scale(float(depth.min()), float(depth.max()), "m")
    free = factor * (contact.depth - float(depth[0]))
    return f"contact at {factor * contact.depth:.3f} {unit}" + (
        f", after {free:.3f} {unit} of free travel" if free >= 0.0 else ""
    )


def _scaled(found: "Look") -> list[tuple[Any, str]]:
    """Depth and force in units of a readable size, each with the label of its axis."""
    axes = []
    for name, values, unit in (("depth", found.recording.depth, "m"), ("force", found.recording.force, "N")):
        factor, shown = span_scale(float(values.min()), float(values.max()), unit)
        axes.append((factor * values, f"{name} [{shown}]"))
    return axes


def _plot(found: "Look") -> None:

    (depth, of_depth), (force, of_force) = _scaled(found)
    show(terminal_plot(depth, force, of_depth, of_force))


def _save_figure(found: "Look", figure: Path) -> None:
    from ..display.axes import axes_for, finish
    from ..display.canvas import MEASURED

    (depth, of_depth), (force, of_force) = _scaled(found)
    axes = axes_for()
    axes.plot(depth, force, color=MEASURED, lw=0.9)
    finish(axes, of_depth, of_force, found.recording.name).figure.savefig(figure)
    say(f"figure: {figure}")


def terminal_plot(
    x: "np.ndarray", y: "np.ndarray", x_label: str, y_label: str, *, width: int = 64, height: int = 14
) -> str:
    """``y`` over ``x``, finite (n,), as dots of ``width`` by ``height`` characters, with the limits of both axes."""
    import numpy as np

    if not len(x):
        return ""
    columns = _positions(x, 2 * width)
    rows = 4 * height - 1 - _positions(y, 4 * height)
    cells = np.zeros((height, width), int)
    for row, column in set(zip(rows.tolist(), columns.tolist(), strict=True)):
        cells[row // 4, column // 2] |= _DOTS[row % 4][column % 2]
    lines = ["".join(chr(_BRAILLE + cell) for cell in line) for line in cells]
    limits = [f"{y.max():.4g}", *[""] * (height - 2), f"{y.min():.4g}"]
    margin = max(map(len, limits))
    drawn = [f"{limit:>{margin}} ┤{line}" for limit, line in zip(limits, lines, strict=True)]
    ends = f"{x.min():.4g}", f"{x.max():.4g}"
    below = " " * (margin + 2) + ends[0] + x_label.center(width - len(ends[0]) - len(ends[1])) + ends[1]
    return "\n".join([" " * (margin + 2) + y_label, *drawn, below])


def _positions(values: "np.ndarray", count: int) -> "np.ndarray":
    """Indices from 0 to ``count - 1`` in proportion to the values."""
    import numpy as np

    span = float(np.ptp(values))
    return (
        np.rint((values - values.min()) / span * (count - 1)).astype(int) if span > 0.0 else np.zeros(len(values), int)
    )
