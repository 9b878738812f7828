# SPDX-License-Identifier: Apache-2.0
"""Every result prints, draws, reports and exports itself: a row for each class, and none is missing."""

import importlib
import json
import pkgutil
from types import SimpleNamespace

import matplotlib
import numpy as np
import pytest
from test_models_page import row

import needleforce as nf
from needleforce import bench_tests, campaign, steering
from needleforce.bench_tests import StressCurve, fit_stress, needle_modulus, nominal_stress, penetration_tests
from needleforce.campaign.recording_result import RecordingResult, Trace
from needleforce.display.result import Result
from needleforce.identification import fit_indentation, fit_unloading
from needleforce.identification.comparison import Comparison
from needleforce.identification.estimates import Estimate, EstimateResult, Parameters
from needleforce.identification.result import Fit
from needleforce.steering import BaseMotion, SteeringEstimate
from needleforce.vocabulary import Status

matplotlib.use("Agg")  # no screen
from matplotlib import pyplot

LINE = np.linspace(0.0, 1e-2, 5)
MOTION = BaseMotion(LINE, np.zeros((5, 2)), np.zeros(5))
STEPS = {"motion": MOTION, "force": LINE, "wrench": np.ones((5, 6))}


def stress() -> bench_tests.StressFit:
    stretch = np.linspace(1.0, 1.3, 31)
    measured = nominal_stress("yeoh", stretch, [19e3, 500.0, 30.0], "uniaxial")
    return fit_stress(StressCurve(stretch, measured + 50.0 * np.sin(40.0 * stretch)), law=["yeoh", "neo_hookean"])


def bending() -> bench_tests.BendingFit:
    needle = nf.Needle(outer_diameter=0.7e-3, length=0.08, young_modulus=14.1e9)
    position = np.array([0.02, 0.04, 0.06, 0.08])
    small = 0.05 * position**2 * (0.24 - position) / (6.0 * needle.bending_stiffness)
    return needle_modulus(np.full(4, 0.05), position, small * [1.0, 1.001, 0.999, 1.0], needle)


def penetration() -> bench_tests.PenetrationTests:
    travel = np.arange(0.0, 12e-3, 2e-5)
    force = np.interp(1e3 * travel, [0, 1, 2, 2.02, 4, 5, 12], [0, 0, 0.8, 0.4, 1.2, 0.3, 0.3])
    noise = 4e-3 * np.random.default_rng(1).standard_normal((2, len(travel)))
    return penetration_tests({"a-1": (travel, force + noise[0]), "a-2": (travel, force + noise[1]), "a-3": None})


def indentation() -> nf.identification.IndentationFit:
    depth, tip = np.linspace(-1e-3, 2e-3, 300), nf.tips.Sphere(2e-3)
    force = nf.contact(tip, depth=np.maximum(depth, 0.0), reduced_modulus=2e4).force
    return fit_indentation(depth, force + 1e-4 * np.random.default_rng(2).standard_normal(300), tip, poisson_ratio=0.5)


def unloading() -> nf.identification.UnloadingFit:
    depth, tip = np.linspace(2e-4, 0.0, 300), nf.tips.Sphere(2e-3)
    return fit_unloading(depth, nf.contact(tip, depth=depth, reduced_modulus=2e4).force, tip, poisson_ratio=0.5)


def many() -> campaign.Campaign:
    trace, estimate = Trace(LINE, 10.0 * LINE), Estimate("puncture_force", 0.2, "N", 0.1, 0.3)
    files = [RecordingResult(file=f"{k}.csv", fields={}, status=Status.ok, pooled=True, shown=trace) for k in (1, 2)]
    one = campaign.Condition(
        fields={"gel": "<soft>"},
        recordings=tuple(files),
        parameters={estimate.name: estimate},
        model=nf.preset("paper"),
        shown=trace,
    )
    return campaign.Campaign((one,), notes=("a note",))


def steered(kind: type) -> steering.SteeringResult:
    modulus = SteeringEstimate(
        name="modulus", value=2e4, low=1e4, high=4e4, unit="Pa", meaning="of the foundation", identifiable=True
    )
    predictor = SimpleNamespace(insertions=(), left_out={}, judged=())
    model = SimpleNamespace(form="linear", predictor=predictor, needle=nf.Needle(1e-3, 0.0, 0.2, 1e11))
    return kind(model, (modulus,), (("a", "b", 0.95),), {"first": 1e-3})


def planned() -> steering.Plan:
    problem = SimpleNamespace(target=np.array([0.0, 0.0, 1e-2]), obstacles=(), distances=lambda *_: np.array([np.inf]))
    path = np.column_stack([0.1 * LINE, 0.0 * LINE, LINE])
    made = steering.Plan(**STEPS, path=path, miss=1e-3, clearance=np.inf, faults=("too <far>",), problem=problem)
    made.__dict__.update(sd=np.full(5, 1e-4), shapes=(path,))  # found once from the problem, which here is empty
    return made


def solids() -> list[Result]:
    fe = importlib.import_module("needleforce.fe")
    own = {"young_modulus": {"gel": 2e4}, "low": {"gel": 1e4}, "high": {"gel": 3e4}}
    both = {"half_space_modulus": 3e4, "geometry_factor": 1.5, "rmse": 1e-3}
    contact = {"contact_depth": 1e-3, "contact_low": 0.9e-3, "contact_high": 1.1e-3}
    pressed = {"linear_young_modulus": {"gel": 2e4}, "closed_form": "half-space", "closed_form_modulus": 3e4}
    sizes = {"large_strain_factor": 1.1, "geometry_factor": 1.2, "rmse": 1e-3, "linear_rmse": 2e-3, "solutions": 3}
    limits = {"low": {"gel": {"shear_modulus": 5e3}}, "high": {"gel": {"shear_modulus": 9e3}}}
    gel = {"materials": {"gel": fe.NeoHookean(7e3, 7e5)}, "young_modulus": {"gel": 2e4}}
    friction = Parameters({"force_offset": Estimate("force_offset", 0.0, "N", -1e-3, 1e-3)})
    curve = {"depth": LINE, "force": LINE, "fitted": LINE, "parameters": friction, "noise": 1e-4}
    return [
        fe.ModulusFit(**own, **contact, **both, solutions=4),
        fe.HyperelasticFit(**gel, **limits, **contact, **pressed, **sizes),
        fe.InsertionFit(**own, **both, **curve, condensed=None, model=nf.preset("paper")),
    ]


def studied() -> list[Result]:
    factor = {"name": "friction.per_length_N_per_mm", "low": 0.01, "high": 0.03}
    motion = {"name": "<soft>", "depth_mm": 8.0}
    sample = nf.study({"study": {"method": "sensitivity", "samples": 8}, "factor": factor, "motion": motion}, jobs=1)
    experiments = {"parameters": ["friction_per_length"], "repeats": [1], "experiments": 2}
    design = {"study": {"method": "design"}, "factor": factor, "motion": motion, "design": experiments}
    return [sample, nf.study(design, jobs=1)]


def watched() -> list[Result]:
    online = nf.OnlineIdentifier()
    depth = np.linspace(-1e-3, 6e-3, 1400)
    for each in depth:
        online.step(2e2 * max(each, 0.0), each, 5e-3)
    falls = 50.0 * np.maximum(depth, 0.0) - np.where(depth > 3e-3, 0.1, 0.0)
    run = nf.Recording(time=5e-3 * np.arange(1400), force=falls, depth=depth).with_events(contact=1.0, punctures=[4.0])
    return [online.ahead(1e-3), nf.events.choose([run], fall=(0.05, 0.1), share=(0.1,))]


def results() -> list[Result]:
    rows = Comparison((row("paper", 1.0), row("maurin", 1.2, ties=True, notes=("<b> was held",))))
    needles = penetration()
    run = steering.SteeredRun(**STEPS, tip=np.ones((5, 3)), shapes=(np.eye(3),), layers=(5e-3,), lost=LINE > 1.0)
    kinds = steering.SteeringFit, steering.ShapeFit, steering.WrenchFit
    tissue = [stress(), bending(), needles, needles.tests[0], indentation(), unloading(), *solids()]
    found = nf.preset("paper").force_gradient(np.linspace(-1e-3, 8e-3, 50), np.arange(50.0))
    return [found, rows, many(), *map(steered, kinds), planned(), run, *tissue, *studied(), *watched()]


RESULTS = {type(result).__name__: result for result in results()}


def check(result: Result, path) -> None:
    """Print, notebook, plot, report, table and JSON of one result."""
    html, text = result._repr_html_(), str(result)
    assert result.heading() in text and "\n" not in repr(result)
    assert "<table" in html and "<b> was" not in html and "<soft>" not in html
    figure, axes = pyplot.subplots()
    assert result.plot(axes) is axes and (axes.lines or axes.collections)
    assert "[" in axes.get_xlabel() + axes.get_ylabel()
    pyplot.close(figure)
    result.report(path, title="<of> a test")
    page = path.read_text(encoding="utf-8")
    assert "<h1>&lt;of&gt; a test</h1>" in page and "http" not in page
    assert "<svg" in page or isinstance(result, steering.SteeringResult)  # whose figures are of measured tips
    assert len(result.to_dataframe()) and len(result.to_dataframe().columns)
    assert json.loads(result.to_json(), parse_constant=pytest.fail)


@pytest.mark.parametrize("name", RESULTS)
def test_a_result_shows_itself(name, tmp_path):
    check(RESULTS[name], tmp_path / "report.html")


def test_a_fit_shows_itself(make_fit, layered_fit, tmp_path):
    for fit in (make_fit(2), layered_fit):
        check(fit, tmp_path / "report.html")


def test_every_class_of_results_is_here():
    others = tuple(f"needleforce.{name}" for name in ("mujoco", "simulators.warp", "cli", "commands"))
    for each in pkgutil.walk_packages(nf.__path__, "needleforce."):
        if not each.name.startswith(others):
            importlib.import_module(each.name)
    pending, found = [Result], set()
    while pending:
        kind = pending.pop()
        pending += kind.__subclasses__()
        found.add(kind.__name__)
    bases = {Result.__name__, EstimateResult.__name__, steering.SteeringResult.__name__}
    assert found - bases == {*RESULTS, Fit.__name__, "LayeredFit"}
