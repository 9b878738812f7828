# SPDX-License-Identifier: Apache-2.0
"""The list of laws by family, the comparison of all laws, and the page on layers."""

import needleforce as nf
from needleforce.models.laws import FAMILIES, laws_of

from .page import table
from .runs import SPEED
from .stacked import STACK_DEPTH, STACK_HOLD, STACKS

INDEX = """# Laws

One page per law, generated at every build from its parameter table: formula, source, validity, parameters, and a
curve computed by the law itself. A model has one law of each family. [All laws side by side](side_by_side.md) shows
one insertion with each law; [layers](layers.md) shows insertions into several layers.

{families}

```{{toctree}}
:hidden:

side_by_side
layers
{names}
```
"""
SIDE_BY_SIDE = """# All laws side by side

One insertion with every law: in to 12 mm at 1 mm/s, a hold of 5 s, out. Grey is the source paper's model. In each
drawing one of its laws is replaced by another, with the parameter values of that law's page: those of the paper's
phantom if they are known. A friction law that includes the force at the tip is used without a cutting law.

{families}
"""
LAYERED = """# Layers

Each layer has five laws of its own and begins at a depth `top`. The tip contacts the next layer at its top and enters
it when that layer's puncture criterion is met; a puncture depth or force of 0 is an interface without resistance. The
friction of every layer passed acts on the shaft. Each drawing is one insertion: in to {deep:g} mm at {speed:g} mm/s, a
hold of {hold:g} s, out. Dashed lines: tops of the layers.

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
    return table(("law", "summary", "source"), rows)


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
