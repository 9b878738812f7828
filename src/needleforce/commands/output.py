# SPDX-License-Identifier: Apache-2.0
"""What every command prints with: tables, JSON, progress on standard error."""

import json
import sys
from pathlib import Path

from ..files import atomic_write, checked_target, json_safe

JSON_HELP = "Also write the result as JSON; - for standard output."


def table(title: str, columns: list[str], rows: list[list[str]]) -> None:
    """Prints a table on standard output; cells are plain text, never markup."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    made = Table(title=title, title_justify="left", title_style="bold", header_style="bold")
    for k, column in enumerate(columns):
        made.add_column(column, overflow="fold", justify="left" if k == 0 else "default")
    for row in rows:
        made.add_row(*(Text(str(cell)) for cell in row))
    Console(width=None if sys.stdout.isatty() else 160).print(made)


def say(text: str) -> None:
    """One line on standard error."""
    print(text, file=sys.stderr)


def progress(work, text: str):
    """``work`` with a bar on standard error, gone when it is done; nothing where no one watches."""
    if not sys.stderr.isatty():
        return work
    from rich.console import Console
    from rich.progress import track

    return track(list(work), description=text, console=Console(stderr=True), transient=True)


def write_json(document, path: str | None) -> None:
    """Writes a document where one is asked for; text is written as it is."""
    if path is None:
        return
    text = document if isinstance(document, str) else json.dumps(json_safe(document), indent=2, allow_nan=False)
    if path == "-":
        print(text)
    else:
        with atomic_write(path) as file:
            file.write(text + "\n")


def check_outputs(outputs: list, inputs: list = []) -> None:  # noqa: B006
    """Refuses, before any work, an output that cannot be written, that is an input, or that is named twice."""
    from ..errors import InputError

    taken = {Path(path).resolve(): "read" for path in inputs if path is not None}
    for path in outputs:
        if path is None or str(path) == "-":
            continue
        target = checked_target(path)
        if target in taken:
            raise InputError("output", str(path), f"is also {taken[target]}", next_step="Name another file.")
        taken[target] = "written by another option"


def pairs(options: list[str], option: str) -> dict[str, str]:
    """``force=fz`` options as a dictionary."""
    from ..errors import InputError

    for text in options:
        if "=" not in text:
            raise InputError(
                f"--{option}",
                repr(text),
                "not of the form quantity=name",
                next_step=f"Write for example --{option} " + ("force=fz." if option == "column" else "time=us."),
            )
    found = dict(text.split("=", 1) for text in options)
    if len(found) < len(options):
        raise InputError(f"--{option}", ", ".join(options), "names a quantity twice", next_step="Keep one of the two.")
    return found
