# SPDX-License-Identifier: Apache-2.0
"""The gallery: many short examples, each with its words and its picture."""

import ast
import os
import runpy
from pathlib import Path

import matplotlib
import pytest

matplotlib.use("Agg")  # no screen
from matplotlib import pyplot

EXAMPLES = sorted((Path(__file__).parents[2] / "examples" / "gallery").glob("*.py"))


def test_there_are_twenty():
    assert len(EXAMPLES) >= 20


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_is_short_and_says_what_is_seen(path):
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 40
    title, rule, _, *words = ast.get_docstring(ast.parse(text)).splitlines()
    assert rule == "=" * len(title) and len(" ".join(words).split()) >= 25  # a heading and a paragraph
    assert text.endswith("plt.show()\n")


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:FigureCanvasAgg is non-interactive")
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_draws_with_units(path, monkeypatch):
    monkeypatch.chdir(os.fspath(path.parent))
    pyplot.close("all")
    runpy.run_path(os.fspath(path), run_name="__main__")
    axes = [each for number in pyplot.get_fignums() for each in pyplot.figure(number).axes]
    named = " ".join(each.get_xlabel() + each.get_ylabel() for each in axes)
    assert "[" in named and "]" in named
    assert all(each.lines or each.collections or each.patches for each in axes)
    pyplot.close("all")
