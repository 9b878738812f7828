# SPDX-License-Identifier: Apache-2.0
"""The command line. Exit code 0: done; 1: no file gave a result, with the reason for each; 2: wrong usage."""

import errno
import os
import sys
from importlib import import_module
from typing import Any

import typer
from typer.core import TyperGroup

from .commands import bench_tests, inspect, steer
from .commands.output import each_output, prepare_streams, say, typed
from .errors import InputError, did_you_mean

COMMANDS = ("demo", "inspect", "simulate", "identify", "campaign", "study", "compare", "indentation", "penetration",
            "convert", "export", "record", "watch", "rest", "rig", "laws", "presets", "studio")  # fmt: skip
"""Each in the module of its name, in the order of the help."""


class Commands(TyperGroup):
    """The commands; a file or folder in the place of one is looked at."""

    def resolve_command(self, ctx: typer.Context, args: list[str]) -> tuple[str | None, Any, list[str]]:
        """The command of the first argument, of which messages know what was typed."""
        name, command, rest = self._resolved(ctx, args)
        inner = getattr(command, "commands", {}).get(rest[0] if rest else "", command)
        typed.begin(args, getattr(inner, "params", ()))
        return name, command, rest

    def invoke(self, ctx: typer.Context) -> Any:
        """The command, after which an output that could not be written makes the exit code that of an error."""
        with each_output():
            return super().invoke(ctx)

    def _resolved(self, ctx: typer.Context, args: list[str]) -> tuple[str | None, Any, list[str]]:
        """A path is no command: one that exists, or that has a folder or an ending."""
        first = args[0]
        if first == inspect.PLACE:
            return "", self.commands[first], args[1:]
        if first not in self.commands and (os.path.lexists(first) or os.path.basename(first) != first or "." in first):
            return "", self.commands[inspect.PLACE], args
        if first not in self.commands and not first.startswith("-") and not ctx.resilient_parsing:
            near = did_you_mean(repr(first), map(repr, [*self.commands, *os.listdir()]))
            ctx.fail(f"No command, file or folder {first!r}. {near}".rstrip())
        return super().resolve_command(ctx, args)


app = typer.Typer(
    cls=Commands,
    help="The force of a needle in soft tissue: simulate it, record it, and identify models from recordings.",
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
)
app.command(name=inspect.PLACE)(inspect.first_look)
for name in COMMANDS:
    app.command(name=name)(import_module(f".commands.{name}", __package__).run)
app.add_typer(steer.app, name="steer")
app.command(name="tension")(bench_tests.tension)
app.command(name="bending")(bench_tests.bending)


@app.callback(invoke_without_command=True)
def about(version: bool = typer.Option(False, "--version", help="Print the version.")) -> None:
    """Handle the options that precede the command."""
    if version:
        from .vocabulary import __version__

        print(__version__)
        raise typer.Exit()


def main() -> None:
    """Run the command line; an InputError is printed as one line, without a traceback, and the command to paste."""
    prepare_streams()
    try:
        try:
            app()
        finally:
            sys.stdout.flush()
    except InputError as error:
        say(f"needleforce: {error}")
        sys.exit(error.exit_code)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what is left is flushed at the end
        sys.exit(0)
    except OSError as error:
        # a file that is written has its name in the error
        name = error.filename or ("standard output" if error.errno == errno.ENOSPC else "")
        say(f"needleforce: {': '.join(filter(None, (error.strerror or str(error), name)))}")
        if not error.filename:
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what is left is flushed again at the end
        sys.exit(1)
    except MemoryError:
        say("needleforce: the memory of this computer is not sufficient for the files given.")
        sys.exit(1)
