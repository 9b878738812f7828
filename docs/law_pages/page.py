# SPDX-License-Identifier: Apache-2.0
"""The page of one law, in Markdown, and the figure it shows."""

from . import curves, formulas, use
from .figure import drawing
from .typical import Example

ABOUT = """# {name}

{summary}

{formula}

| family | source | validity | step |
|---|---|---|---|
| {family} | {source} | {validity} | {step} |

```{{raw}} html
:file: {name}.html
```

{caption}

## Parameters

{parameters}

{origins}

## Use

In a preset, with the parameter values of the drawing:

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
EXACT = "the same in one step or in many, at constant velocity"
FIRST_ORDER = "error proportional to the step, {doc}`/evidence/convergence`"
WITHOUT_PARAMETERS = "The law has no parameters."


def figure(example: Example) -> str:
    """The law's curve as HTML."""
    law = example.law
    draw = curves.DRAWN[law.family]
    alt = f"{law.name}: {curves.CAPTIONS[law.family]}"
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
        step=EXACT if law.steps_exactly else FIRST_ORDER,
        formula=formulas.text(type(law)),
        caption=curves.CAPTIONS[law.family],
        parameters=f"```{{table}}\n:class: parameters\n\n{table(HEAD, rows)}\n```" if rows else WITHOUT_PARAMETERS,
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
    known = f"`{row['name']}`", f"${formulas.latex(row['symbol'])}$", row["unit"], limits, default, f"{value:.6g}"
    return *known, row["meaning"], row["source"]


def _origins(origin: dict[str, str]) -> str:
    """The sources of the parameter values of the drawing."""
    names = {text: ", ".join(f"`{name}`" for name in origin if origin[name] == text) for text in origin.values()}
    return "Values of the drawing: " + "; ".join(f"{text} ({names[text]})" for text in names) + "." if names else ""
