# SPDX-License-Identifier: Apache-2.0
"""Drawings of a page zoom and show their values in a browser; what they need is in the page, once."""

import json
import re
import shutil
import subprocess

import numpy as np
import pytest

from needleforce.display.canvas import Labels, axis_names, line, panels
from needleforce.display.page import Figure, Page, section

BROWSER = next((path for path in map(shutil.which, ("chromium", "chromium-browser", "google-chrome")) if path), None)
DEPTH = np.linspace(0.0, 10.0, 101)
FORCE = 0.02 * DEPTH**2
# what a reader does, and what is then seen: the first drawing of the wide page has two panels over one depth
DRIVER = """
window.addEventListener("load", () => {
  const svg = [...document.querySelectorAll("svg:has([data-panel])")].find((each) => each.clientWidth), seen = {};
  const values = () => document.querySelector(".values"), view = svg.viewBox.baseVal;
  const send = (kind, type, x, y, more = {}) => {
    const frame = svg.getBoundingClientRect(), size = frame.width / view.width;
    const at = { clientX: frame.left + x * size, clientY: frame.top + y * size, bubbles: true, cancelable: true };
    svg.dispatchEvent(new kind(type, { ...at, ...more }));
  };
  const pointer = (type, x, y) => send(PointerEvent, type, x, y, { button: 0 });
  const key = (name, more) => svg.dispatchEvent(new KeyboardEvent("keydown", { key: name, bubbles: true, ...more }));
  const own = [...svg.querySelectorAll("[data-panel]")];
  const lines = () => own.map((each) => each.lastChild.querySelectorAll("path").length);
  const texts = (group) => [...group.querySelectorAll("text")].map((one) => one.textContent);
  const ticks = () => own.map((each) => texts(each.children[1]));
  const paths = () => [...svg.querySelectorAll("[data-curve] > path")].map((each) => each.getAttribute("d")).join();
  const before = paths();
  pointer("pointermove", 40 + 0.5 * PANEL, 200);
  seen.hover = values().innerText; seen.cursors = lines();
  svg.focus(); key("ArrowRight"); seen.next = values().innerText;
  key("ArrowDown"); seen.below = values().innerText;
  const wheel = (more) => send(WheelEvent, "wheel", 40 + 0.5 * PANEL, 200, { deltaY: -100, ...more });
  svg.blur(); seen.scrolls = wheel() || paths() === before;
  svg.focus(); wheel(); seen.wheel = ticks(); seen.zoomed = paths() !== before;
  pointer("dblclick", 100, 100); seen.reset = paths() === before;
  pointer("pointerdown", 40 + 0.25 * PANEL, 100);
  pointer("pointermove", 40 + 0.75 * PANEL, 102);
  pointer("pointerup", 40 + 0.75 * PANEL, 102);
  seen.drag = ticks();
  key("0"); seen.escaped = paths() === before; seen.hidden = values().style.display;
  document.body.dataset.seen = JSON.stringify(seen);
});
"""


def draw(figure, sheet) -> None:
    both = panels(figure, sheet, 1, 2).ravel()
    for axes, force, name in zip(both, (FORCE, -FORCE), ("force [N]", "residual [N]")):
        curve = line(axes, DEPTH, force, 200, color="#c64f00")
        axes.set_xlim(0.0, 10.0)
        axis_names(axes, "depth [mm]", name)
        Labels(axes, [curve]).on("model", *curve, "#222222")


@pytest.fixture
def page():
    figure = Figure(name="one", draw=draw, heights=(300.0, 300.0), caption="", alt="two panels")
    return Page(title="t", kind="k", outcome="o", sections=[section("s", figure, name="s")]).html()


def test_values_are_in_the_page_once(page):
    box, limits, *names = re.search(r'data-panel="([^"]*)"', page)[1].split("|")
    left, top, right, bottom = map(float, box.split())
    x0, x1, y0, y1 = map(float, limits.split())
    assert names == ["depth [mm]", "force [N]"] and page.count('data-curve="model"') == 4
    path = re.search(r'data-curve="model"><path d="([^"]*)"', page)[1]
    points = np.array([pair.split() for pair in re.split("[ML]", path) if pair], float)
    assert x0 + (points[:, 0] - left) / (right - left) * (x1 - x0) == pytest.approx(DEPTH, abs=1e-3)
    assert y0 + (points[:, 1] - bottom) / (top - bottom) * (y1 - y0) == pytest.approx(FORCE, abs=1e-4)
    assert page.count("<script>") == page.count("</script>") == 1 and not re.search(r"https?:|<link|src=", page)


def test_a_page_without_curves_has_no_script():
    assert "<script" not in Page(title="t", kind="k", outcome="o", sections=[section("s", "words", name="s")]).html()


@pytest.mark.skipif(BROWSER is None, reason="no chromium to open the page in")
def test_a_reader_zooms_and_reads_values(page, tmp_path):
    (width,) = {float(box.split()[2]) - float(box.split()[0]) for box in re.findall(r'data-panel="([^|]*)', page)[:1]}
    driver = DRIVER.replace("PANEL", f"{width:g}")
    (tmp_path / "page.html").write_text(page.replace("</body>", f"<script>{driver}</script></body>"), encoding="utf-8")
    command = [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--window-size=1400,900", "--dump-dom"]
    command += [f"--user-data-dir={tmp_path / 'browser'}", (tmp_path / "page.html").as_uri()]
    found = subprocess.run(command, capture_output=True, text=True, timeout=120).stdout
    seen = json.loads(re.search(r'data-seen="([^"]*)"', found)[1].replace("&quot;", '"'))
    # a sample every 0.1 mm: at half the panel the one at 5 mm, where 0.02 · 5² = 0.5 N
    assert seen["hover"].replace("\n", " ") == "depth 5.00 mm ● model 0.500 N" and seen["cursors"] == [1, 1]
    assert seen["next"].replace("\n", " ") == "depth 5.10 mm ● model 0.520 N"
    assert seen["below"].replace("\n", " ") == "depth 5.10 mm ● model −0.520 N"  # the same place on the next panel
    assert seen["scrolls"] and seen["zoomed"] and seen["reset"] and seen["escaped"] and seen["hidden"] == "none"
    assert all(panel[:4] == ["2", "4", "6", "8"] for panel in seen["wheel"])  # 1 mm to 9 mm
    numbers = [float(text) for text in seen["drag"][1] if text.isdigit()]  # drawn in the left panel, shown in both
    assert min(numbers) >= 2.4 and max(numbers) <= 7.6
