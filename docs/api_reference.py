# SPDX-License-Identifier: Apache-2.0
"""Writes the API reference before Sphinx reads it: every public name, from the packages' own lists."""

import importlib
import inspect
from collections.abc import Mapping
from pathlib import Path

# package, heading, and what it is for; a name that two of them have is described under the first
PACKAGES = (
    ("needleforce", "needleforce", "The names at top level, as `import needleforce as nf` gives them."),
    ("needleforce.recording", "Recordings", "Reading, writing, and what a recording holds."),
    ("needleforce.segmentation", "Segmentation", "Contact, punctures, exit and phases of a recording."),
    ("needleforce.identification", "Identification", "Fits, intervals, draws and comparisons of models."),
    ("needleforce.bench_tests", "Bench tests", "Moduli of tissue and needle, and penetration of films."),
    ("needleforce.steering", "Steering", "Needles that bend: paths read, identified, estimated and planned."),
    ("needleforce.fe", "Tissue as a solid", "Finite elements around a needle, and what they condense to."),
    ("needleforce.campaign", "Campaigns", "Many recordings of many conditions."),
    ("needleforce.control", "Control", "What a loop needs around an insertion."),
    ("needleforce.export", "Export", "A model as a C++ or C header."),
    ("needleforce.mujoco", "MuJoCo", "A needle in a MuJoCo model."),
    ("needleforce.studio", "Studio", "The studio's plots in a notebook."),
    ("needleforce.protocol", "Protocols", "An experiment as a file."),
    ("needleforce.rig", "Virtual rig", "The paper's experiment, simulated."),
    ("needleforce.rig.live", "Virtual rig on the network", "The same with servers."),
)
HEAD = """# API reference

Every public name with its parameters, shapes, units, errors and sources. Each law has a page of its own with its
formula and its curve: {doc}`laws/index`; the mechanics behind them are in {doc}`/explanation/mechanics`, the statistics of a fit in
{doc}`/explanation/identification`. Shapes are written (n,); units are SI; depth is positive inwards, force opposes insertion.
"""


def setup(app) -> dict:
    """As a Sphinx extension: ``reference/api.md`` is written into the sources."""
    app.connect("builder-inited", lambda app: write(Path(app.srcdir) / "reference" / "api.md"))
    return {"parallel_read_safe": True}


def write(path: Path) -> None:
    """The page, left alone where it did not change."""
    text = page()
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def page() -> str:
    """The text of the page."""
    described: set[int] = set()
    parts = [HEAD]
    for package, heading, purpose in PACKAGES:
        module = importlib.import_module(package)
        entries = [_entry(package, name, getattr(module, name), described) for name in public(module)]
        if any(entries):
            parts += [f"## {heading}\n\n{purpose}\n", *filter(None, entries)]
    return "\n".join(parts)


def public(module) -> list[str]:
    """The public names of a package, in its own order."""
    return [name for name in module.__all__ if not name.startswith("_")]


def _entry(package: str, name: str, value: object, described: set[int]) -> str:
    """The directive for one name; empty for one that is described already, and for a module of values."""
    if id(value) in described or inspect.ismodule(value):
        return ""
    described.add(id(value))
    if inspect.isclass(value):
        directive, options = "autoclass", "   :members:\n   :special-members: __getitem__\n"
    elif callable(value):
        directive, options = "autofunction", ""
    else:  # a value: it has no docstring of its own
        keys = ", ".join(f"`{key}`" for key in value) if isinstance(value, Mapping) else ""
        return f"`{package}.{name}`: {type(value).__name__}" + (f" of {keys}" if keys else "") + "\n"
    return f"```{{eval-rst}}\n.. {directive}:: {package}.{name}\n{options}```\n"
