# SPDX-License-Identifier: Apache-2.0
"""Writes the pages of the laws, from the core's list of laws, before Sphinx reads them."""

from pathlib import Path

from needleforce.models.laws import FAMILIES, laws_of

from . import index, page, side_by_side, stacked, typical


def setup(app) -> dict:
    """As a Sphinx extension: the pages are written into the folder ``reference/laws`` of the sources."""
    app.connect("builder-inited", lambda app: write(Path(app.srcdir) / "reference" / "laws"))
    return {"parallel_read_safe": True}


def write(folder: Path) -> None:
    """Writes every page and figure that changed into ``folder``, and deletes those of laws that no longer exist."""
    folder.mkdir(exist_ok=True)
    files = contents()
    for path in folder.iterdir():
        if path.name not in files:
            path.unlink()
    for name, text in files.items():
        path = folder / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def contents() -> dict[str, str]:
    """Text of every file by its name."""
    files = {"index.md": index.index(), "side_by_side.md": index.side_by_side(), "layers.md": index.layers()}
    files |= {f"{path.stem}.html": stacked.figure(path) for path in stacked.STACKS}
    for family in FAMILIES:
        files[f"all_{family}.html"] = side_by_side.comparison(family)
        for law in laws_of(family):
            files |= law_files(law)
    return files


def law_files(law: type) -> dict[str, str]:
    """The page and the figure of one law."""
    drawn = typical.example(law)
    return {f"{law.name}.md": page.page(drawn), f"{law.name}.html": page.figure(drawn)}
