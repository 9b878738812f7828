# SPDX-License-Identifier: Apache-2.0
"""The pages around those of single laws: the list by family, all models side by side, and layers."""

import needleforce as nf
from needleforce.models.laws import FAMILIES, laws_of

from .page import table
from .runs import SPEED
from .stacked import STACK_DEPTH, STACK_HOLD, STACKS

INDEX = """# Laws

One page for each law, made from its parameter table and its header on every build: formula, source, validity,
parameters, and a curve drawn by the law itself. A model takes one law of each family.
[All laws side by side](side_by_side.md) runs one insertion through each; [layers](layers.md) shows a stack.

{families}

```{{toctree}}
:hidden:

side_by_side
layers
{names}
```
"""
SIDE_BY_SIDE = """# All laws side by side

One insertion through every law: in to 12 mm at 1 mm/s, a hold of 5 s, out. Grey is the source paper's model; in each
drawing one of its laws is exchanged for another with the numbers of its own page, those of the paper's phantom where
they are known. A friction law that counts the force at the tip itself goes without a cutting law.

{families}
"""
LAYERED = """# Layers

Each layer has five laws of its own and begins at a depth `top`. The tip meets a further layer at its top, and breaks
into it by that layer's own puncture; a puncture depth or force of 0 is an interface that does not resist. The shaft
keeps the friction of every layer it has passed. Each drawing below is one insertion: in to {deep:g} mm at
{speed:g} mm/s, a hold of {hold:g} s, out. Dashed: where a layer begins.

{stacks}
"""
STACK = """## {summary}

```{{raw}} html
:file: {stem}.html
```

{reference}.

```toml
{toml}
```"""


def index() -> str:
    """Every law by family, with its summary."""
    families = "\n\n".join(f"## {family.capitalize()}\n\n{_family(family)}" for family in FAMILIES)
    names = "\n".join(law.name for family in FAMILIES for law in laws_of(family))
    return INDEX.format(families=families, names=names)


def _family(family: str) -> str:
    rows = [(f"[`{law.name}`]({law.name}.md)", law.summary, law.source) for law in laws_of(family)]
    return table(("law", "what it says", "source"), rows)


def side_by_side() -> str:
    """One drawing for each family."""
    drawings = (f"## {family.capitalize()}\n\n```{{raw}} html\n:file: all_{family}.html\n```" for family in FAMILIES)
    return SIDE_BY_SIDE.format(families="\n\n".join(drawings))


def layers() -> str:
    """A drawn insertion into each stack of layers, and its preset."""
    motion = {"deep": 1e3 * STACK_DEPTH, "speed": 1e3 * SPEED, "hold": STACK_HOLD}
    return LAYERED.format(stacks="\n\n".join(map(_stack, STACKS)), **motion)


def _stack(path) -> str:
    model, text = nf.preset(str(path)), path.read_text(encoding="utf-8").partition("\n")[2].strip()
    return STACK.format(summary=model.summary, stem=path.stem, reference=model.reference, toml=text)
