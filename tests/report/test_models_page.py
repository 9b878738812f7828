# SPDX-License-Identifier: Apache-2.0
"""The comparison of models on held-out repeats: the table, the floor, the page."""

import math
import re

import numpy as np
import pytest
from test_report_page import figures, plain

from needleforce.identification.comparison import (
    Comparison,
    ModelRow,
    best_possible,
    floor_words,
    model_rows,
)
from needleforce.identification.cross_validation import CrossValidation

FLOOR = np.array([0.03, 0.04, 0.05])


def row(model: str, factor: float, floor=FLOOR, **options) -> ModelRow:
    """A model whose errors are ``factor`` times the floor in every stroke."""
    floors = np.tile(floor[:, None], 4)
    cross_validation = CrossValidation(factor * floors, 0.9 * factor * floors, floors)
    known = bool(np.isfinite(floor).any())
    ratios = {"prediction": factor, "replay": 0.9 * factor, "by_stroke": (factor,) * 3} if known else {}
    values = {"bic": -10.0, "nrmse": 0.02, "left_out": 0.04, "bic_correlated": -5.0, "parameters": 3, "wins": 1}
    return ModelRow(model=model, **(values | {"residual": 0.01} | ratios | options), cross_validation=cross_validation)


@pytest.fixture
def rows():
    return Comparison(
        (
            row("layered", 1.1, bic=math.nan, bic_correlated=math.nan),
            row("cone_cylinder", 1.2, ties=True),
            row("paper", 3.2, bic=40.0, bic_correlated=3.0, notes=("<b> was held",)),
        )
    )


@pytest.fixture
def page(rows, tmp_path):
    rows.report(tmp_path / "compare.html", files=["runs/<1>.csv"])
    return (tmp_path / "compare.html").read_text(encoding="utf-8")


def test_the_table_has_bic_differences_errors_and_ties(rows):
    shown = [[cell.replace("\N{NO-BREAK SPACE}", " ") for cell in each] for each in model_rows(rows)]
    assert shown == [
        ["layered", "–", "–", "3", "2.0 %", "4.0 %", "1.10", "0.99", "1.10", "1.10", "1.10", "best"],
        ["cone_cylinder", "0", "0", "3", "2.0 %", "4.0 %", "1.20", "1.08", "1.20", "1.20", "1.20", "ties"],
        ["paper", "50", "8", "3", "2.0 %", "4.0 %", "3.20", "2.88", "3.20", "3.20", "3.20", ""],
    ]
    rms = 100 * math.sqrt((0.03**2 + 0.04**2 + 0.05**2) / 3)
    assert f"{rms:.1f} % of the peak force (rms over 3 repeats" in floor_words(rows)


def test_lowest_error_of_any_model_agrees_with_random_repeats(rows):
    repeats = np.random.default_rng(1).standard_normal((200_000, 3))
    others = (repeats.sum(axis=1, keepdims=True) - repeats) / 2
    ratio = np.sqrt(np.mean(repeats**2) / np.mean((repeats - others) ** 2))
    assert best_possible(rows) == pytest.approx(ratio, abs=3e-3)


def test_dots_have_the_rms_of_the_table_and_omit_repeats_without_a_floor():
    floor = np.array([0.03, np.nan, 0.04, 0.05])
    prediction, replay, floors = row("any", 2.0, floor).cross_validation.dots()
    assert len(prediction) == 3
    for dots, rms in ((prediction, 2.0), (replay, 1.8), (floors, 1.0)):
        assert np.sqrt(np.mean(dots**2)) == pytest.approx(rms)
    assert prediction[0] / prediction[2] == pytest.approx(0.6)


def test_the_page_is_complete_offline_and_escaped(page):
    assert figures(page) == ["cross-validation"] and page.count("<svg ") == 2
    assert not re.search(r"https?://|<script|<link|<img|@import|<b> was|<1>", page)
    words = plain(page)
    assert "layered best predicts held-out repeats, with an error of 1.10 times the floor; cone_cylinder ties." in words
    assert "ΔBIC compares only the loading curves and can rank models differently." in words
    assert "3 models on 3 repeats" in words and "possible repeats, 0.82" in words and "paper: <b> was held" in words
    names = set(re.findall(r"<text[^>]*>([^<]*)</text>", page))
    assert {"layered (best)", "cone_cylinder (ties)", "paper", "mean of the others"} <= names


def test_without_a_floor_the_page_gives_the_reason(tmp_path):
    few = Comparison((row("paper", 1.0, np.full(2, np.nan)),))
    few.report(tmp_path / "compare.html")
    text = (tmp_path / "compare.html").read_text(encoding="utf-8")
    assert figures(text) == [] and model_rows(few)[0][-1] == "best"
    assert "no repeatability floor: it needs 3 repeats of the same motion" in plain(text)


def test_same_rows_same_bytes(rows, page, tmp_path):
    rows.report(tmp_path / "again.html", files=["runs/<1>.csv"])
    assert (tmp_path / "again.html").read_text(encoding="utf-8") == page
