# SPDX-License-Identifier: Apache-2.0
"""The report of a layered fit: the choice of layers, the parameters by layer, and the force of each layer."""

import dataclasses
import json
import re

import numpy as np
import pytest
from test_report_page import figures, plain

import needleforce as nf
from needleforce.display.quantities import quantity
from needleforce.identification.report.curves import DrawnRepeat, repeats
from needleforce.identification.report.force_figures import layer_forces
from needleforce.identification.report.words import by_layer


def drawn(fit) -> DrawnRepeat:
    return repeats(fit.recordings, fit.shared_contact)[0]


def forces_of(fit, one) -> list[np.ndarray]:
    return layer_forces(fit.model, fit.parameters["contact_depth"].value, one)


@pytest.fixture
def page(layered_fit, tmp_path):
    layered_fit.report(tmp_path / "report.html")
    return (tmp_path / "report.html").read_text(encoding="utf-8")


def test_forces_of_the_layers_add_up_to_the_model(layered_fit):
    one = drawn(layered_fit)
    forces = forces_of(layered_fit, one)
    assert len(forces) == 2 and max(np.abs(forces[1])) > 0.1
    # the sum was simulated in the zero of the surface: equal up to rounding of the depths
    np.testing.assert_allclose(sum(forces), one.model, atol=1e-9)
    np.testing.assert_allclose(layered_fit.new_insertion(one.fit.recording), one.model, atol=1e-9)
    assert one.indentation.max() == pytest.approx(20.0, abs=0.05)


def test_a_power_of_the_speed_scales_every_layer(layered_fit):
    first, second = layered_fit.recordings
    faster = dataclasses.replace(first, predicted=1.2 * first.predicted)
    one = drawn(dataclasses.replace(layered_fit, recordings=(faster, second)))
    plain_one = drawn(layered_fit)
    for fast, slow in zip(forces_of(layered_fit, one), forces_of(layered_fit, plain_one)):
        np.testing.assert_allclose(fast, 1.2 * slow, atol=1e-9)


def test_the_choice_is_shown(page):
    section = re.search(r'<section id="choice">.*?</section>', page, re.S)[0]
    rows = [re.findall(r"<td[^>]*>(.*?)</td>", row) for row in re.findall(r"<tr>(.*?)</tr>", section)][1:]
    shown = [[plain(cell) for cell in row] for row in rows]
    assert shown == [
        ["1 layer", "12", "5.5 %", "864", "6.8 %", ""],
        ["2 layers", "22", "1.4 %", "0", "3.7 %", "chosen"],
        ["2 layers, no saturation", "20", "1.5 %", "11", "3.9 %", "ties"],
    ]
    assert (
        "the one with the fewest parameters is chosen" in plain(section) and "Choice of the stiffness law" not in page
    )


def test_bic_is_the_criterion_with_fewer_than_three_repeats(layered_fit, tmp_path):
    evidence = tuple(dataclasses.replace(row, left_out=None) for row in layered_fit.settings.evidence[1:])
    fit = dataclasses.replace(layered_fit, settings=dataclasses.replace(layered_fit.settings, evidence=evidence))
    fit.report(tmp_path / "report.html")
    words = plain((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert (
        "fewer than three repeats the choice with the lowest BIC is taken" in words
        and "The number of layers was given." in words
    )


def test_parameters_are_in_the_table_of_their_layer(page):
    found = page[page.index('id="parameters"') :]
    headings = re.findall(r"<h3>([^<]*)</h3>", found)
    assert headings[:3] == ["Layer 1", "Layer 2", "All layers"]
    tables = [plain(part) for part in found.split("<h3>")[1:4]]
    assert "friction per embedded lengthfriction_per_length0.1400 ± 0.0050 N/mm" in tables[0]
    assert (
        "friction per embedded lengthlayer_2_friction_per_length0.0700 ± 0.0060 N/mm0.0030 N/mm0.0015 N/mm" in tables[1]
    )
    assert "0.310 ± 0.020" in tables[2] and "How obtained: layered fit." in tables[2]
    assert {"sd between repeats", "error within a run (sd)"} <= set(re.findall(r"<th[^>]*>([^<]*)</th>", page))


def test_figures_and_outcome(page):
    assert figures(page) == ["depth", "time", "stiffness", "layers", "residuals", "recordings"]
    words = plain(page)
    assert "2 layers of tissue, whose forces add up; they rupture with the tip 8.00 mm and 15.00" in words
    assert "15.00 mm below the surface" in words and "layered, 2 layers" in words
    assert "Friction: dragged tissue." in words and "Relaxation: prony." in words
    assert "relative to the fitted contact depth; depths in the tables are" in words
    assert "Indentation is measured from the identified contact." in words
    assert words.count("not reached") == 1  # the second layer in the second run


def test_a_rupture_that_no_run_reached_has_no_depth(layered_fit, tmp_path):
    name = "layer_2_puncture_depth"
    unreached = dataclasses.replace(layered_fit.parameters[name], identifiable=False)
    fit = dataclasses.replace(layered_fit, parameters=layered_fit.parameters | {name: unreached})
    fit.report(tmp_path / "report.html")
    words = plain((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert "one of them ruptures with the tip 8.00 mm below the surface" in words


def test_json_has_ruptures_and_population(layered_fit):
    document = json.loads(layered_fit.to_json())
    assert document["ruptures"]["depth_m"] == [10e-3, 17e-3]
    preset = document["population"]["preset"]
    assert preset["friction"]["law"] == "dragged_tissue" and preset["layers"][0]["top_m"] == 10e-3
    assert [row["chosen"] for row in document["settings"]["evidence"]] == [False, True, False]


def test_a_saved_model_reads_back_unchanged(layered_fit, tmp_path):
    layered_fit.save(tmp_path / "mine.toml")
    assert nf.preset(tmp_path / "mine.toml") == layered_fit.model


def test_one_layer_has_no_headings(layered_fit):
    one = {name: e for name, e in layered_fit.parameters.items() if not name.startswith("layer_2")}
    assert by_layer(one) == {"": one} and by_layer({}) == {}


def test_very_wide_limits_have_two_digits():
    assert str(quantity(559.0, 0.0185, 1.68e7, "N/m^2")).replace("\N{NO-BREAK SPACE}", " ") == (
        "0.00056 N/mm² (0.00000 to 17)"
    )
