# SPDX-License-Identifier: Apache-2.0
"""The studio's plots in a notebook, by the contract of anywidget: a stand-in for it in Python, and in Chromium one for
the model that a notebook gives to ``render``."""

import base64
import re
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from browser import served

import needleforce as nf
from needleforce.studio.force_widget import force_widget

# a model of anywidget's, in which bytes are a view that does not begin at a multiple of eight
RENDER = """async ([bytes, shown]) => {
  const raw = Uint8Array.from(atob(bytes), (one) => one.charCodeAt(0)), odd = new Uint8Array(raw.length + 3);
  odd.set(raw, 3);
  const traits = { columns: new DataView(odd.buffer, 3), shown, time_range: [] }, listeners = {};
  window.model = {
    get: (name) => traits[name],
    set: (name, value) => { traits[name] = value; (listeners[`change:${name}`] ?? []).forEach((act) => act()); },
    save_changes: () => { window.saved = traits.time_range; },
    on: (name, act) => (listeners[name] ??= []).push(act),
    off: (name, act) => { listeners[name] = listeners[name].filter((one) => one !== act); },
  };
  const { default: widget } = await import("./module.js");
  const stop = await widget.render({ model, el: document.body });
  window.end = () => { stop(); return Object.values(listeners).flat().length; };
}"""


@pytest.fixture(scope="module")
def fitted(root):
    recording = nf.read(root / "examples" / "insertion.csv")
    return recording, nf.identify(recording, needle="paper")


@pytest.fixture
def anywidget(monkeypatch):
    class AnyWidget:
        def __init__(self, **traits):
            vars(self).update(traits)

    trait = SimpleNamespace(tag=lambda **_: None)
    kinds = dict.fromkeys(("Bytes", "Dict", "List"), lambda: trait)
    monkeypatch.setitem(sys.modules, "anywidget", SimpleNamespace(AnyWidget=AnyWidget))
    monkeypatch.setitem(sys.modules, "traitlets", SimpleNamespace(**kinds))


def test_the_widget_has_what_was_measured_and_what_each_fit_predicts(anywidget, fitted):
    recording, fit = fitted
    widget = force_widget(recording, fit, fit)
    columns = np.frombuffer(widget.columns, "<f8").reshape(5, -1)
    wanted = (recording.time, recording.depth, recording.force, fit.predict(recording), fit.predict(recording))
    assert all(np.array_equal(got, each, equal_nan=True) for got, each in zip(columns, wanted, strict=True))
    assert widget.shown["fits"] == ["cone cylinder"] * 2 and widget.shown["rows"] == len(recording)
    marks = {one["kind"]: recording.depth[one["at"]] for one in widget.shown["marks"]}
    assert marks["puncture"] == pytest.approx(fit.parameters.puncture_depth.value, abs=0.1e-3)


def test_without_anywidget_the_message_names_the_extra(monkeypatch, fitted):
    monkeypatch.setitem(sys.modules, "anywidget", None)
    with pytest.raises(nf.InputError, match=r"needleforce\[jupyter\]"):
        force_widget(fitted[0])


def test_a_notebook_zooms_and_reads_the_plots(anywidget, browser, fitted, tmp_path):
    recording, fit = fitted
    widget = force_widget(recording, fit)
    (tmp_path / "module.js").write_text(widget._esm, encoding="utf-8")
    (tmp_path / "index.html").write_text("<!doctype html><link rel=icon href=data:,><body>", encoding="utf-8")
    with served(tmp_path) as address:
        page, errors = browser.new_page(viewport={"width": 900, "height": 420}), []
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(address)
        page.evaluate(RENDER, [base64.b64encode(widget.columns).decode(), widget.shown])
        assert page.inner_text("p").split() == ["measured", "cone", "cylinder"]
        over_time = page.locator("canvas").nth(1)
        box = over_time.bounding_box()
        page.mouse.move(box["x"] + 100, box["y"] + 90)
        values = page.inner_text("p")
        force, predicted = map(float, re.findall(r"(-?[\d.]+) N", values.replace("−", "-")))
        now = int(np.argmin(np.abs(recording.time - float(re.search(r"([\d.]+) s", values)[1]))))
        assert force == pytest.approx(recording.force[now], abs=2e-3)
        assert predicted == pytest.approx(fit.predict(recording)[now], abs=2e-3)
        page.mouse.down()
        page.mouse.move(box["x"] + 200, box["y"] + 95, steps=3)
        page.mouse.up()
        start, end = page.evaluate("saved")
        assert recording.time[0] < start < end < recording.time[-1]
        page.evaluate("model.set('time_range', [1, 2])")  # as a script of the reader does
        over_time.press("-")
        assert page.evaluate("saved") == pytest.approx([0.875, 2.125])
        over_time.press("0")
        assert page.evaluate("saved") == [] and page.evaluate("end()") == 0 and errors == []
        page.close()
