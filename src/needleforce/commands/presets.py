# SPDX-License-Identifier: Apache-2.0
"""``needleforce presets``: every shipped parameter set with its source and doubts."""

from typing import Annotated

import typer

from .output import JSON_HELP, check_outputs, table, write_json

NAME = "presets"


def run(json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None) -> None:
    """List the shipped parameter sets with their sources and doubts."""
    from .. import preset
    from .. import presets as names

    models = [preset(name) for name in names()]
    check_outputs([json])
    write_json([_described(model) for model in models], json)
    if json != "-":
        table(
            "presets",
            ["preset", "summary", "reference", "doubts"],
            [[model.name, model.summary, model.reference, str(len(model.doubts))] for model in models],
        )


def _described(model) -> dict:
    laws = {
        part: {"law": getattr(model, part).name, **getattr(model, part).parameters()}
        for part in ("stiffness", "puncture", "friction", "cutting")
    }
    return {
        "name": model.name,
        "summary": model.summary,
        "reference": model.reference,
        "doubts": list(model.doubts),
        **laws,
    }
