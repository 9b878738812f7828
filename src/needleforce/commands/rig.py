# SPDX-License-Identifier: Apache-2.0
"""``needleforce rig``: the virtual rig as network servers, until Ctrl-C."""

from contextlib import suppress
from typing import Annotated

import msgspec
import typer

from ..wire.axis_lines import PORT as AXIS_PORT
from ..wire.net_ft import PAGE
from ..wire.net_ft import PORT as SENSOR_PORT
from .files import PRESET_HELP
from .flags import takes_flags


class RigFlags(msgspec.Struct, frozen=True, kw_only=True):
    """The flags of ``rig``."""

    preset: Annotated[str | None, typer.Option(help=f"{PRESET_HELP} Default: the paper's phantom.")] = None
    seed: Annotated[int, typer.Option(help="Seed of the sites, the sensor, the noise and the faults.")] = 1
    sensor_port: Annotated[int, typer.Option(help="UDP port of the sensor, 0 for any free one.")] = SENSOR_PORT
    axis_port: Annotated[int, typer.Option(help="TCP port of the axis, 0 for any free one.")] = AXIS_PORT
    page_port: Annotated[int, typer.Option(help=f"HTTP port of {PAGE}, 0 for any free one.")] = AXIS_PORT + 1
    listen: Annotated[
        str, typer.Option(help="Address to listen on; other than 127.0.0.1, anyone in the network can move the axis.")
    ] = "127.0.0.1"
    filter_length: Annotated[int, typer.Option(help="Samples in the sensor's average filter, at 1 kHz.")] = 10
    fault: Annotated[
        list[str] | None,
        typer.Option(help="Fault to simulate, such as lost=0.05; may be repeated (list: docs/reference/rig.md)."),
    ] = None
    duration_s: Annotated[
        float | None, typer.Option(min=0.0, help="End after this time; default: run until Ctrl-C.")
    ] = None


@takes_flags()
def run(given: RigFlags) -> None:
    """Run a simulation of the paper's rig: a six-axis sensor and a motion axis as network servers."""
    import needleforce as nf

    from ..rig import Sensor
    from ..rig.live import VirtualRig, parse_fault

    faults = dict(map(parse_fault, given.fault or []))
    model = nf.preset(given.preset) if given.preset else None
    ports = {"sensor_port": given.sensor_port, "axis_port": given.axis_port, "page_port": given.page_port}
    sensor = Sensor(given.filter_length)
    try:
        with VirtualRig(model, given.seed, faults, sensor=sensor, listen=given.listen, say=_say, **ports) as rig:
            where = f"sensor {given.listen}:{rig.sensor_port}, axis {given.listen}:{rig.axis_port}"
            _say(f"ready: {where}, page http://{given.listen}:{rig.page_port}/{PAGE}")
            rig.ended.wait(given.duration_s)
    except KeyboardInterrupt:
        _say("rig: ended")


def _say(line: str) -> None:
    with suppress(BrokenPipeError):  # the reader has closed the pipe; the rig continues
        print(line, flush=True)
