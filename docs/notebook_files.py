# SPDX-License-Identifier: Apache-2.0
"""Sphinx: each notebook of the tutorials can be taken from its page, for Jupyter or as a script, and its pictures are
described in words."""

import os
import re
from pathlib import Path
from typing import Any

import nbformat
from docutils import nodes
from myst_nb.core.read import read_myst_markdown_notebook

FOLDER = "tutorials"
TAKE = """
```{{only}} html
Take this page with you: {{download}}`notebook <files/{name}.ipynb>`, {{download}}`script <files/{name}.py>`.
```
"""


def setup(app) -> dict:
    """As a Sphinx extension: the files are written before the pages are read, which then name them."""
    app.connect("builder-inited", lambda app: write(Path(app.srcdir) / FOLDER))
    app.connect("env-before-read-docs", _environment)
    app.connect("source-read", _named)
    app.connect("doctree-resolved", _described)
    return {"parallel_read_safe": True}


def write(folder: Path) -> None:
    """Notebook and script of each page of ``folder``, in its folder ``files``."""
    (folder / "files").mkdir(exist_ok=True)
    for page in sorted(folder.glob("*.md")):
        if page.stem == "index":
            continue
        notebook = read_myst_markdown_notebook(page.read_text(encoding="utf-8"), add_source_map=False)
        for number, cell in enumerate(notebook.cells):
            cell.id = f"cell-{number}"  # not a new one each time
        nbformat.write(notebook, folder / "files" / f"{page.stem}.ipynb")
        (folder / "files" / f"{page.stem}.py").write_text(script(notebook.cells), encoding="utf-8")


def script(cells: list) -> str:
    """The cells with text as comments, in the form that editors show as cells."""
    parts = []
    for cell in cells:
        if cell.cell_type == "markdown":
            lines = "\n".join(f"# {line}".rstrip() for line in cell.source.splitlines())
            parts.append(f"# %% [markdown]\n{lines}\n")
        else:
            parts.append(f"# %%\n{cell.source}\n")
    return "\n".join(parts)


def _environment(app, *_) -> None:
    """What the notebooks run with, and not what is drawn before: the figures' style, and one thread of linear algebra,
    as more are slower on small matrices."""
    os.environ["MATPLOTLIBRC"] = str(Path(app.confdir) / "matplotlibrc")
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def _named(app, docname: str, source: list[str]) -> None:
    """Names the files at the end of a notebook's page."""
    folder, _, name = docname.rpartition("/")
    if folder == FOLDER and name != "index":
        source[0] += TAKE.format(name=name)


def _described(app, doctree: nodes.document, docname: str) -> None:
    """Gives each picture of a notebook its text alternative: its section, and what its cell draws."""
    for image in doctree.findall(nodes.image):
        if docname.startswith(f"{FOLDER}/") and "alt" not in image:
            section, cell = (_around(image, kind) for kind in (nodes.section, nodes.container))
            code = next(cell.findall(nodes.literal_block)).astext()
            axes = dict.fromkeys(re.findall(r'[xy]label="([^"]+)"', code))
            drawn = ", ".join(axes) or f"drawn by {code.splitlines()[-1].rstrip(';')}"
            image["alt"] = f"{next(section.findall(nodes.title)).astext()}: {drawn}"


def _around(node: nodes.Node, kind: type) -> Any:
    """The section of a node, or its cell."""
    while not (isinstance(node, kind) and (kind is nodes.section or "cell" in node["classes"])):
        node = node.parent
    return node
