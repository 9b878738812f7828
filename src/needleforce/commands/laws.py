# SPDX-License-Identifier: Apache-2.0
"""``needleforce laws``: every law with its parameters, ranges, units and sources."""

from typing import Annotated

import typer

from .output import JSON_HELP, check_outputs, table, write_json

NAME = "laws"


def run(json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None) -> None:
    """List every law with its parameters, ranges, units and sources."""
    from ..preset_files.schema import FAMILIES, laws_of

    laws = [law for family in FAMILIES for law in laws_of(family)]
    check_outputs([json])
    write_json([_described(law) for law in laws], json)
    if json != "-":
        table(
            "laws",
            ["law", "part", "parameter", "unit", "range", "default", "meaning", "source"],
            [row for law in laws for row in _rows(law)],
        )


def _described(law) -> dict:
    about = {key: getattr(law, key) for key in ("name", "family", "summary", "source", "validity")}
    return about | {"parameters": law.table()}


def _rows(law) -> list[list[str]]:
    rows = []
    for k, parameter in enumerate(law.table()):
        default = "" if parameter["default"] is None else f"{parameter['default']:g}"
        rows.append(
            [
                law.name if k == 0 else "",
                law.family if k == 0 else "",
                parameter["name"],
                parameter["unit"],
                f"{parameter['low']:g} to {parameter['high']:g}",
                default,
                parameter["meaning"],
                parameter["source"],
            ]
        )
    return rows
