# SPDX-License-Identifier: Apache-2.0
"""The page of one law, in Markdown, and the figure it shows."""

from . import curves, header, use
from .figure import drawing
from .typical import Example

ABOUT = """# {name}

{summary}

{comment}

| family | source | validity |
|---|---|---|
| {family} | {source} | {validity} |

```{{raw}} html
:file: {name}.html
```

{says}

## Parameters

{parameters}

{origins}

## Use

In a preset, with the numbers of the drawing:

```toml
{toml}
```

In Python and in C++:

```python
{python}
```

```cpp
{cpp}
```
"""
HEAD = ("name", "symbol", "unit", "range", "default", "drawn with", "meaning", "source")
NUMBERLESS = "The law has no numbers."


def figure(example: Example) -> str:
    """The law's curve as HTML."""
    law = example.law
    draw = curves.DRAWN[law.family]
    alt = f"{law.name}: {curves.SAYS[law.family]}"
    heights = (230.0, 250.0 if law.family == "puncture" else 480.0)
    return drawing(law.name, lambda figure, sheet: draw(figure, sheet, law), heights, alt)


def page(example: Example) -> str:
    """The law's page."""
    law = example.law
    about = {key: getattr(law, key) for key in ("name", "family", "summary", "source", "validity")}
    rows = [_row(row, law.parameters()[row["name"]]) for row in law.table()]
    rows += [(f"`{part}`", *[""] * 4, f"`{getattr(law, part)!r}`", "", "") for part in getattr(law, "parts", ())]
    return ABOUT.format(
        **about,
        comment=header.comment(type(law)),
        says=curves.SAYS[law.family],
        parameters=f"```{{table}}\n:class: parameters\n\n{table(HEAD, rows)}\n```" if rows else NUMBERLESS,
        origins=_origins(example.origin),
        toml=use.toml(law),
        python=use.python(law),
        cpp=use.cpp(law),
    )


def table(head, rows) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(str(cell).replace("|", "\\|") for cell in line) + " |" for line in lines)


def _row(row: dict, value: float) -> tuple[str, ...]:
    default = "" if row["default"] is None else f"{row['default']:g}"
    limits = f"{row['low']:g} to {row['high']:g}"
    known = f"`{row['name']}`", f"`{row['symbol']}`", row["unit"], limits, default, f"{value:.6g}"
    return *known, row["meaning"], row["source"]


def _origins(origin: dict[str, str]) -> str:
    """Which numbers of the drawing come from where."""
    names = {text: ", ".join(f"`{name}`" for name in origin if origin[name] == text) for text in origin.values()}
    return "Drawn with: " + "; ".join(f"{text} ({names[text]})" for text in names) + "." if names else ""
