# SPDX-License-Identifier: Apache-2.0
"""``needleforce rig``: the virtual rig on the network, until Ctrl-C."""

from contextlib import suppress
from typing import Annotated

import typer

from ..wire.axis_lines import PORT as AXIS_PORT
from ..wire.rdt import PORT as SENSOR_PORT
from ..wire.sensor_configuration import PAGE

NAME = "rig"


def run(
    preset: Annotated[
        str | None, typer.Option(help="A preset or preset file as tissue; else the paper's phantom.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Sites, sensor, noise and faults are drawn from it.")] = 1,
    sensor_port: Annotated[int, typer.Option(help="UDP port of the sensor, 0 for any free one.")] = SENSOR_PORT,
    axis_port: Annotated[int, typer.Option(help="TCP port of the axis, 0 for any free one.")] = AXIS_PORT,
    page_port: Annotated[int, typer.Option(help=f"HTTP port of {PAGE}, 0 for any free one.")] = AXIS_PORT + 1,
    listen: Annotated[
        str, typer.Option(help="Address to listen at; beyond this computer, anybody may drive.")
    ] = "127.0.0.1",
    filter_length: Annotated[int, typer.Option(help="Samples of the sensor's average filter at 1 kHz.")] = 10,
    fault: Annotated[list[str] | None, typer.Option(help="As lost=0.05; repeat it. docs/rig.md has all.")] = None,
    duration_s: Annotated[float | None, typer.Option(min=0.0, help="End after so long; else Ctrl-C ends it.")] = None,
) -> None:
    """Run the paper's rig as software: a six-axis sensor and a motion axis that speak over the network."""
    import needleforce as nf

    from ..rig import Sensor
    from ..rig.live import VirtualRig, parse_fault

    faults = dict(map(parse_fault, fault or []))
    model = nf.preset(preset) if preset else None
    ports = {"sensor_port": sensor_port, "axis_port": axis_port, "page_port": page_port}
    with VirtualRig(model, seed, faults, sensor=Sensor(filter_length), listen=listen, say=_say, **ports) as rig:
        where = f"sensor {listen}:{rig.sensor_port}, axis {listen}:{rig.axis_port}"
        _say(f"ready: {where}, page http://{listen}:{rig.page_port}/{PAGE}")
        try:
            rig.ended.wait(duration_s)
        except KeyboardInterrupt:
            _say("rig: ended")


def _say(line: str) -> None:
    with suppress(BrokenPipeError):  # who read this is gone; the rig goes on
        print(line, flush=True)
