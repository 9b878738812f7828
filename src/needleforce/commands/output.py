# SPDX-License-Identifier: Apache-2.0
"""Output of the commands: tables, text and JSON on standard output; messages and progress on standard error. Texts are
made printable here, because parts of them come from files and devices."""

import codecs
import contextlib
import json
import os
import re
import shlex
import socket
import sys
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import msgspec
import typer
from markupsafe import escape

from ..errors import InputError, printable
from ..files import atomic_write, checked_target, json_safe

_NAME_WIDTH = 28  # of the longest name of a parameter or model
JSON_HELP = "Write the result as JSON to this file; - for standard output."
_SIGNS = {"μ": "u", "±": "+-", "°": "deg", "–": "-", "−": "-", "·": "*", "÷": "/", "×": "x", "→": "->", "Δ": "d"}
_TYPED = str.maketrans(_SIGNS | dict.fromkeys(map(chr, range(0x300, 0x370))))  # without accents
EXAMPLES = {"column": "force=fz", "unit": "time=us", "segment": "segment=0"}


def table(title: str, columns: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Print a table on standard output; headings and cells are plain text, not markup."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    cells = [[_as_printed(str(cell)) for cell in row] for row in rows]
    made = Table(title=Text(printable(title)), title_justify="left", title_style="bold", header_style="bold")
    widest = max((len(row[0]) for row in cells), default=0)
    for k, column in enumerate(columns):  # names are not broken where the terminal is narrow
        names = {} if k else {"min_width": min(_NAME_WIDTH, widest)}
        made.add_column(Text(printable(column)), overflow="fold", **names)
    for row in cells:
        made.add_row(*map(Text, row))
    Console(width=None if sys.stdout.isatty() else 160).print(made)


def _as_printed(text: str) -> str:
    """A text as standard output shows it: what its encoding lacks may be wider as it would be typed."""
    coding = sys.stdout.encoding or "utf-8"
    return printable(anonymous.text(text)).encode(coding, "needleforce").decode(coding)


class TypedCommand:
    """What the user typed, from which a message that names options makes the command to paste."""

    def begin(self, arguments: Sequence[str] = (), parameters: Sequence[Any] = ()) -> None:
        """A command begins, with these arguments, of these parameters."""
        self._options = {word: each for each in parameters for word in each.opts if word.startswith("--")}
        split = (word.split("=", 1) if word.split("=")[0] in self._options else [word] for word in arguments)
        self.arguments, self._proposed = [part for word in split for part in word], set[str]()

    def check_numbers(self, given: dict[str, Any]) -> None:
        """Raise InputError for a text that Python alone takes for one of the numbers given: ``1_000``."""
        for word, text in pairwise(self.arguments):
            option = self._options.get(word)
            number = option is not None and not option.is_flag and isinstance(given.get(option.name), int | float)
            if number and "_" in text:
                raise InputError(word, repr(text), "a number is needed", next_step="Write it without underscores.")

    def proposals(self, text: str) -> Iterator[str]:
        """The command with the options of ``text`` that have values, those together that no word separates; none is
        proposed twice."""
        for found in _OPTIONS.finditer(text) if self._options else ():
            words = self._words(found[0])
            command = shlex.join(["needleforce", *self._with(words)])
            if words and command not in self._proposed:
                self._proposed.add(command)
                yield command

    def _words(self, text: str) -> list[str]:
        """Options of this command with their values, as words; none where one is of another command or has no value."""
        words: list[str] = []
        given = iter([each[0].rstrip(".,;:)") for each in re.finditer(r"'[^']*'|\S+", text)])
        for word in (each for each in given if each.startswith("--")):
            option = self._options.get(word)
            value = "" if option is None or option.is_flag else next(given, "")
            if option is None or (word in self.arguments if option.is_flag else not _is_value(word, value)):
                return []
            words += [word] if option.is_flag else [word, value.strip("'")]
        return words

    def _with(self, words: list[str]) -> list[str]:
        """The arguments with further options, which replace the same ones, of the same quantity."""
        kept = list(self.arguments)
        for word, value in pairwise([*words, ""]):
            option, quantity = self._options.get(word), value.partition("=")[0]
            for k in reversed(range(len(kept) - 1 if option and not option.is_flag else 0)):
                if kept[k] == word and (not option.multiple or kept[k + 1].partition("=")[0] == quantity):
                    del kept[k : k + 2]
        end = kept.index("--") if "--" in kept else len(kept)
        return kept[:end] + words + kept[end:]


def _is_value(option: str, word: str) -> bool:
    """Whether what follows an option in a message is its value: neither a word of the sentence, nor a word for what
    the user has, nor a file to write, whose name a header may hold."""
    shown = word in _CHOICES or re.search(r"['=./\d]", word) is not None
    return shown and not _PLACEHOLDER.search(word) and (option not in _WRITING or word == "report.html")


_OPTIONS = re.compile(r"--[a-z][\w-]*(?: (?:'[^']*'|(?!--)\S+))?(?: --[a-z][\w-]*(?: (?:'[^']*'|(?!--)\S+))?)*")
_PLACEHOLDER = re.compile(r"\b(NAME|FILE|UNIT|TOPIC|JOINT|HOST)\b")
_CHOICES = ("increasing", "decreasing")  # values that are plain words
_WRITING = ("--json", "--report", "--save", "--csv", "--draws", "--table", "--figure", "--output", "--out", "--state")
typed = TypedCommand()
typed.begin()


class Anonymous:
    """Whether the outputs of this command name nobody: then labels stand in them for the names of its files."""

    def begin(self, wanted: bool = False) -> None:
        """A command begins, with the flag ``--anonymous`` or without."""
        self.wanted = wanted
        self._labels, self._names = dict.fromkeys((socket.gethostname(), str(Path.home())), "…"), re.compile("$^")

    def hide(self, files: Iterable[Any]) -> None:
        """Put numbers in place of the names of those files that are there, also as pages and JSON have them; a name
        that may be a word, or a key, remains."""
        present = (Path(each) for each in files if self.wanted and each and os.path.exists(each))
        for number, file in enumerate(present, 1):
            names = {str(file), str(file.resolve()), file.name, file.stem}
            for name in (each for each in names if not _PLAIN_WORD.fullmatch(each)):
                self._labels |= dict.fromkeys((name, str(escape(name)), json.dumps(name)[1:-1]), f"file {number}")
        self._names = any_of(self._labels)

    def text(self, text: str) -> str:
        """The text with labels for names."""
        return self._names.sub(lambda name: self._labels[name[0]], text) if self.wanted else text

    def stripped(self, text: str) -> str:
        """As ``text``, of what a recording states of itself: without times, hosts and addresses, too."""
        return _TIMES_AND_HOSTS.sub("…", self.text(text)) if self.wanted else text


def any_of(names: Iterable[str]) -> re.Pattern:
    """Any of some names in a text, the longest where several fit."""
    return re.compile(rf"(?<!\w)(?:{'|'.join(map(re.escape, sorted(names, key=len, reverse=True)))})(?!\w)")


_PLAIN_WORD = re.compile(r"[a-z_-]+|\w{1,5}")
_TIMES_AND_HOSTS = re.compile(
    r"\d{4}-\d\d-\d\d(?:[T ]\d\d:\d\d(?::\d\d(?:\.\d+)?)?(?:Z|[+-]\d\d:?\d\d)?)?|\d\d:\d\d:\d\d|\w+://\S+"
    r"|\b\d{1,3}(?:\.\d{1,3}){3}(?::\d+)?\b|\b[\w-]+(?:\.[\w-]+)*\.(?:local|lan|com|org|net|edu|de|uk)\b"
)
anonymous = Anonymous()
anonymous.begin()
_failed: list[str] = []  # outputs of this command that could not be written


def say(text: str) -> None:
    """Print a message on standard error; if it names options of the command, the whole command to paste with each, but
    for an assumption: the option it names reverses it."""
    print(printable(anonymous.text(text)), file=sys.stderr)
    for command in () if text.startswith("assumed: ") else typed.proposals(text):
        print(f"  {printable(anonymous.text(command))}", file=sys.stderr)


def show(text: str) -> None:
    """Print text on standard output."""
    print(printable(anonymous.text(text)))


def prepare_streams() -> None:
    """Make the standard streams able to take any text: those that are closed lead nowhere, as the caller wants, and
    what the terminal's encoding lacks is written as it would be typed, ``N/mm2``, or else as ``\\u2800``."""
    codecs.register_error("needleforce", _typed)
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))
        elif hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="needleforce")


def _typed(error: UnicodeError) -> tuple[str, int]:
    """A handler of encoding errors that writes with the characters of a plain keyboard."""
    text = unicodedata.normalize("NFKD", error.object[error.start : error.end]).translate(_TYPED)
    return text.encode("ascii", "backslashreplace").decode(), error.end


def progress(work: Iterable[Any], text: str) -> Iterable[Any]:
    """Wrap ``work`` with a progress bar on standard error: how much is done, the rate, and the time left. It is removed
    at the end; there is none if standard error is not a terminal."""
    if not sys.stderr.isatty():
        return work
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskProgressColumn, TimeRemainingColumn

    rate = TaskProgressColumn(show_speed=True)
    columns = ("{task.description}", BarColumn(), MofNCompleteColumn(), rate, TimeRemainingColumn())
    shown = Progress(*columns, console=Console(stderr=True), transient=True)

    def watched() -> Iterator[Any]:
        with shown:
            yield from shown.track(work, description=text)

    return watched()


def show_log() -> None:
    """Print on standard error what the package reports while it works."""
    import logging

    class Printed(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            say(record.getMessage())

    log = logging.getLogger("needleforce")
    log.setLevel(logging.INFO)
    if not log.handlers:
        log.addHandler(Printed())


def write_json(document: Any, path: str | None) -> None:
    """Write a document, or JSON text, to a file, to standard output for ``-``, or nowhere for None."""
    if path is None:
        return
    text = document if isinstance(document, str) else json.dumps(json_safe(document), indent=2, allow_nan=False)
    text = anonymous.text(text)
    with _reported("standard output" if path == "-" else path):
        if path == "-":
            show(text)
        else:
            with atomic_write(path) as file:
                file.write(text + "\n")


def write_file(what: str, path: Path | None, write: Callable[[Path], object]) -> None:
    """Write a file, if its option is given, and print what it is with its name."""
    if path is not None:
        with _reported(path):
            write(path)
            _hide_names(path)
            say(f"{what}: {path}")


def _hide_names(path: Path) -> None:
    """Put labels in place of names in a file of text that was written; in others there are none."""
    if anonymous.wanted and path.suffix.lower() in (".html", ".csv", ".json", ".toml", ".svg"):
        text = path.read_text(encoding="utf-8")
        with atomic_write(path) as file:
            file.write(anonymous.text(text))


@contextlib.contextmanager
def each_output() -> Iterator[None]:
    """The work of a command, whose outputs are written each for itself: one that fails is named at once, and makes the
    exit code that of an error."""
    _failed.clear()
    yield
    if _failed:
        raise typer.Exit(InputError.exit_code)


@contextlib.contextmanager
def _reported(place: str | Path) -> Iterator[None]:
    """Print why an output was not written, instead of leaving the command without its other outputs."""
    try:
        yield
    except BrokenPipeError:
        raise
    except (InputError, OSError) as error:
        _failed.append(str(place))
        reason = error if isinstance(error, InputError) else f"{place}: not written, {error.strerror or error}"
        say(f"needleforce: {reason}")


class ReportFlags(msgspec.Struct, frozen=True, kw_only=True):
    """The flags of a command that writes a report."""

    report: Annotated[Path | None, typer.Option(help="Write a report as one HTML file.")] = None
    open: Annotated[bool, typer.Option("--open", help="Open the report in the browser.")] = False

    def check(self) -> Path | None:
        """The report's file. Raises InputError for ``--open`` without one."""
        if self.open and self.report is None:
            raise InputError("--open", "given", "there is no report", next_step="Add --report report.html.")
        return self.report

    def write(self, write: Callable[[Path], None]) -> None:
        """Write the report and open it, as the flags have it."""
        write_file("report", self.report, write)
        if self.open and self.report is not None:
            import webbrowser

            if not webbrowser.open(self.report.resolve().as_uri()):
                say("no browser was found on this computer: open the report on another one")


def check_outputs(outputs: list, inputs: list = []) -> None:  # noqa: B006
    """Raise InputError, before any work, for an output that cannot be written, is an input, or is named twice."""
    anonymous.hide(inputs)
    taken = {Path(path).resolve(): "read" for path in inputs if path is not None}
    for path in outputs:
        if path is None or str(path) == "-":
            continue
        target = checked_target(path)
        if target in taken:
            raise InputError("output", str(path), f"is also {taken[target]}", next_step="Name another file.")
        taken[target] = "written by another option"


def pairs(options: list[str], option: str) -> dict[str, str]:
    """Options such as ``force=fz`` as a dictionary."""
    for text in options:
        if "=" not in text:
            step = f"Write for example --{option} {EXAMPLES.get(option, 'time=us')}."
            raise InputError(f"--{option}", repr(text), "not of the form quantity=name", next_step=step)
    found = dict(text.split("=", 1) for text in options)
    if len(found) < len(options):
        limit = "a quantity is given twice"
        raise InputError(f"--{option}", ", ".join(options), limit, next_step="Keep one of the two.")
    return found
