# SPDX-License-Identifier: Apache-2.0
"""The options of a command that say which tip, or tips, indent."""

import math
from pathlib import Path

from ..errors import InputError

SHAPES = {
    "cone": ("Cone", "half_angle"),
    "paraboloid": ("Paraboloid", "radius"),
    "sphere": ("Sphere", "radius"),
    "flat": ("Flat", "radius"),
    "blunted_cone": ("BluntedCone", "half_angle", "radius"),
    "truncated_cone": ("TruncatedCone", "half_angle", "radius"),
}
NUMBERS = {"half_angle": "--half-angle-deg", "radius": "--radius-um"}
TIP_HELP = f"{', '.join(SHAPES)}; repeat it to compare. With --half-angle-deg and --radius-um, as the shape needs."


def tips_of(
    shapes: list[str], half_angle_deg: float | None, radius_um: float | None, needle: Path | None
) -> tuple[list, float | None]:
    """The tips asked for, and the radius [m] of their shank, None without one. Raises InputError for wrong usage."""
    from ..core import tips
    from ..preset_files.needle_file import read_needle

    if bool(shapes) == (needle is not None):
        raise InputError("tip", next_step="Give --tip, or --needle with a file that has one.")
    given = {
        "half_angle": None if half_angle_deg is None else math.radians(half_angle_deg),
        "radius": None if radius_um is None else radius_um / 1e6,
    }
    _known(shapes, given)
    if needle is not None:
        body = read_needle(needle)
        if body.tip is None:
            raise InputError("needle.tip", "missing", place=needle.name, next_step="Add a section [needle.tip].")
        return [body.tip], body.radius
    return [getattr(tips, SHAPES[shape][0])(*_numbers(shape, given)) for shape in shapes], None


def _known(shapes: list[str], given: dict[str, float | None]) -> None:
    """InputError for a shape that is not known, and for a number that no shape takes."""
    for shape in shapes:
        if shape not in SHAPES:
            raise InputError("--tip", repr(shape), f"known are {', '.join(SHAPES)}", next_step="Others: --needle.")
    for name, value in given.items():
        if value is not None and not any(name in SHAPES[shape] for shape in shapes):
            raise InputError(NUMBERS[name], "given", "no tip asked for has such a number", next_step="Leave it out.")


def _numbers(shape: str, given: dict[str, float | None]) -> list[float]:
    for name in SHAPES[shape][1:]:
        if given[name] is None:
            raise InputError(f"{name} of the {shape}", "missing", next_step=f"Give {NUMBERS[name]}.")
    return [given[name] for name in SHAPES[shape][1:]]
