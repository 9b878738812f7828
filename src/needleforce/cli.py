# SPDX-License-Identifier: Apache-2.0
"""The command line. Exit code 0: done; 1: no file could answer, said why; 2: wrong usage."""

import sys

import typer

from .commands import (
    campaign,
    compare,
    convert,
    demo,
    export,
    identify,
    indentation,
    laws,
    presets,
    record,
    rig,
    simulate,
)

app = typer.Typer(
    help="The force of a needle in soft tissue: from mechanics to force, from recordings to mechanics.",
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
)
for command in (demo, simulate, identify, campaign, compare, indentation, convert, export, record, rig, laws, presets):
    app.command(name=command.NAME)(command.run)


@app.callback(invoke_without_command=True)
def about(version: bool = typer.Option(False, "--version", help="Print the version.")) -> None:
    """Options before the command."""
    if version:
        from .vocabulary import __version__

        print(__version__)
        raise typer.Exit()


def main() -> None:
    """The entry point: an InputError is told in one line and never as a traceback."""
    from .errors import InputError

    try:
        app()
    except InputError as error:
        print(f"needleforce: {error}", file=sys.stderr)
        sys.exit(2)
    except BrokenPipeError:
        sys.exit(0)
    except OSError as error:
        print(f"needleforce: {error.strerror}: {error.filename or 'standard output'}", file=sys.stderr)
        sys.exit(1)
