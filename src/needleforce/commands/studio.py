# SPDX-License-Identifier: Apache-2.0
"""``needleforce studio``: a page on which a model is felt, a recording identified and a rig watched; or files for a web
server."""

from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import InputError
from .files import PRESET_HELP
from .flags import takes_flags
from .output import say
from .record import SourceFlags

STATIC_HELP = "Write the simulator into this folder, for any web server, and serve nothing."
HOST_HELP = "Name or address of this computer under which others reach the page, with a token; default: only this one."
MODEL_HELP = f"Offered in the live view next to the presets; may be repeated. {PRESET_HELP}"


class StudioFlags(SourceFlags, frozen=True, kw_only=True):
    """The flags of ``studio``: sensor and axis of the live view are named as those of ``record``."""

    port: Annotated[int, typer.Option(min=0, max=65535, help="Port on this computer; 0: any that is free.")] = 8765
    host: Annotated[str, typer.Option(help=HOST_HELP)] = "127.0.0.1"
    browser: Annotated[bool, typer.Option(help="Open the page in the browser.")] = True
    static: Annotated[Path | None, typer.Option(help=STATIC_HELP)] = None
    folder: Annotated[Path, typer.Option(help="Folder for what the live view records.")] = Path("recordings")
    model: Annotated[list[str] | None, typer.Option(help=MODEL_HELP)] = None


@takes_flags()
def run(given: StudioFlags) -> None:
    """Push a needle with the mouse, drop a recording, or watch a rig, on a page that only this computer reaches."""
    from ..studio.page_files import write_static

    if given.static is not None:
        files = write_static(given.static)
        say(f"{given.static}: {len(files)} files, index.html is the page; it needs a web server")
        return
    from ..preset_files import preset
    from ..studio.live import Setup
    from ..studio.server import serve

    models = {Path(each).name: each for each in given.model or []}
    for each in models.values():
        preset(each)  # what is wrong with it is reported before the page opens
    setup = Setup(folder=given.folder, rig=_rig(given), models=models)
    serve(given.port, browser=given.browser, say=say, host=given.host, live=setup)


def _rig(given: SourceFlags) -> dict[str, Any] | None:
    """The rig that is named, as the live view passes it to its recorder; None without a sensor."""
    if given.sensor is None:
        if given.axis is not None:
            raise InputError("--axis", given.axis, "the recorder needs a force", next_step="Give --sensor HOST.")
        return None
    named = {name: getattr(given, name) for name in SourceFlags.__struct_fields__}
    return named | {"words": f"{given.sensor}, {given.axis or 'no axis'}"}
