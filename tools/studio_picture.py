#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The picture of the studio in README.md and on the first page of the documentation, in light and dark.

    .venv/bin/python tools/studio_picture.py FOLDER    # writes studio.png and studio_dark.png, after make wasm

Needs chromium, and Playwright as the tests have it. A page of two models is opened, and the pointer put on a curve.
"""

import sys
from pathlib import Path
from typing import Any

SIZE = {"width": 1180, "height": 732}
TOP = {"x": 0, "y": 0, **SIZE}


def shoot(browser: Any, address: str, folder: Path) -> list[Path]:
    """The pictures, from a studio that is served at the address."""
    written = []
    for scheme, name in (("light", "studio.png"), ("dark", "studio_dark.png")):
        page = browser.new_page(viewport=SIZE, color_scheme=scheme)
        page.goto(address)
        page.select_option("#preset", "layered")
        page.click("#second")
        page.select_option("#preset", "layered_yielding")
        page.click("#tab-0")
        curve = page.locator("#over-depth").bounding_box()
        page.mouse.move(curve["x"] + 0.42 * curve["width"], curve["y"] + 0.2 * curve["height"])
        page.wait_for_timeout(500)  # two frames of drawings
        page.screenshot(path=folder / name, clip=TOP)
        written.append(folder / name)
        page.close()
    return written


def main() -> None:
    """Serves the studio, and takes the pictures."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    from browser import chromium
    from studio_server import running

    from needleforce.studio import server

    listening = server.listening_socket(0)
    with running(server.make_server(listening), listening) as port, chromium() as browser:
        for path in shoot(browser, f"http://127.0.0.1:{port}/", Path(sys.argv[1])):
            print(f"wrote {path}, {path.stat().st_size // 1000} kB")


if __name__ == "__main__":
    main()
