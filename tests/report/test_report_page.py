# SPDX-License-Identifier: Apache-2.0
"""The page of a fit: complete, offline, escaped, small, and the same for the same input."""

import html
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from matplotlib.figure import Figure

from needleforce import __version__
from needleforce.campaign.page import field_name
from needleforce.display.canvas import Labels
from needleforce.display.page import script

TABLE = [
    {"quantity": "tissue_young_modulus", "unit": "Pa", "paper": 116e3, "paper_sd": None, "true": 116e3,
     "identified": 110.2e3, "low": 108e3, "high": 112.4e3},
    {"quantity": "cutting_force", "unit": "N", "paper": 0.0776, "paper_sd": 0.0139, "true": 0.0776,
     "identified": 0.0780, "low": 0.0700, "high": 0.0860},
    {"quantity": "cutting_force_low_1mm_s", "unit": "N", "paper": 0.04, "paper_sd": None, "true": None,
     "identified": "not yet", "low": None, "high": None},
]  # fmt: skip


@pytest.fixture
def report(tmp_path):
    """Writes a report and returns its text."""

    def write(fit, **options) -> str:
        fit.report(tmp_path / "report.html", **options)
        return (tmp_path / "report.html").read_text(encoding="utf-8")

    return write


def figures(text: str) -> list[str]:
    return re.findall(r'<figure[^>]* id="figure-([\w-]+)"', text)


def plain(text: str) -> str:
    """The text of a page without tags and repeated spaces."""
    text = re.sub(r"<style>.*?</style>|<svg.*?</svg>|<[^>]+>", "", text, flags=re.S)
    return re.sub(r"\s+", " ", html.unescape(text))


def read(text: str) -> str:
    """A page without its own script, which test_touch.py runs."""
    return text.replace(str(script()), "")


def test_the_page_loads_nothing(make_fit, report):
    text = read(report(make_fit(3, two_pass=True), table=TABLE))
    assert not re.search(r"https?://|//\w+\.\w+/|<script|<link|<img|<iframe|@import|url\((?!#)", text)
    targets = re.findall(r'(?:xlink:href|href|src)="([^"]*)"', text)
    assert targets and all(target.startswith("#") for target in targets)


def test_every_reference_inside_has_one_target(make_fit, report):
    text = report(make_fit(3, two_pass=True), table=TABLE)
    names = re.findall(r' id="([^"]+)"', text)
    assert len(names) == len(set(names))
    assert set(re.findall(r'(?:href="|url\()#([\w-]+)', text)) <= set(names)


def test_tags_are_balanced(make_fit, report):
    open_tags = []

    class Balance(HTMLParser):
        def handle_starttag(self, tag, attrs):
            if tag != "meta":
                open_tags.append(tag)

        def handle_endtag(self, tag):
            assert open_tags.pop() == tag

    Balance().feed(report(make_fit(2), table=TABLE).replace("<!DOCTYPE html>", ""))
    assert open_tags == []


def test_same_input_same_bytes(make_fit, report):
    assert report(make_fit(2, two_pass=True)) == report(make_fit(2, two_pass=True))


def test_twenty_long_recordings_stay_below_two_megabytes(make_fit, report):
    fit = make_fit(20, two_pass=True, rate=2700.0)
    assert min(len(one.recording) for one in fit.recordings) >= 45_000
    assert len(report(fit, table=TABLE).encode()) < 2e6


def test_a_report_holds_file_names_and_no_folders(make_fit, report):
    text = report(make_fit(2, name="/home/jane doe/gel/run.csv"))
    assert "run.csv" in text and "jane" not in text


def test_text_of_files_is_escaped_everywhere(make_fit, report):
    name, note = "<svg onload={}>&$x$\x00\u202e", "<script>alert(1)</script> ${title}"
    text = read(report(make_fit(3, name=name, notes=(note,)), title="<b>$title & co</b>"))
    assert not re.search("<script|<svg onload|<b>|\x00|\u202e", text)
    assert "&lt;b&gt;$title &amp; co&lt;/b&gt;" in text
    assert "&lt;script&gt;alert(1)&lt;/script&gt; ${title}" in text
    assert re.search(r"<text[^>]*>2 +&lt;svg onload=2&gt;&amp;\$x\$", text)  # also in the heading of a small panel


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({}, ["depth", "time", "stiffness", "residuals"]),
        ({"count": 2}, ["depth", "time", "stiffness", "residuals", "recordings"]),
        ({"two_pass": True}, ["depth", "time", "stiffness", "friction", "passes", "residuals"]),
    ],
)
def test_figures_follow_the_input(make_fit, report, options, expected):
    assert figures(report(make_fit(**options))) == expected


def test_each_figure_is_drawn_for_wide_and_narrow_and_named(make_fit, report):
    text = report(make_fit(1))
    assert text.count('<div class="wide">') == text.count('<div class="narrow">') == len(figures(text))
    assert text.count('<svg viewBox="') == text.count('role="img" aria-label="') == 2 * len(figures(text))
    assert {"force [N]", "time [s]", "indentation [mm]"} <= set(re.findall(r"<text[^>]*>([^<]*)</text>", text))


def test_parameters_appear_to_the_displayed_digits(make_fit, report):
    words = plain(report(make_fit(2)))
    for shown in ("3.237 ± 0.039 mm", "0.2101 ± 0.0044 N", "0.02005 ± 0.00062 N/mm²", "0.01860 ± 0.00015 N/mm"):
        assert shown in words
    assert "117.5 kPa (110.0 to 129.0)" in words
    assert "0.13 mm" in words  # between repeats
    assert (
        "at a force of 0.2101 N and an indentation of 3.237 mm; the friction per embedded length is 0.01860 N/mm"
        in words
    )


def test_the_page_has_every_warning_and_note_of_a_fit(make_fit, report):
    fit = make_fit(2, notes=("3 gaps, the longest 56 ms",))
    words = plain(report(fit))
    warnings = "Lateral forces are not small.", "3 gaps, the longest 56 ms.", *fit.model.warnings
    other = "tip half angle: 15°", "The friction coefficient.", "cone cylinder", "+30.0"
    origin = "ab" * 32, "time in s", "average of 10 samples", "noise", "white", __version__
    for shown in (*warnings, *other, *origin):
        assert shown in words, shown


def test_comparison_with_known_true_values(make_fit, report):
    text = report(make_fit(1), table=TABLE)
    words = plain(text)
    assert figures(text)[1] == "ratio"
    for shown in ("116.0 kPa", "110.2 kPa", "108.0 to 112.4", "−5.0 %", "0.078 ± 0.014 N", "+0.5 %", "not yet"):
        assert shown in words, shown


def test_the_anomalous_recording_is_marked(make_fit, report):
    text = report(make_fit(4, anomalous=3))
    assert "Anomalous (blue): no. 3" in plain(text)
    assert "identified; anomalous" in plain(text) and ">no. 3</text>" in text


def test_a_fit_without_model_gives_the_reasons(empty_fit, report):
    words = plain(report(empty_fit))
    assert "No model could be identified from 2 recordings (could not be read or fitted, no contact)." in words
    assert "Recording 1 has no model. silent.csv: no contact" in words
    assert "Recording 2 has no model. broken.csv: could not be read or fitted." in words
    assert "No column." in words


def test_nothing_is_written_if_the_page_cannot_be_made(make_fit, tmp_path):
    with pytest.raises(KeyError):
        make_fit(1).report(tmp_path / "report.html", table=[{"unit": "N"}])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({}, ""),
        (
            {"count": 2},
            "The values above are means over the repeats; the table of recordings has each recording's own fit.",
        ),
        ({"two_pass": True}, "The table of recordings has each recording's own fit, without the second pass."),
    ],
)
def test_a_note_explains_which_values_the_headline_has(make_fit, report, options, expected):
    words = plain(report(make_fit(**options)))
    assert expected in words and ("own fit" in words) == bool(expected)


def test_units_of_fields_are_in_brackets():
    names = [field_name(name) for name in ("speed_mm_s", "angle_deg", "specimen", "needle_type")]
    assert names == ["speed [mm/s]", "angle [°]", "specimen", "needle type"]


def test_labels_are_inside_the_axes():
    figure = Figure(figsize=(4.0, 3.0), dpi=72)
    axes = figure.subplots()
    x = np.linspace(0.0, 10.0, 200)
    axes.plot(x, x)
    axes.margins(x=0.01)
    Labels(axes, [(x, x)]).on("measured force", x, x, "black")
    box = axes.texts[0].get_window_extent()
    assert axes.bbox.x0 <= box.x0 and box.x1 <= axes.bbox.x1
