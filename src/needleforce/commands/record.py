# SPDX-License-Identifier: Apache-2.0
"""``needleforce record``: from a sensor and an axis to a file, while it happens."""

import math
from pathlib import Path
from typing import Annotated

import typer

from ..errors import InputError
from .output import JSON_HELP, check_outputs, say, table, write_json

NAME = "record"
SENSOR_HELP = "HOST or HOST:PORT of a Net F/T sensor (RDT over UDP)."
PAGE_HELP = "The sensor's configuration: a URL, or a saved netftapi2.xml; without it the page of the sensor's host."
LIMIT_HELP = "Axial force without bias at which the axis is stopped; without it 0.8 of the sensor's rating."
_SHARE = 0.8  # of the rating of a sensor


def run(
    output: Annotated[Path | None, typer.Option("--output", "-o", help="The MCAP file to write; must not exist.")] = None,
    sensor: Annotated[str | None, typer.Option(help=SENSOR_HELP)] = None,
    sensor_page: Annotated[str, typer.Option(help=PAGE_HELP)] = "",
    axis: Annotated[str | None, typer.Option(help="HOST or HOST:PORT of a motion axis.")] = None,
    depth_mm: Annotated[float | None, typer.Option(help="Deepest point of the insertion.")] = None,
    speed_mm_s: Annotated[float | None, typer.Option(help="Speed of both strokes.")] = None,
    hold_s: Annotated[float, typer.Option(help="Rest at the deepest point.")] = 0.0,
    start_mm: Annotated[float, typer.Option(help="Where the tip starts and ends.")] = -5.0,
    duration_s: Annotated[float | None, typer.Option(help="How long, where no axis moves; else until Ctrl-C.")] = None,
    force_limit_n: Annotated[float | None, typer.Option("--force-limit-N", help=LIMIT_HELP)] = None,
    steady_n: Annotated[float, typer.Option("--steady-N", help="How far the force may wander during the bias.")] = 0.05,
    bias_s: Annotated[float, typer.Option(help="Time at rest for the bias; 0 for none.")] = 0.5,
    axial: Annotated[str, typer.Option(help="The sensor's axis along the needle: fz, -fz, fx, …")] = "fz",
    filter_length: Annotated[int, typer.Option(help="Samples in the sensor's average filter.")] = 1,
    source: Annotated[str | None, typer.Option("--from", help="- for lines on standard input.")] = None,
    calibration: Annotated[Path | None, typer.Option(help="Calibration of six gauge voltages.")] = None,
    protocol: Annotated[str | None, typer.Option(help="paper, or a protocol file.")] = None,
    folder: Annotated[Path | None, typer.Option(help="Folder for the recordings of a protocol.")] = None,
    needle: Annotated[str, typer.Option(help="For the card of the recording.")] = "",
    tissue: Annotated[str, typer.Option(help="For the card of the recording.")] = "",
    plain: Annotated[bool, typer.Option("--plain", help="A line a second instead of a panel.")] = False,
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None,
) -> None:
    """Record force and depth, with bias, losses and clocks; a force limit stops the axis, Ctrl-C ends cleanly.

    Exit code 0: done, or ended by Ctrl-C; 1: ended by something else, with what there is kept; 2: could not begin.
    """
    from ..acquisition.recorder import record_run
    from ..acquisition.settings import Settings

    check_outputs([json], [])
    _check(output, sensor, source, axis, protocol, folder, depth_mm, speed_mm_s)
    moves = [] if depth_mm is None else _moves(1e-3 * start_mm, 1e-3 * depth_mm, 1e-3 * speed_mm_s, hold_s)
    told = {"bias_time": bias_s, "duration": duration_s, "axial": axial, "filter_length": filter_length}
    open_sources = _sources(sensor, sensor_page, axis, source, calibration)
    force, moved = open_sources()
    try:
        limit = _limit(force_limit_n, force, moved, axial)
        settings = Settings(limit, steady=steady_n, **told)
    except InputError:
        if moved:
            moved.close()
        raise
    card = {"needle": needle, "tissue": tissue, "rig": sensor or "standard input"}
    from ..acquisition.live_view import live_view

    with live_view(plain) as view:
        outcome = record_run(output, force, moved, moves, card, settings, view=view)
    _tell(outcome, json)
    if outcome.ended not in ("done", "interrupted", "source ended"):
        raise typer.Exit(1)
