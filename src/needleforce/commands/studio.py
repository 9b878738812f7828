# SPDX-License-Identifier: Apache-2.0
"""``needleforce studio``: a page on which a model is felt and a recording identified; or files for a web server."""

from pathlib import Path
from typing import Annotated

import typer

from .output import say

STATIC_HELP = "Write the simulator into this folder, for any web server, and serve nothing."


def run(
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port on this computer; 0: any that is free.")] = 8765,
    browser: Annotated[bool, typer.Option(help="Open the page in the browser.")] = True,
    static: Annotated[Path | None, typer.Option(help=STATIC_HELP)] = None,
) -> None:
    """Push a needle with the mouse, or drop a recording, on a page that only this computer reaches."""
    from ..studio.page_files import write_static

    if static is not None:
        files = write_static(static)
        say(f"{static}: {len(files)} files, index.html is the page; it needs a web server")
        return
    from ..studio.server import serve

    serve(port, browser=browser, say=say)
