# SPDX-License-Identifier: Apache-2.0
"""Results show themselves: printed tables, HTML in a notebook, plots with units, DataFrames."""

import matplotlib
import numpy as np
import pytest

import needleforce as nf
from needleforce.identification import Estimate

matplotlib.use("Agg")  # no screen
from matplotlib import pyplot


@pytest.fixture(scope="module")
def recording(root):
    return nf.read(root / "examples" / "insertion.csv")


@pytest.fixture(scope="module")
def fit(recording):
    return nf.identify(recording, needle="paper")


def test_a_printed_fit_has_every_parameter_with_its_interval(fit):
    text = str(fit)
    for name, estimate in fit.parameters.items():
        line = next(line for line in text.splitlines() if line.split()[:1] == [name])
        known = "fixed" if name == "saturation_depth" else "yes" if estimate.identifiable else "no"
        assert str(estimate.shown) in line and known in line.split()
    assert all(title in text for title in ("Warnings:", "Held fixed:", "Cannot be identified:"))
    assert len(repr(fit)) < 160 and "\n" not in repr(fit)


@pytest.mark.parametrize("rounding", [0.0, 4.3e-19])
def test_a_value_that_several_fits_hold_is_fixed(rounding):
    ends = {"low": 3.3e-3, "high": 3.3e-3 + rounding, "systematic": (0.0, rounding)}
    held = Estimate("saturation_depth", 3.3e-3, "m", **ends, identifiable=False)
    assert held.known == "fixed" and held.systematic_share == "" and str(held.shown) == "3.3\N{NO-BREAK SPACE}mm"


def test_parameters_are_attributes_too(fit):
    assert fit.parameters.cutting_force is fit.parameters["cutting_force"]
    assert "puncture_force" in dir(fit.parameters)
    with pytest.raises(AttributeError, match="no parameter 'nothing' was identified; there are: stiffness_coefficient"):
        _ = fit.parameters.nothing


def test_html_is_a_table_and_escaped(fit, recording):
    for shown in (fit, recording, fit.model, fit.parameters):
        html = shown._repr_html_()
        drawn = shown is fit or shown is recording
        assert "<table" in html and html.count("<svg") == html.count("<script") == drawn  # a drawing has its own
    named = nf.Recording(time=[0, 1], depth=[0, 1], force=[0, 1], card=type(recording.card)(source="<script>x"))
    assert "&lt;script&gt;x" in named._repr_html_() and named._repr_html_().count("<script") == 1


def test_estimates_events_and_looks_print_what_a_reader_asks(fit, recording, root):
    force = fit.parameters.cutting_force
    assert repr(force) == f"<Estimate {force}>" and str(force) == f"cutting_force: {force.shown}"
    events = nf.segment(recording)
    lines = {line.split()[0]: line for line in repr(events).splitlines() if line.split()}
    assert f"{1e3 * events.punctures[0].depth:.3f}" in lines["puncture"] and "N" in lines["contact"]
    assert "- hold:" in repr(events) and "np." not in repr((force, events)) and "<table" in events._repr_html_()
    look = nf.read(root / "examples" / "insertion.csv", dry_run=True)
    assert repr(look) == str(look) and look._repr_html_().count("<table") == 3


def test_a_dataframe_has_the_values(fit, recording):
    frame = fit.to_dataframe()
    assert frame.loc["cutting_force", "value"] == fit.parameters.cutting_force.value
    columns = recording.to_dataframe()
    np.testing.assert_array_equal(columns["force [N]"], recording.force)


def test_residuals_are_measured_minus_model(fit, recording):
    (residual,) = fit.residuals
    np.testing.assert_array_equal(residual, recording.force - fit.recordings[0].predicted)


@pytest.mark.parametrize("draw", ["fit", "recording", "model", "comparison"])
def test_plots_have_units_on_both_axes(draw, fit, recording):
    shown = {"fit": fit, "recording": recording, "model": fit.model}
    shown["comparison"] = nf.compare([recording], models=["paper", "cone_cylinder"])
    figure, axes = pyplot.subplots()
    assert shown[draw].plot(axes) is axes
    labels = axes.get_xlabel(), axes.get_ylabel()
    assert "[" in labels[0] and ("[" in labels[1] or draw == "comparison")
    pyplot.close(figure)


def test_a_recording_without_an_insertion_is_plotted():
    still = nf.Recording(time=np.arange(5.0), depth=np.zeros(5), force=np.zeros(5))
    (line,) = nf.identify(still).plot().lines
    assert len(line.get_xdata()) == 5


def test_wrong_axes_are_refused(recording):
    with pytest.raises(nf.InputError, match="not matplotlib axes"):
        recording.plot(3)
    with pytest.raises(nf.InputError, match="known are depth and time"):
        recording.plot(over="speed")


def test_a_comparison_is_a_table(recording):
    table = nf.compare([recording], models=["paper", "cone_cylinder"])
    assert str(table).splitlines()[0].split()[0] == "model" and "<table" in table._repr_html_()
    assert list(table.to_dataframe().index) == [row.model for row in table]


@pytest.mark.parametrize("source", ["path", "frame", "columns", "arrays"])
def test_identify_and_segment_take_what_a_user_has(source, recording, fit, root):
    columns = {"time [s]": recording.time, "depth [m]": recording.depth, "force [N]": recording.force}
    given = {
        "path": root / "examples" / "insertion.csv",
        "frame": recording.to_dataframe(),
        "columns": columns,
        "arrays": (recording.time, recording.depth, recording.force),
    }[source]
    assert nf.segment(given).contact.depth == nf.segment(recording).contact.depth
    found = nf.identify(given, needle="paper").parameters.puncture_force.value
    assert found == pytest.approx(fit.parameters.puncture_force.value, rel=1e-3)


def test_what_is_taken_is_named_where_something_else_is_given():
    with pytest.raises(nf.InputError, match="recording is int, taken are a Recording, a path, a pandas DataFrame"):
        nf.segment(3)


def test_the_velocity_is_derived(recording):
    derived = nf.Recording(time=recording.time, depth=recording.depth, force=recording.force)
    assert np.abs(derived.velocity - recording.velocity).max() < 0.05 * np.abs(recording.velocity).max()
    with pytest.raises(nf.InputError, match=r"force is missing, .*Recording\(time="):
        nf.Recording(time=[0.0, 1.0], depth=[0.0, 1.0])


def test_a_part_of_a_recording(recording):
    part = recording.between(time=(1.0, 3.0))
    assert part.time[0] >= 1.0 and part.time[-1] <= 3.0 and part.card == recording.card
    shallow = recording.between(depth=(0.0, 5e-3))
    assert shallow.depth.min() >= 0.0 and shallow.depth.max() <= 5e-3
    with pytest.raises(nf.InputError, match=r"at least 2 are needed; time is 0\.01 to"):
        recording.between(time=(100.0, 200.0))


@pytest.mark.parametrize("kind", ["json", "toml", "model"])
def test_models_and_needles_are_named_in_one_way(kind, fit, recording, tmp_path):
    (tmp_path / "fit.json").write_text(fit.to_json(), encoding="utf-8")
    fit.save(tmp_path / "fit.toml")
    source = {"json": tmp_path / "fit.json", "toml": tmp_path / "fit.toml", "model": fit.model}[kind]
    again = nf.identify(recording, model=source, needle=source)
    assert again.parameters.puncture_force.value == fit.parameters.puncture_force.value
    assert nf.preset(source).stiffness.name == fit.model.stiffness.name
    assert nf.compare([recording], models=[source])[0].model == "cone_cylinder"


def test_a_needle_that_is_not_there_is_named():
    with pytest.raises(nf.InputError, match="needle is 'nothing', neither a preset nor a file"):
        nf.identify((np.arange(3.0), np.arange(3.0), np.arange(3.0)), needle="nothing")
