# SPDX-License-Identifier: Apache-2.0
"""``needleforce simulate``: simulate an insertion with a preset and write it as a recording."""

from pathlib import Path
from typing import Annotated

import msgspec
import typer

from .files import PRESET_HELP
from .flags import takes_flags
from .output import check_outputs, say, show


class SimulateFlags(msgspec.Struct, frozen=True, kw_only=True):
    """The flags of ``simulate``."""

    output: Annotated[Path, typer.Option("--output", "-o", help="File to write: .csv, .parquet or .mcap.")]
    preset: Annotated[str, typer.Option(help=PRESET_HELP)] = "paper"
    speed_mm_s: Annotated[float, typer.Option(help="Speed of insertion and withdrawal.")] = 3.0
    depth_mm: Annotated[float, typer.Option(help="Maximum depth below the undeformed surface.")] = 20.0
    start_mm: Annotated[
        float, typer.Option(help="Depth of the tip at the start; negative is above the surface.")
    ] = -5.0
    hold_s: Annotated[float, typer.Option(help="Hold at the maximum depth.")] = 0.0
    withdraw: Annotated[bool, typer.Option(help="Withdraw the needle after the hold.")] = True
    rate_hz: Annotated[float, typer.Option(help="Sampling rate.")] = 1000.0
    tissue: Annotated[
        Path | None, typer.Option(help="Condensed solid that the needle drags along, of CondensedTissue.save (.toml).")
    ] = None
    citations: Annotated[
        bool, typer.Option("--citations", help="Also print the references of the laws and values used.")
    ] = False


@takes_flags()
def run(given: SimulateFlags) -> None:
    """Simulate an insertion and write it as a recording, without sensor, filter or noise."""
    import needleforce as nf

    check_outputs([given.output], [given.preset, given.tissue])
    model = nf.preset(given.preset)
    motion = nf.Motion.insert(
        1e-3 * given.start_mm, 1e-3 * given.speed_mm_s, 1e-3 * given.depth_mm, given.hold_s, given.withdraw
    )
    solid = nf.fe.load_condensed(given.tissue) if given.tissue else None
    recording = nf.simulate(model, motion, given.rate_hz, tissue=solid)
    nf.write(recording, given.output)
    for assumption in recording.card.assumptions:
        say(f"note: {assumption}")
    for note in recording.notes:
        say(f"warning: {note.message}")
    say(f"{given.output}: {len(recording)} samples, largest force {recording.force.max():.3f} N")
    for reference in model.citations if given.citations else ():
        show(reference)
