# SPDX-License-Identifier: Apache-2.0
"""Sphinx: the simulator of the studio as files of the pages, which the first page shows. Where the core was not
compiled for WebAssembly there is its picture alone: parts under ``only:: studio`` are left out."""

from pathlib import Path

from needleforce.errors import InputError
from needleforce.studio.page_files import page_files, write_static

FOLDER = "studio"


def setup(app) -> dict:
    """As a Sphinx extension: the tag before the pages are read, the files after they are written."""
    try:
        page_files()
    except InputError:
        return {"parallel_read_safe": True}
    app.tags.add(FOLDER)
    app.add_js_file("studio.js", defer="defer")
    app.connect("build-finished", lambda app, error: error or write_static(Path(app.outdir) / FOLDER))
    return {"parallel_read_safe": True}
