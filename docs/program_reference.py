# SPDX-License-Identifier: Apache-2.0
"""Writes the reference pages of the commands, the presets and the needle file before Sphinx reads them, from the
program itself: what it prints as help, what it ships, and what its tables allow."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import typer

import needleforce as nf
from needleforce import core
from needleforce.cli import app
from needleforce.preset_files.schema import keys, tips, to_si

USUAL = ("_mm", "_deg", "_GPa")  # units of a drawing

COMMANDS = """# Commands

What `needleforce COMMAND --help` prints, for every command. `needleforce FILE` alone looks at
a recording, identifies it and writes a report.

| command | |
|---|---|
"""
PRESETS = """# Presets

A preset is a model with the source of its values. `nf.preset("paper")` reads one, `--model` and
`--preset` of the commands take its name, `--needle` takes its needle.
Their files are in `src/needleforce/presets`: copy one to make your own, and give its path in place of a name.

| name | what it is | source |
|---|---|---|
"""
NEEDLE = """# The needle's file

A TOML file that describes a needle, for `--needle needle.toml` and `nf.identify(recording, needle="needle.toml")`.
A preset's name works in its place, and so does a whole preset file.

```toml
reference = "drawing of the supplier, sheet 4"

[needle]
outer_diameter_mm = 1.27
inner_diameter_mm = 0.84   # a cannula; leave it out for a solid needle
length_mm = 100
young_modulus_GPa = 200

[needle.tip]
shape = "lancet_bevel"
half_angle_deg = 10
```

A key ends with its unit; each may be given in any of those listed. A key or a shape that is not known is an error
that proposes the nearest one. `reference` is where the values come from, and may be missing.
Without `[needle.tip]` a recording still gives stiffness, puncture, friction and cutting force, but no modulus.

## [needle]

| key | it is | from | to |
|---|---|---|---|
"""
SHAPES = """
## [needle.tip]

`shape` is one of these. Half angles are between the axis and the surface of the tip: a cone of 15
degrees is sharp, one of 75 blunt.

"""
RANGES = """
| shape | key | it is | from | to |
|---|---|---|---|---|
"""


def setup(app: Any) -> dict:
    """As a Sphinx extension: the pages are written into ``reference`` of the sources."""
    app.connect("builder-inited", lambda app: write(Path(app.srcdir) / "reference"))
    return {"parallel_read_safe": True}


def write(folder: Path) -> None:
    """The pages, each left alone where it did not change."""
    for name, text in (("commands", commands()), ("presets", presets()), ("needle_file", needle_file())):
        path = folder / f"{name}.md"
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def commands() -> str:
    """Every command with its arguments and options."""
    found = list(_leaves(typer.main.get_command(app), ""))
    rows = "\n".join(f"| [`{name}`](#{name.replace(' ', '-')}) | {_first(command.help)} |" for name, command in found)
    return COMMANDS + rows + "\n\n" + "\n".join(_command(name, command) for name, command in found)


def _leaves(group: Any, prefix: str) -> Iterator[tuple[str, Any]]:
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from _leaves(command, f"{prefix}{name} ")
        elif name.islower():
            yield f"{prefix}{name}", command


def _first(text: str) -> str:
    return _cell(text.split("\n\n")[0])


def _cell(text: str) -> str:
    """A help text as plain words of a table: no sign of it marks up."""
    return re.sub(r"([|*_])", r"\\\1", " ".join(text.split())).replace("<", "&lt;")


def _command(name: str, command: Any) -> str:
    rows = [_parameter(each) for each in command.params if each.name != "help"]
    table = "| option | meaning | default |\n|---|---|---|\n" + "\n".join(rows) if rows else ""
    return f"## {name}\n\n{_cell(command.help)}\n\n{table}\n"


def _parameter(each: Any) -> str:
    flags = (
        [*each.opts, *each.secondary_opts]
        if each.param_type_name == "option"
        else [(each.metavar or each.name).upper()]
    )
    default = each.default() if callable(each.default) else each.default
    shown = "required" if each.required else f"`{default}`".replace(",", ", ") if default else ""
    return f"| {' '.join(f'`{flag}`' for flag in flags)} | {_cell(getattr(each, 'help', None) or '')} | {shown} |"


def presets() -> str:
    """Every preset with what it is and where its values come from."""
    models = [nf.preset(name) for name in nf.presets()]
    rows = [f"| `{one.name}` | {_cell(one.summary)} | {_cell(one.reference)} |" for one in models]
    doubts = [f"- `{one.name}`: {_cell('; '.join(one.unverified))}" for one in models if one.unverified]
    return PRESETS + "\n".join(rows) + "\n\n## Values that are not verified\n\n" + "\n".join(doubts) + "\n"


def needle_file() -> str:
    """The keys of a needle and of every tip, with their ranges."""
    shapes = [f"- `{tip.name}`: {tip.summary}" for tip in tips()]
    rows = [f"| `{tip.name}` | {_key(row)}" for tip in tips() for row in tip.table()]
    own = "\n".join(f"| {_key(row)}" for row in core.Needle.table())
    return NEEDLE + own + "\n" + SHAPES + "\n".join(shapes) + "\n" + RANGES + "\n".join(rows) + "\n"


def _key(row: dict) -> str:
    """The keys of a parameter, what it is, and its range in the unit that a drawing has."""
    units = keys(row["name"], row["unit"])
    names, shown = " ".join(f"`{key}`" for key in units), next((key for key in units if key.endswith(USUAL)), "")
    factor = to_si(1.0, units[shown]) if shown else 1.0
    low, high = (f"{row[end] / factor:.4g} {shown.rpartition('_')[2]}" for end in ("low", "high"))
    missing = "" if row["default"] is None else f"; without it {row['default']:g}"
    return f"{names} | {row['meaning']}{missing} | {low} | {high} |"
