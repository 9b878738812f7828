# SPDX-License-Identifier: Apache-2.0
"""``needleforce presets``: all shipped parameter sets with their sources and doubts, and published single values."""

from typing import TYPE_CHECKING, Annotated

import typer

from .output import JSON_HELP, check_outputs, table, write_json

if TYPE_CHECKING:
    from ..models.model import Layer, Model

PUBLISHED_HELP = "List published single values, which form no complete model, instead of the presets."


def run(
    published: Annotated[bool, typer.Option("--published", help=PUBLISHED_HELP)] = False,
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None,
) -> None:
    """List the shipped parameter sets with their sources and doubts, or published single values."""
    check_outputs([json])
    title, columns, rows, document = _published() if published else _presets()
    write_json(document, json)
    if json != "-":
        table(title, columns, rows)


def _presets() -> tuple:
    from .. import preset
    from .. import presets as names
    from ..models.named_models import names_of

    models = [preset(name) for name in names()]
    rows = [_row(model, names_of(model)) for model in models]
    columns = ["preset", "model", "summary", "reference", "doubts", "state"]
    return "presets", columns, rows, [_described(model) | {"models": list(names_of(model))} for model in models]


def _published() -> tuple:
    from dataclasses import asdict

    from ..references import published_values, works

    values = published_values()
    columns = ["tissue", "quantity", "value", "unit", "method", "state", "source", "note"]
    rows = [[v.tissue, v.quantity, v.value, v.unit, v.method, v.status, v.source, v.note] for v in values]
    document = [asdict(v) | {"status": v.status, "reference": works()[v.source].reference} for v in values]
    return "published values", columns, rows, document


def _row(model: "Model", names: tuple[str, ...]) -> list[str]:
    doubts, state = str(len(model.doubts)), "unverified" if model.unverified else "verified"
    return [model.name, " or ".join(names), model.summary, model.reference, doubts, state]


def _described(model: "Model") -> dict:
    first, *deeper = [_laws(layer) for layer in model.layers]
    about = {"name": model.name, "summary": model.summary, "reference": model.reference}
    doubts = {"doubts": list(model.doubts), "unverified": list(model.unverified), "citations": list(model.citations)}
    return about | doubts | first | ({"layers": deeper} if deeper else {})


def _laws(layer: "Layer") -> dict:
    from ..models.laws import FAMILIES

    laws = {part: getattr(layer, part) for part in FAMILIES}
    described = {part: {"law": law.name, **law.parameters()} for part, law in laws.items()}
    return described | ({"top": layer.top} if layer.top else {})
