# SPDX-License-Identifier: Apache-2.0
"""``needleforce export``: a model as a C++ or C header of constants, for a controller without file access."""

from pathlib import Path
from typing import Annotated

import typer

from .output import check_outputs, say, show

MODEL_HELP = "JSON written by identify, a preset file, or the name of a shipped preset."
NAME_HELP = "Name of the constant; default: the name of the file or preset."


def run(
    model: Annotated[str, typer.Argument(help=MODEL_HELP, show_default=False)],
    language: Annotated[str, typer.Option(help="c++ or c for a header, c# or json.")] = "c++",
    name: Annotated[str | None, typer.Option(help=NAME_HELP)] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="File to write; default: print it.")] = None,
) -> None:
    """Write a model as a C++ or C header of constants, for a controller without file access, as C# or as JSON."""
    from ..export import header, identifier, model_source
    from ..files import atomic_write

    check_outputs([output], [model])
    found = model_source(model)
    text = header(found.model, language, identifier(found.name) if name is None else name, found.sources)
    for line in found.sources:
        if line.startswith("Warning: "):
            say(line)
    if output is None:
        show(text.removesuffix("\n"))
        return
    with atomic_write(output) as file:
        file.write(text)
    say(f"{output}: {found.model.name}, layers: {len(found.model.layers)}")
