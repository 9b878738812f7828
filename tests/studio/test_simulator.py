# SPDX-License-Identifier: Apache-2.0
"""The simulator in Chromium: what a reader does, and that the page then says what the Python package says."""

import re
import runpy
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from browser import served, shows

import needleforce as nf
from needleforce.export import header
from needleforce.models.laws import FAMILIES
from needleforce.preset_files.schema import tips
from needleforce.studio.page_files import page_files, write_static

PARTS = ("force", "stiffness", "friction", "cutting")
MAX_PAGE_BYTES = 400_000  # without the compiled core
MAX_PICTURE_BYTES = 150_000
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
# each tip of the tables where its control begins, in the model of blunted_cone: heights as drawn, preset and header
EVERY_TIP = """async (radii) => {
  const { HEIGHTS, tipOutline } = await import("./tip.js"), { begun, fromPreset } = await import("./model.js");
  const { presetText, headerText } = await import("./exports.js"), tables = await (await fetch("tables.json")).json();
  return Object.keys(tables.tips).map((name) => {
    const model = fromPreset(tables, "blunted_cone"), { stiffness } = model.layers[0];
    const tip = begun(tables, tables.tips, name);
    stiffness.tip = tip;
    const drawn = tipOutline(stiffness, null).points.every((point) => point.every(Number.isFinite));
    return [tip, radii.map((r) => HEIGHTS[name](tip, r)), drawn, presetText(tables, model), headerText(tables, model)];
  });
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


def test_every_tip_is_drawn_and_leaves_as_python_has_it(opened, tmp_path):
    radii = [0.0, 0.04e-3, 0.12e-3, 0.3e-3]
    page = opened()
    found = page.evaluate(EVERY_TIP, radii)
    kinds = {kind.name: kind for kind in tips()}
    assert {tip["name"] for tip, *_ in found} == set(kinds)
    for tip, heights, drawn, preset, constants in found:
        ours = kinds[tip.pop("name")](**tip)
        wanted = ours.height(np.array(radii))
        if ours.name == "lancet_bevel":  # drawn as the plane that it is; Python's height is that of its equivalent cone
            wanted = np.array(radii) / np.tan(ours.half_angle)
        assert heights == pytest.approx(wanted, rel=1e-12, abs=1e-18) and drawn, ours.name
        (tmp_path / "page.toml").write_text(preset, encoding="utf-8")
        model = nf.preset(tmp_path / "page.toml")
        assert model.stiffness.tip == ours
        texts = (header(model, "c++", "studio_model"), constants)
        written, got = (text.split("// clang-format off")[1] for text in texts)
        assert NUMBER.sub("#", got) == NUMBER.sub("#", written), ours.name
        assert [*map(float, NUMBER.findall(got))] == [*map(float, NUMBER.findall(written))], ours.name


def test_the_knots_of_a_measured_tip_are_typed(opened, tmp_path):
    page = opened()
    page.select_option("#preset", "blunted_cone")
    page.select_option("#layer0-stiffness-tip", "profile")
    knots = page.locator("#layer0-stiffness-tip-knots")
    for text, place, words in (
        ("0 0\n0.2", "-knots-why", "Each line is a radius and a height in mm"),
        ("0 0\n0.2 0.5\n0.35 0.6", "", "the slope falls"),  # which the core refuses
        ("0 0\n0,2 0,1\n0.35 0.6", "", ""),
    ):
        knots.fill(text)
        knots.blur()
        assert words in page.inner_text("#layer0-stiffness-tip" + place if place else "#refusal")
    got = columns(exported(page, "csv", tmp_path))
    model = nf.preset(exported(page, "preset", tmp_path))
    assert model.stiffness.tip.heights == pytest.approx([0.0, 1e-4, 6e-4])
    ours = nf.Insertion(model).run(got["depth"], None, np.full(len(got["depth"]), 1e-3))
    assert got["force"] == pytest.approx(ours["force"], rel=1e-9, abs=1e-10)


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


def test_a_page_embeds_the_simulator_when_asked_and_in_its_colours(browser, wasm, root, tmp_path):
    from playwright.sync_api import expect

    write_static(tmp_path / "studio", wasm)
    (tmp_path / "studio.js").write_bytes((root / "docs" / "_static" / "studio.js").read_bytes())
    place = re.search(r"(<p class=\"studio-here\">.*?</p>)", (root / "docs" / "index.md").read_text("utf-8"), re.S)[1]
    page_of_docs = f"<!doctype html><body data-theme=auto>{place}<script src=studio.js></script>"
    (tmp_path / "index.html").write_text(page_of_docs, encoding="utf-8")
    with served(tmp_path) as address:
        page, loaded = browser.new_page(), []
        page.on("request", lambda each: loaded.append(each.url))
        page.goto(address)
        assert not any("/studio/" in each for each in loaded)
        page.click("text=Push the needle here")
        studio = page.frame_locator("iframe")
        expect(studio.locator("#events")).to_contain_text("puncture at 3.2", timeout=60_000)
        for theme, paper in (("dark", "rgb(22, 25, 28)"), ("light", "rgb(255, 255, 255)")):
            page.evaluate("(theme) => { document.body.dataset.theme = theme; }", theme)
            expect(studio.locator("body")).to_have_css("background-color", paper)
        page.close()


def test_the_picture_of_the_readme_is_drawn(browser, address, root, tmp_path):
    shoot = runpy.run_path(str(root / "tools" / "studio_picture.py"))["shoot"]
    for path in shoot(browser, address, tmp_path):
        assert 30_000 < path.stat().st_size < MAX_PICTURE_BYTES
        assert (root / "docs" / "figures" / path.name).stat().st_size < MAX_PICTURE_BYTES


def test_a_telephone_drags_the_needle_and_keeps_the_curve_in_sight(browser, address):
    """By touch, without scrolling the page; and where a reader wants no motion, an insertion is there at once."""
    from playwright.sync_api import expect

    telephone = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
    context = browser.new_context(**telephone, reduced_motion="reduce")
    page = context.new_page()
    page.goto(address)
    shows(page, "#events", "puncture at 3.2")
    touch = context.new_cdp_session(page)
    box = page.locator("#section").bounding_box()
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 40
    for kind, moved in (("touchStart", 0), *(("touchMove", 10 * step) for step in range(1, 20)), ("touchEnd", None)):
        points = [] if moved is None else [{"x": x, "y": y + moved}]
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    expect(page.locator("#events")).to_have_text(re.compile(r"^contact at 0\.0\d mm(?!.*exit)"), timeout=60_000)
    assert page.evaluate("scrollY") == 0
    page.click("#fast")
    shows(page, "#events", "exit at 0.00 mm")
    assert page.is_disabled("#skip")
    assert page.evaluate("document.documentElement.scrollWidth") == 390
    page.locator("#layer0-cutting-unloading-slider").scroll_into_view_if_needed()
    assert 0 <= page.locator("#over-depth").bounding_box()["y"] < 300
    context.close()


def test_a_browser_without_webassembly_is_told_so(opened):
    page = opened(more="delete window.WebAssembly")
    assert "this browser has no WebAssembly" in page.inner_text("#trouble") and not page.is_visible("#simulator")


@pytest.mark.parametrize("lost", ["tables.json", "core/needleforce.wasm"])
def test_a_page_without_all_its_files_says_which_is_missing(browser, address, lost):
    page = browser.new_page()
    page.route(f"**/{lost}", lambda route: route.fulfill(status=404, body="not here"))
    page.goto(address)
    shows(page, "#trouble", f"{lost} is not there")
    assert not page.is_visible("#loading") and not page.is_visible("#simulator")
    page.close()
