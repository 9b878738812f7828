# SPDX-License-Identifier: Apache-2.0
"""The simulator in Chromium: what a reader does, and that the page then says what the Python package says."""

import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from browser import served, shows

import needleforce as nf
from needleforce.export import header
from needleforce.models.laws import FAMILIES
from needleforce.studio.page_files import page_files, write_static

PARTS = ("force", "stiffness", "friction", "cutting")
MAX_PAGE_BYTES = 400_000  # without the compiled core
# the text of a link to a state; layers that are named instead of given are the preset's with a half angle of 9 rad
LINK = """async (state) => {
  const tables = await (await fetch("tables.json")).json();
  for (const model of state.models.filter((one) => one?.layers === "HALF_ANGLE")) {
    model.layers = tables.presets.paper.layers;
    model.layers[0].stiffness.half_angle = 9;
    state.motion = { speed: 1e-3, depth: 0.01 };
  }
  return btoa(JSON.stringify(state)).replaceAll("=", "");
}"""
EVERY_PRESET = """async () => {
  const { presetText, headerText } = await import("./exports.js"), { fromPreset } = await import("./model.js");
  const tables = await (await fetch("tables.json")).json();
  const model = (name) => fromPreset(tables, name);
  return Object.keys(tables.presets).map((name) =>
    [name, presetText(tables, model(name)), headerText(tables, model(name))]);
}"""
NUMBER = re.compile(r"(?<![\w.])-?\d+\.?\d*(?:e[+-]?\d+)?(?![\w.])")


def exported(page, what: str, folder):
    """The file that the page gives."""
    page.click("#export summary")
    with page.expect_download() as download:
        page.click(f"[data-export={what}]")
    path = folder / download.value.suggested_filename
    download.value.save_as(path)
    return path


def columns(path) -> dict[str, np.ndarray]:
    rows = [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    table = np.array([row.split(",") for row in rows[1:]], float)
    return dict(zip((name.rsplit("_", name.count("_"))[0] for name in rows[0].split(",")), table.T))


def drag(page, *ways: list[int]):
    """The needle taken with the mouse and moved down by so many pixels, one after the other; it follows each way."""
    box = page.locator("#section").bounding_box()
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 60
    page.mouse.move(x, y)
    page.mouse.down()
    for way in ways:
        for step in way:
            y += step
            page.mouse.move(x, y)
            page.wait_for_timeout(30)
        before, now = "", page.get_attribute("#section", "aria-valuetext")
        while before != now:
            page.wait_for_timeout(300)
            before, now = now, page.get_attribute("#section", "aria-valuetext")
    page.mouse.up()


def test_a_needle_dragged_through_a_puncture_gives_the_force_of_python(opened, tmp_path):
    page = opened()
    drag(page, [20] * 16, [-25] * 4)
    shows(page, "#events", "puncture at 3.2")  # 3.237 mm, at the peak of 0.21 N
    assert ", 0.2" in page.inner_text("#events")
    got = columns(exported(page, "csv", tmp_path))
    ours = nf.Insertion(nf.preset("paper")).run(got["depth"], None, np.full(len(got["depth"]), 1e-3))
    assert got["depth"].max() > 6e-3 and np.any(np.diff(got["depth"]) < 0.0)
    for name in PARTS:
        assert got[name] == pytest.approx(ours[name], rel=1e-9, abs=1e-9 * np.abs(ours["force"]).max()), name
    # what the package reads back is the same recording
    recording = nf.read(tmp_path / "paper.csv")
    assert recording.force == pytest.approx(got["force"]) and recording.depth == pytest.approx(got["depth"])


def test_keys_and_wheel_move_the_needle(opened):
    from playwright.sync_api import expect

    page = opened()
    section = page.locator("#section")
    tip = expect(section)
    tip.to_have_attribute("aria-valuenow", "-2.40")
    for key, depth in (("PageDown", "-1.40"), ("ArrowDown", "-1.30"), ("PageUp", "-2.30")):
        section.press(key)
        tip.to_have_attribute("aria-valuenow", depth, timeout=60_000)
    section.hover()
    page.mouse.wheel(0, 100)
    tip.to_have_attribute("aria-valuenow", "-2.10", timeout=60_000)


def test_a_changed_parameter_changes_the_whole_trace_at_once(opened, tmp_path):
    page = opened()
    before = columns(exported(page, "csv", tmp_path))
    page.fill("#layer0-stiffness-reduced_modulus", "235.09212080042404")  # twice the preset's, in kPa
    page.press("#layer0-stiffness-reduced_modulus", "Enter")
    after = columns(exported(page, "csv", tmp_path))
    # the force of a cone is proportional to the modulus; the motion stays
    assert np.array_equal(after["depth"], before["depth"])
    assert after["stiffness"] == pytest.approx(2.0 * before["stiffness"], rel=1e-12)
    slider = page.locator("#layer0-friction-per_length-slider")
    slider.press("End")  # to a hundred times, without losing the modulus
    more = columns(exported(page, "csv", tmp_path))
    assert more["stiffness"] == pytest.approx(after["stiffness"], rel=1e-12)
    assert more["friction"].max() == pytest.approx(100.0 * before["friction"].max(), rel=0.01)


def test_what_is_no_number_in_range_changes_nothing(opened, tmp_path):
    page = opened()
    before = exported(page, "csv", tmp_path).read_text(encoding="utf-8")
    for text in ("NaN", "", "-3", "1e99", "<b>"):
        page.fill("#layer0-stiffness-half_angle", text)
        page.press("#layer0-stiffness-half_angle", "Enter")
        assert f"“{text}” is not a number from 0.1 to 89.9 °" in page.inner_text("#layer0-stiffness-half_angle-why")
    page.fill("#depth", "nought")
    page.click("#fast")
    assert "“nought” is not a number" in page.inner_text("#trouble")
    assert exported(page, "csv", tmp_path).read_text(encoding="utf-8") == before


def test_a_pair_of_laws_that_the_core_refuses_is_said_and_changes_nothing(opened, tmp_path):
    page = opened()
    before = exported(page, "csv", tmp_path).read_text(encoding="utf-8")
    page.select_option("#layer0-friction", "dragged_tissue")  # which includes the cutting that there is
    with pytest.raises(nf.InputError) as error:
        nf.preset("paper").replace(friction=nf.preset("layered").friction)
    refusal = page.inner_text("#refusal")
    assert "The core refuses this" in refusal and error.value.limit in refusal
    assert page.input_value("#layer0-friction") == "coulomb"
    assert exported(page, "csv", tmp_path).read_text(encoding="utf-8") == before
    page.select_option("#layer0-cutting", "no_cutting")
    page.select_option("#layer0-friction", "dragged_tissue")
    assert page.inner_text("#refusal") == "" and page.input_value("#layer0-friction") == "dragged_tissue"


def test_two_models_are_on_the_same_motion(opened, tmp_path):
    from playwright.sync_api import expect

    page = opened()
    page.click("#second")
    page.select_option("#preset", "paper_116")
    second = columns(exported(page, "csv", tmp_path))
    page.click("#tab-0")
    first = columns(exported(page, "csv", tmp_path))
    assert np.array_equal(first["depth"], second["depth"])
    for name, got in (("paper", first), ("paper_116", second)):
        ours = nf.Insertion(nf.preset(name)).run(got["depth"], None, np.full(len(got["depth"]), 1e-3))
        assert got["force"] == pytest.approx(ours["force"], rel=1e-9, abs=1e-10)
    page.click("#second")
    expect(page.locator("#events")).to_have_text(re.compile("^contact"), timeout=60_000)
    assert not page.is_visible("#tab-1")


def test_a_link_opens_the_same_state(opened, tmp_path):
    page = opened()
    page.select_option("#preset", "layered")
    page.fill("#layer1-top", "12")
    page.press("#layer1-top", "Enter")
    page.fill("#depth", "17")
    page.click("#slow")
    page.click("#skip")
    wanted = exported(page, "csv", tmp_path).read_text(encoding="utf-8")
    page.click("#export summary")
    page.click("[data-export=link]")
    shows(page, "#trouble", "now the link")
    again = opened(page.url)
    assert again.input_value("#depth") == "17" and again.input_value("#layer1-top") == "12"
    assert exported(again, "csv", tmp_path).read_text(encoding="utf-8") == wanted


DAMAGED = [
    ("%%%", "it is not whole"),
    ({"models": []}, "it has no model"),
    ({"models": [{"preset": "__proto__"}, None]}, "its preset “__proto__” is not one of this version"),
    ({"models": [{"preset": "paper"}, None], "motion": {"speed": 1e9, "depth": 1}}, "its motion is not one"),
    ({"models": [{"preset": "paper", "layers": [{"top": 0}]}, None]}, "its stiffness “undefined” is not one"),
    ({"models": [{"preset": "paper", "layers": "HALF_ANGLE"}, None]}, "cone half_angle (9) is outside its range"),
]


def test_a_damaged_link_is_said_and_the_page_works(opened, address):
    page = opened()
    for state, words in DAMAGED:
        text = state if isinstance(state, str) else page.evaluate(LINK, state)
        page.evaluate("(text) => { location.hash = text; }", text)
        shows(page, "#trouble", words)
    page = opened(page.url)
    assert "The link cannot be opened" in page.inner_text("#trouble")
    shows(page, "#events", "puncture at 3.2")


def test_every_preset_leaves_as_the_file_and_header_that_python_writes(opened, tmp_path):
    page = opened()
    texts = page.evaluate(EVERY_PRESET)
    assert {name for name, *_ in texts} == set(nf.presets())
    for name, preset, constants in texts:
        (tmp_path / "page.toml").write_text(preset, encoding="utf-8")
        ours, theirs = nf.preset(name), nf.preset(tmp_path / "page.toml")
        for mine, other in zip(ours.layers, theirs.layers, strict=True):
            assert mine.top == other.top and all(getattr(mine, each) == getattr(other, each) for each in FAMILIES), name
        assert (theirs.name, theirs.reference, theirs.doubts) == (ours.name, ours.reference, ours.doubts)
        written = header(ours, "c++", "studio_model").split("// clang-format off")[1]
        got = constants.split("// clang-format off")[1]
        assert NUMBER.sub("#", got) == NUMBER.sub("#", written), name
        assert [*map(float, NUMBER.findall(got))] == [*map(float, NUMBER.findall(written))], name


def test_a_changed_model_leaves_under_another_name(opened, tmp_path):
    page = opened()
    page.fill("#layer0-cutting-force", "0.1")
    page.press("#layer0-cutting-force", "Enter")
    model = nf.preset(exported(page, "preset", tmp_path))
    assert model.name == "paper_changed" and model.cutting.force == 0.1 and "studio" in model.reference


def test_pictures_leave_the_page(opened, tmp_path):
    page = opened()
    picture = ElementTree.fromstring(exported(page, "svg", tmp_path).read_bytes())
    texts = [each.text for each in picture.iter("{http://www.w3.org/2000/svg}text")]
    assert {"depth [mm]", "time [s]", "puncture", "insertion", "hold", "force A: paper", "cutting"} <= set(texts)
    assert exported(page, "png", tmp_path).read_bytes().startswith(b"\x89PNG")


def test_the_page_is_light_and_the_same_on_any_web_server(browser, wasm, tmp_path):
    files = page_files(wasm)
    assert sum(len(content) for name, content in files.items() if not name.endswith(".wasm")) <= MAX_PAGE_BYTES
    written = write_static(tmp_path / "static", wasm)
    assert {path.relative_to(tmp_path / "static").as_posix() for path in written} == {*files, "solid.json"}
    with served(tmp_path / "static") as place:
        page = browser.new_page()
        page.goto(place)
        page.wait_for_selector("#simulator:not([hidden])")
        shows(page, "#events", "puncture at 3.2")
        assert not page.is_visible("#to-analyse")  # without the studio's server there is nothing that identifies
        page.click("#to-steering")
        shows(page, "#steer-words", "Planning needs the studio's own server")
        assert page.is_disabled("#steer-plan")
        page.select_option("#steer-needle", "solid")
        shows(page, "#steer-moved", "tissue moved")
        page.close()


def test_a_browser_without_webassembly_is_told_so(opened):
    page = opened(more="delete window.WebAssembly")
    assert "this browser has no WebAssembly" in page.inner_text("#trouble") and not page.is_visible("#simulator")
