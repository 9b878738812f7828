# SPDX-License-Identifier: Apache-2.0
"""The studio's page in Chromium: first paint, frames a second with 10 000 samples on screen, weight.

    make wasm; python benchmarks/studio.py [--rounds 7]

The studio's own server gives the page on this computer. First paint and the time to a usable simulator are those of a
context without a cache, the median and the largest of all rounds. For frames the insertion of 12 mm with which the page
opens, more than 10 000 samples in two plots of force and three parts, is drawn anew at every frame for three seconds; a
headless Chromium draws in software. The time in the program is that of one frame without what waits for the next.
"""

import argparse
import sys
from pathlib import Path
from statistics import median
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from browser import CHROMIUM, WITHOUT, chromium
from studio_server import running

from needleforce.studio import server
from needleforce.studio.page_files import page_files

VIEW = {"width": 1280, "height": 800}
PAINTED = "() => performance.getEntriesByName('first-contentful-paint')[0].startTime"
# when the hidden simulator was shown: an observer that stands before the page's own program
WATCH = """addEventListener("DOMContentLoaded", () => new MutationObserver(() => {
  if (!document.getElementById("simulator").hidden) window.shownAt ??= performance.now();
}).observe(document.getElementById("simulator"), { attributes: true }));"""
FRAMES = """async () => {
  const { redraw } = await import("./simulator.js");
  const gaps = [], drawn = [], end = performance.now() + 3000;
  let before = performance.now();
  while (performance.now() < end) {
    redraw(); // its frame comes before the one that is waited for
    await new Promise((next) => requestAnimationFrame((start) => next(drawn.push(performance.now() - start))));
    gaps.push(performance.now() - before);
    before = performance.now();
  }
  drawn.sort((a, b) => a - b);
  return { frames: gaps.length / 3, longest: Math.max(...gaps.slice(1)), drawn: drawn[drawn.length >> 1] };
}"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=7)
    rounds = parser.parse_args().rounds
    if CHROMIUM is None:
        return print(WITHOUT)
    files = page_files()
    listening = server.listening_socket(0)
    with running(server.make_server(listening), listening) as port, chromium() as browser:
        print(f"Chromium {browser.version}, headless, drawn in software")
        address = f"http://127.0.0.1:{port}/"
        starts = [first_paint(browser, address) for _ in range(rounds)]
        for name, values in zip(("first paint", "simulator there"), zip(*starts)):
            print(f"{name}: {median(values):.0f} ms, at most {max(values):.0f}")
        frames(browser, address)
    module = len(files["core/needleforce.wasm"])
    print(f"page without the compiled core: {(sum(map(len, files.values())) - module) / 1e3:.0f} kB")
    print(f"compiled core: {module / 1e3:.0f} kB")


def first_paint(browser: Any, address: str) -> tuple[float, float]:
    """Times [ms] from the request to the first paint and to the simulator."""
    with browser.new_context(viewport=VIEW) as context:
        page = context.new_page()
        page.add_init_script(WATCH)
        page.goto(address)
        page.wait_for_selector("#simulator:not([hidden])")
        return page.evaluate(PAINTED), page.evaluate("shownAt")


def frames(browser: Any, address: str) -> None:
    page = browser.new_page(viewport=VIEW)
    page.goto(address)
    page.wait_for_selector("#simulator:not([hidden])")
    samples = round(1000 * float(page.inner_text("#where").split("time ")[1].removesuffix(" s")))
    assert samples > 10_000
    found = page.evaluate(FRAMES)
    print(f"{samples} samples, 8 curves: {found['frames']:.0f} frames a second,", end=" ")
    print(f"longest {found['longest']:.0f} ms, {found['drawn']:.1f} ms in the program")


if __name__ == "__main__":
    main()
