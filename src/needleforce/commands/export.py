# SPDX-License-Identifier: Apache-2.0
"""``needleforce export``: a model as a C++ or C header of constants, for a controller without file access, or as an
FMU."""

from pathlib import Path
from typing import Annotated

import typer

from .output import check_outputs, say, show

MODEL_HELP = "JSON written by identify, a preset file, or the name of a shipped preset."
NAME_HELP = "Name of the constant; default: the name of the file or preset."


def run(
    model: Annotated[str, typer.Argument(help=MODEL_HELP, show_default=False)],
    language: Annotated[
        str, typer.Option(help="c++ or c for a header, c# or json; fmu for FMI 3.0 co-simulation.")
    ] = "c++",
    name: Annotated[str | None, typer.Option(help=NAME_HELP)] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="File to write; default: print it.")] = None,
) -> None:
    """Write a model as a C++ or C header of constants, for a controller without file access, as C#, JSON or an FMU."""
    from ..checks import one_of
    from ..errors import InputError
    from ..export import LANGUAGES, fmu, header, identifier, model_source
    from ..files import atomic_write

    one_of("--language", language, (*LANGUAGES, "fmu"))
    check_outputs([output], [model])
    found = model_source(model)
    name = identifier(found.name) if name is None else name
    if language == "fmu" and output is None:
        raise InputError("--output", "missing", "needed for an FMU", next_step=f"Add -o {name}.fmu.")
    made = (
        fmu(found.model, name, found.sources)
        if language == "fmu"
        else header(found.model, language, name, found.sources)
    )
    for line in found.sources:
        if line.startswith("Warning: "):
            say(line)
    if output is None:
        show(str(made).removesuffix("\n"))
        return
    with atomic_write(output) as file:
        file.buffer.write(made if isinstance(made, bytes) else made.encode())
    say(f"{output}: {found.model.name}, layers: {len(found.model.layers)}")
