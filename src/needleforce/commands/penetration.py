# SPDX-License-Identifier: Apache-2.0
"""``needleforce penetration``: the figures of penetration tests of needles, one or many, with statistics."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec
import typer

from ..errors import InputError
from ..recording.options import ReadOptions
from ..units import number_in
from .files import read_all
from .flags import takes_flags
from .output import JSON_HELP, ReportFlags, check_outputs, say, table, write_file, write_json

if TYPE_CHECKING:
    from ..bench_tests import PenetrationTests
    from ..recording import Recording


class PenetrationFlags(msgspec.Struct, frozen=True, kw_only=True):
    """The flags of ``penetration``."""

    work_to_mm: Annotated[
        float | None, typer.Option(help="Travel from the contact up to which the work is given; default: the whole.")
    ] = None
    plateau_mm: Annotated[
        str | None,
        typer.Option(help="First and last travel of the drag from the contact, such as 5:9; default: found."),
    ] = None
    min_fall_n: Annotated[float, typer.Option(help="Falls of the force of less are not counted, nor are steps.")] = 0.0
    tips: Annotated[int, typer.Option(help="Number of tips that enter; of several there is no heel.")] = 1
    reading: ReadOptions
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None
    table_file: Annotated[Path | None, typer.Option("--table", help="Write a table (CSV), a row a needle.")] = None
    page: ReportFlags


@takes_flags(part="all")
def run(
    files: Annotated[list[Path], typer.Argument(help="Penetration tests, force over travel.", show_default=False)],
    given: PenetrationFlags,
) -> None:
    """Figures of penetration tests of needles: peaks at tip entry and heel, plateau drag, work, with statistics."""
    from ..bench_tests import penetration_tests

    check_outputs([given.json, given.table_file, given.page.check()], files)
    plateau = _plateau_travel(given.plateau_mm)
    work_to = None if given.work_to_mm is None else given.work_to_mm / 1e3
    needles = needles_of(files, given.reading)
    tests = penetration_tests(
        needles, min_fall=given.min_fall_n, tips=given.tips, plateau_travel=plateau, work_to=work_to
    )
    write_json(tests.to_json(), given.json)
    write_file("table", given.table_file, lambda path: _write_table(tests, path))
    given.page.write(tests.report)
    _show_penetration(tests, quiet=given.json == "-")
    if all(test.empty for test in tests.tests):
        raise typer.Exit(1)


def needles_of(files: list[Path], reading: ReadOptions) -> "dict[str, Recording | InputError]":
    """Name -> recording of every needle of the files, or why it cannot be read."""
    needles: dict[str, Recording | InputError] = {}
    for k, (file, found) in enumerate(read_all(files, replace(reading, baseline=False, test="indentation")), 1):
        if isinstance(found, InputError):
            say(str(found))
            name = f"{file.stem}, needle {k}" if file.stem in needles else file.stem
        else:
            name = found.card.part or file.stem
        needles[name if name not in needles else f"{file.stem}: {name}"] = found
    return needles


def _plateau_travel(text: str | None) -> tuple[float, float] | None:
    """First and last travel [m] of the drag from an option such as ``5:9``."""
    if text is None:
        return None
    try:
        first, last = (number_in(part) / 1e3 for part in text.split(":"))
    except ValueError:
        limit = "first and last travel in mm are needed"
        raise InputError("--plateau-mm", repr(text), limit, next_step="Write for example --plateau-mm 5:9.") from None
    return first, last


def _write_table(tests: "PenetrationTests", table_file: Path) -> None:
    from ..files import atomic_write

    with atomic_write(table_file) as file:
        tests.to_dataframe().to_csv(file, index=False, lineterminator="\n")


def _show_penetration(tests: "PenetrationTests", quiet: bool) -> None:
    from ..bench_tests.penetration import FIGURES
    from ..bench_tests.penetration_page import STATISTICS_HEAD
    from ..bench_tests.penetration_statistics import SUMMARY_FIGURES, statistics_cells
    from ..identification.statistics.noise import INTERVAL

    if not quiet:
        head = ["needle", *(FIGURES[name][1] for name in SUMMARY_FIGURES), "falls"]
        rows = [[test.name, *(str(test[name]) for name in (*SUMMARY_FIGURES, "falls"))] for test in tests.tests]
        table(f"penetration tests, values with their {INTERVAL}", head, rows)
        if len(tests) > 1:
            statistics = [list(statistics_cells(each)) for each in tests.statistics(*SUMMARY_FIGURES) if each.n]
            table("statistics over the needles", STATISTICS_HEAD, statistics)
    for test in tests.tests:
        reasons = [test[name] for name in SUMMARY_FIGURES if test[name].reason]
        for reason in dict.fromkeys(each.reason for each in reasons):
            say(f"{test.name}: no {', '.join(e.meaning for e in reasons if e.reason == reason)}: {reason}")
        for note in test.notes:
            say(f"{test.name}: {note}")
