# SPDX-License-Identifier: Apache-2.0
"""``needleforce laws``: all laws with their parameters, ranges, units and sources; applicable laws; named models."""

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import msgspec
import typer

from .files import NEEDLE_HELP
from .flags import takes_flags
from .output import JSON_HELP, check_outputs, table, write_json

if TYPE_CHECKING:
    from ..core import Tissue

COLUMNS = ["law", "part", "parameter", "unit", "range", "default", "meaning", "source"]


class LawsFlags(msgspec.Struct, frozen=True, kw_only=True):
    """The flags of ``laws``."""

    models: Annotated[bool, typer.Option("--models", help="List the named models instead of the laws.")] = False
    citations: Annotated[bool, typer.Option("--citations", help="List the full references behind the laws.")] = False
    needle: Annotated[str | None, typer.Option(help=f"{NEEDLE_HELP} Laws are checked for it.")] = None
    tissue: Annotated[str | None, typer.Option(help="Tissue file or preset; default: the tissue of --needle.")] = None
    indentation_mm: Annotated[float | None, typer.Option(help="Indentation at the puncture.")] = None
    depth_mm: Annotated[float | None, typer.Option(help="Largest depth of the tip.")] = None
    thickness_mm: Annotated[float | None, typer.Option(help="Thickness of the specimen.")] = None
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None


@takes_flags()
def run(given: LawsFlags) -> None:
    """List all laws with their parameters, ranges, units and sources, or check them for a needle and tissue."""
    check_outputs([given.json], [given.needle, given.tissue])
    lengths = {"indentation": given.indentation_mm, "depth": given.depth_mm, "thickness": given.thickness_mm}
    if given.models:
        _print("named models", *_models(), given.json)
    elif given.citations:
        _print("references", *_references(), given.json)
    elif any(value is not None for value in (given.needle, given.tissue, *lengths.values())):
        _print("validity of the laws", *_applicable(given.needle, given.tissue, lengths), given.json)
    else:
        _print("laws", *_laws(), given.json)


def _print(title: str, columns: list[str], rows: list[list[str]], document: list, json: str | None) -> None:
    write_json(document, json)
    if json != "-":
        table(title, columns, rows)


def _every_law() -> list[type]:
    from ..models.laws import FAMILIES, laws_of

    return [law for family in FAMILIES for law in laws_of(family)]


def _laws() -> tuple:
    laws = _every_law()
    return COLUMNS, [row for law in laws for row in _rows(law)], [_described(law) for law in laws]


def _models() -> tuple:

    from ..models.laws import FAMILIES
    from ..models.named_models import NAMED_MODELS

    named = list(NAMED_MODELS.values())
    columns = ["model", *FAMILIES, "summary", "source"]
    return columns, [[m.name, *m.choice.values(), m.summary, m.source] for m in named], [asdict(m) for m in named]


def _references() -> tuple:
    from ..references import keys_in, works

    sources = [source for law in _every_law() for source in (law.source, *(row["source"] for row in law.table()))]
    cited = [works()[key] for key in dict.fromkeys(key for source in sources for key in keys_in(source))]
    document = [{"key": w.key, "reference": w.reference, "unconfirmed": w.unconfirmed} for w in cited]
    return ["key", "reference"], [[work.key, str(work)] for work in cited], document


def _applicable(needle: str | None, tissue: str | None, lengths: dict[str, float | None]) -> tuple:
    from ..models.validity import applicable_laws
    from ..preset_files import needle_of

    in_metres = {name: None if length is None else 1e-3 * length for name, length in lengths.items()}
    body = None if needle is None else needle_of(needle)
    found = applicable_laws(body, _tissue(tissue, needle), **in_metres)
    rows = [[one.law.name, one.law.family, one.verdict, one.reason] for one in found]
    keys = ["law", "part", "verdict", "reason"]
    return keys, rows, [dict(zip(keys, row)) for row in rows]


def _tissue(name_or_path: str | None, needle: str | None) -> "Tissue | None":
    """The tissue of its own file or preset, otherwise of the needle's, None without either."""
    from ..preset_files import preset
    from ..preset_files.build import read_tissue
    from ..preset_files.presets import FOLDER, presets

    source = needle if name_or_path is None else name_or_path
    if source is None or source.endswith(".json"):
        return None if source is None else preset(source).tissue
    file = FOLDER / f"{source}.toml" if source in presets() else source
    return read_tissue(file, required=name_or_path is not None)


def _described(law: type) -> dict:
    about = {key: getattr(law, key) for key in ("name", "family", "summary", "source", "validity")}
    return about | {"steps_exactly": law.steps_exactly, "parameters": law.table()}


def _rows(law: type) -> list[list[str]]:
    """One row for the law and one for each of its parameters."""
    first = [[law.name, law.family, "", "", "", "", law.summary, law.source]]
    return first + [["", "", *_parameter(row)] for row in law.table()]


def _parameter(row: dict) -> list[str]:
    default = "" if row["default"] is None else f"{row['default']:g}"
    limits = f"{row['low']:g} to {row['high']:g}"
    return [row["name"], row["unit"], limits, default, row["meaning"], row["source"]]
