# SPDX-License-Identifier: Apache-2.0
"""Recordings dropped on the page are identified as by the command line and by Python, and what is given away says the
same; what is assumed of a file is corrected there, and an event that is wrong is moved."""

import json
import runpy

import numpy as np
import pytest
from browser import shows
from command_line import run as command

import needleforce as nf
from needleforce.display.quantities import quantity

FIT = 300_000  # [ms] after which a fit is taken to hang
IDLE = '#analyse[aria-busy="false"]'
REAL = "control-needle__skin-with-incision-on-3mm-artery-filled_1_0_5_1_2024-07-02-11-12-03.csv"


def dropped(page, files: dict[str, str]):
    """The page after files were dropped on its view."""
    page.click("#to-analyse")
    make = """(files) => {
      const all = new DataTransfer();
      for (const [name, text] of files) all.items.add(new File([text], name));
      return all;
    }"""
    page.dispatch_event("#analyse", "drop", {"dataTransfer": page.evaluate_handle(make, list(files.items()))})
    return page


def ended(page, press: str = ""):
    """The page after a fit, which pressing something started, has ended."""
    if press:
        page.click(press)
        page.wait_for_selector('#analyse[aria-busy="true"]')
    page.wait_for_selector(IDLE, timeout=FIT)
    return page


def given_away(page, ending: str, folder, menu: str = "give"):
    page.click(f"#{menu} summary")
    with page.expect_download() as download:
        page.click(f"#{menu} [data-give={ending}]")
    path = folder / f"given.{ending}"
    download.value.save_as(path)
    return path


def parameters(page) -> list[list[str]]:
    return [row.split("\t")[:2] for row in page.inner_text("#parameters tbody").splitlines()]


def shown_of(fit: nf.Fit) -> list[list[str]]:
    return [[name.replace("_", " "), str(each.shown)] for name, each in fit.parameters.items()]


def bare(file, folder):
    """The numbers of a recording alone, in other units and with the sign of the force reversed."""
    recording = nf.read(file)
    table = np.column_stack([1e3 * recording.time, 1e6 * recording.depth, -1e3 * recording.force])
    path = folder / "bare.csv"
    np.savetxt(path, table, fmt="%.7g", delimiter=",")
    return path


def test_a_real_recording_is_identified_as_by_the_command_line(opened, recordings, tmp_path):
    file = recordings / "needle-insertion-rig" / REAL
    page = opened()
    page.click("#to-analyse")
    page.set_input_files("#file", file)
    page.wait_for_selector("#found:not([hidden])", timeout=FIT)
    assert command("identify", file, "--json", tmp_path / "fit.json").returncode == 0
    fit = json.loads((tmp_path / "fit.json").read_text(encoding="utf-8"))
    wanted = [quantity(each["value"], each["low"], each["high"], each["unit"]) for each in fit["parameters"]]
    assert parameters(page) == [[e["name"].replace("_", " "), str(q)] for e, q in zip(fit["parameters"], wanted)]
    rows = [row.split("\t") for row in page.inner_text("#event-list").splitlines()]
    (puncture,) = fit["recordings"][0]["events"]["punctures"]
    assert [row[0] for row in rows] == ["contact", "puncture", "exit"]
    assert rows[1][2:4] == [f"{1e3 * puncture['depth_m']:.2f} mm", f"{puncture['force_N']:.3f} N"]
    given = json.loads(given_away(page, "json", tmp_path).read_text(encoding="utf-8"))
    assert given["parameters"] == fit["parameters"]
    assert given["recordings"][0]["events"] == fit["recordings"][0]["events"]
    assumed = fit["recordings"][0]["assumptions"]
    assert assumed and all(sentence in page.inner_text("#notes") for sentence in assumed)


@pytest.fixture(scope="module")
def identified(opened_once, root):
    page = opened_once()
    page.click("#to-analyse")
    page.set_input_files("#file", root / "examples" / "insertion.csv")
    page.wait_for_selector("#found:not([hidden])", timeout=FIT)
    return page


@pytest.fixture
def analysed(identified):
    """The view of a recording that is identified once; what a test changes there it takes back."""
    identified.click("#to-analyse")
    return identified


def test_a_file_without_headers_is_corrected_in_the_page_and_the_script_does_it_again(opened, root, tmp_path):
    file = bare(root / "examples" / "insertion.csv", tmp_path)
    (tmp_path / "wrong.csv").write_text("<script>window.ran = 1</script>,b\n1,2\n3,4\n", encoding="utf-8")
    page = opened()
    page.click("#to-analyse")
    page.set_input_files("#file", [file, tmp_path / "wrong.csv"])
    page.wait_for_selector("#progress.wrong", timeout=FIT)
    assert "no column holds the time" in page.inner_text("#columns .why")
    assert page.inner_text("#columns .rows tbody tr:nth-child(4)").split() == ["10", "−3999.99", "0.52"]
    for number, (role, unit) in enumerate([("time", "ms"), ("depth", "um"), ("force", "mN")], 1):
        page.select_option(f"[aria-label='quantity of column {number}']", role)
        page.select_option(f"[aria-label='unit of column {number}']", unit)
    page.check("[aria-label='sign of column 3 reversed']")
    page.uncheck("#columns .bar input[type=checkbox]")  # not for the other file
    ended(page, "#read-again")
    columns, units = {"time": 1, "depth": 2, "force": 3}, {"time": "ms", "depth": "um", "force": "-mN"}
    fit = nf.identify(nf.read(file, columns=columns, units=units))
    assert parameters(page) == shown_of(fit)
    assert page.inner_text("#files li:nth-child(2) .state") == "not used"
    assert page.evaluate("window.ran") is None and page.query_selector("#files script, #columns script") is None
    (tmp_path / "wrong.csv").unlink()
    script = given_away(page, "py", tmp_path)
    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(tmp_path)
        again = runpy.run_path(str(script))["fit"]
    assert {k: e.value for k, e in again.parameters.items()} == {k: e.value for k, e in fit.parameters.items()}


def test_an_event_that_is_dragged_is_fitted_as_in_python_and_taken_back(analysed, root, tmp_path):
    page, file = analysed, root / "examples" / "insertion.csv"
    before = parameters(page)
    field = page.locator("#event-1")
    assert float(field.input_value()) == pytest.approx(nf.segment(file).punctures[0].time)
    box = page.locator("#recorded-time").bounding_box()
    low, high = (float(nf.read(file).time[k]) for k in (0, -1))
    at = lambda time: box["x"] + 62 + (time - low) / (high - low) * (box["width"] - 76)  # noqa: E731  margins of a plot
    height = next(y for y in range(20, 300, 4) if on_mark(page, at(3.03), box["y"] + y))
    page.mouse.move(at(3.03), box["y"] + height)
    page.mouse.down()
    page.mouse.move(at(2.8), box["y"] + height, steps=3)
    page.mouse.up()
    assert float(field.input_value()) == pytest.approx(2.8, abs=0.05)
    field.press("ArrowUp")
    time = float(field.input_value())
    ended(page, "#with-events")
    fit = nf.identify(nf.read(file).with_events(punctures=[time]))
    assert parameters(page) == shown_of(fit) != before
    assert f"punctures=({time}," in given_away(page, "py", tmp_path).read_text(encoding="utf-8")
    ended(page, "#take-back")
    assert parameters(page) == before and float(field.input_value()) == pytest.approx(3.03)


def on_mark(page, x, y) -> bool:
    page.mouse.move(x, y)
    return "on-mark" in (page.get_attribute("#recorded-time", "class") or "")


def test_the_model_opens_in_the_simulator_with_the_force_of_python(analysed, tmp_path):
    page = analysed
    model = nf.preset(given_away(page, "toml", tmp_path))
    assert "constexpr needleforce::Layer" in given_away(page, "hpp", tmp_path).read_text(encoding="utf-8")
    assert given_away(page, "csv", tmp_path).read_text(encoding="utf-8").startswith("recording,quantity,value")
    page.click("#open-0")
    assert page.is_visible("#simulator") and page.inner_text("#preset option:checked") == "identified cone cylinder"
    page.click("#export summary")
    with page.expect_download() as download:
        page.click("[data-export=csv]")
    download.value.save_as(tmp_path / "trace.csv")
    trace = nf.read(tmp_path / "trace.csv", baseline=False)
    ours = nf.Insertion(model).run(trace.depth, None, np.full(len(trace), 1e-3))
    assert trace.force == pytest.approx(ours["force"], rel=1e-9, abs=1e-12) and trace.force.max() > 0.1


def test_models_are_compared_as_by_the_command_line(analysed, root, tmp_path):
    page = ended(analysed, "#compare")
    file = root / "examples" / "insertion.csv"
    assert command("compare", file, "--json", tmp_path / "models.json").returncode == 0
    wanted = json.loads((tmp_path / "models.json").read_text(encoding="utf-8"))
    assert json.loads(given_away(page, "json", tmp_path, "models-give").read_text(encoding="utf-8")) == wanted
    shows(page, "#models tbody tr:first-child th", "cone cylinder")
    assert page.inner_text("#models tbody").count("\n") == 4 and page.is_visible("#found")


def test_the_report_is_opened_and_a_page_that_is_loaded_again_has_its_result(analysed):
    page = analysed
    with page.expect_popup() as popup:
        page.click("#report")
    popup.value.wait_for_load_state()
    assert popup.value.title() == "Needle force: insertion.csv" and popup.value.query_selector("svg [data-panel]")
    before = parameters(page)
    page.reload()
    page.wait_for_selector("#simulator:not([hidden])")
    page.click("#to-analyse")
    shows(page, "#progress", "The result before this page was loaded again")
    assert parameters(page) == before
    assert parameters(ended(page, "#identify")) == before  # the server still has the recording


def test_a_part_of_a_plot_is_looked_at_and_the_cursor_is_on_all(analysed):
    page = analysed
    whole = page.locator("#recorded-time").screenshot()
    page.mouse.move(0, 0)
    page.locator("#recorded-time").hover(position={"x": 200, "y": 100})
    shows(page, "#looked-at", "residual")
    page.mouse.wheel(0, -300)
    page.mouse.move(0, 0)
    zoomed = page.locator("#recorded-time").screenshot()
    page.locator("#recorded-time").dblclick(position={"x": 200, "y": 20})
    page.mouse.move(0, 0)
    assert zoomed != whole and page.locator("#recorded-time").screenshot() == whole
