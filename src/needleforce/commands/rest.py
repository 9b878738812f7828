# SPDX-License-Identifier: Apache-2.0
"""``needleforce rest``: whether a needle held in tissue comes to rest in a device's loop, and the stretch it needs."""

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec
import typer

from .files import PRESET_HELP
from .flags import takes_flags
from .output import JSON_HELP, check_outputs, say, table, write_json

if TYPE_CHECKING:
    from ..control import RestResult


class RestFlags(msgspec.Struct, frozen=True, kw_only=True):
    """The flags of ``rest``."""

    mass_g: Annotated[float, typer.Option(help="Apparent mass of the device at the needle.", show_default=False)]
    damping_ns_m: Annotated[
        float, typer.Option(help="Damping [N s/m] of the device and of the hand that holds it.", show_default=False)
    ]
    preset: Annotated[str, typer.Option(help=PRESET_HELP)] = "paper"
    stiffness_n_m: Annotated[float, typer.Option(help="Stiffness [N/m] of what holds the device in its place.")] = 0.0
    rate_hz: Annotated[float, typer.Option(help="Cycles of the loop per second.")] = 1000.0
    lag_ms: Annotated[float, typer.Option(help="Time constant of the actuator.")] = 0.0
    delay: Annotated[int, typer.Option(help="Whole cycles between a depth and its force.")] = 0
    controller_damping_ns_m: Annotated[float, typer.Option(help="Damping [N s/m] that the controller adds.")] = 0.0
    depth_mm: Annotated[
        float | None, typer.Option(help="Largest depth; default: length of the needle, or twice the last puncture.")
    ] = None
    margin: Annotated[float, typer.Option(help="Gain margin of the stretch and the damping proposed.")] = 2.0
    save: Annotated[Path | None, typer.Option(help="Write the model with the stretch as a preset file.")] = None
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None


@takes_flags()
def run(given: RestFlags) -> None:
    """Prove that a needle held in tissue comes to rest in a device's loop, or show an oscillation."""
    import needleforce as nf

    from ..control import Device, rest_in_loop

    check_outputs([given.save, given.json], [given.preset])
    device = Device(
        mass=1e-3 * given.mass_g,
        damping=given.damping_ns_m,
        stiffness=given.stiffness_n_m,
        rate=given.rate_hz,
        lag=1e-3 * given.lag_ms,
        delay=given.delay,
        controller_damping=given.controller_damping_ns_m,
    )
    depth = None if given.depth_mm is None else 1e-3 * given.depth_mm
    result = rest_in_loop(nf.preset(given.preset), device, depth=depth, margin=given.margin)
    write_json(_document(result), given.json)
    if given.json != "-":
        table(f"{result.model.name}: {result.verdict}", ["quantity", "value", "meaning"], result.rows)
        say(result.reason)
    if given.save is not None:
        from ..preset_files.build import save as write

        write(result.with_stretch(), given.save)
        say(f"{given.save}: {result.model.name}, stretched by {result.stretch_factor:.4g}")


def _document(result: "RestResult") -> dict:
    fields = {field.name: getattr(result, field.name) for field in dataclasses.fields(result)}
    found = result.counterexample
    changes = [{"parameter": p, "present": a, "stretched": b} for p, a, b in result.changes]
    return fields | {
        "model": result.model.name,
        "device": dataclasses.asdict(result.device),
        "counterexample": found and dataclasses.asdict(found),
        "changes": changes,
    }
