# SPDX-License-Identifier: Apache-2.0
"""``needleforce simulate``: a preset along an insertion, as a CSV file."""

from pathlib import Path
from typing import Annotated

import typer

from .output import check_outputs, say

NAME = "simulate"


def run(
    output: Annotated[Path, typer.Option("--output", "-o", help="The CSV file to write.")],
    preset: Annotated[str, typer.Option(help="A shipped preset, or a preset file.")] = "paper",
    speed_mm_s: Annotated[float, typer.Option(help="Speed of both strokes.")] = 3.0,
    depth_mm: Annotated[float, typer.Option(help="Deepest point below the undeformed surface.")] = 20.0,
    start_mm: Annotated[float, typer.Option(help="Where the tip starts; negative is above the surface.")] = -5.0,
    hold_s: Annotated[float, typer.Option(help="Rest at the deepest point.")] = 0.0,
    withdraw: Annotated[bool, typer.Option(help="Come out again.")] = True,
    rate_hz: Annotated[float, typer.Option(help="Samples per second.")] = 1000.0,
    citations: Annotated[bool, typer.Option("--citations", help="Also print the references of what was used.")] = False,
) -> None:
    """Simulate an insertion and write it as a recording, without sensor, filter or noise."""
    import needleforce as nf

    check_outputs([output], [preset])
    model = nf.preset(preset)
    motion = nf.Motion.insert(1e-3 * start_mm, 1e-3 * speed_mm_s, 1e-3 * depth_mm, hold_s, withdraw)
    recording = nf.simulate(model, motion, rate_hz)
    nf.write(recording, output)
    for assumption in recording.card.assumptions:
        say(f"note: {assumption}")
    for note in recording.notes:
        say(f"warning: {note.message}")
    say(f"{output}: {len(recording)} samples, largest force {recording.force.max():.3f} N")
    for reference in model.citations if citations else ():
        print(reference)
