# SPDX-License-Identifier: Apache-2.0
"""Studies against closed forms: shares of variance, probabilities, moments, posteriors; folders that continue;
questions that are refused."""

import json
import math

import numpy as np
import pytest

import needleforce as nf
from needleforce.errors import InputError
from needleforce.studies.sensitivity import sensitivity

FRICTION = {"name": "friction.per_length_N_per_mm", "low": 0.01, "high": 0.03}
CUTTING = {"name": "cutting.force_N", "distribution": "normal", "mean": 0.08, "sd": 0.02}
COLUMNS = ["friction.per_length", "cutting.force", "puncture.depth", "motion.speed"]
DEEP = {"quantity": "force_at_depth", "depth_mm": 15.0}


def asked(method=None, **tables):
    question = {"study": {"samples": 256, "seed": 3, **(method or {})}, "factor": [FRICTION, CUTTING], "output": [DEEP]}
    return question | tables


def variance_shares():
    """Of the force at 15 mm, f' 15 mm + F_c: a uniform friction and a normal cutting force are independent."""
    friction, cutting = (15.0 * 0.02) ** 2 / 12.0, 0.02**2
    return np.array([friction, cutting]) / (friction + cutting)


@pytest.mark.parametrize("analysis", ["sobol", pytest.param("delta", marks=pytest.mark.long)])
def test_the_shares_of_a_sum_are_those_of_the_variances(analysis):
    method = {"method": "sensitivity", "samples": 512 if analysis == "sobol" else 1000, "analysis": analysis}
    found = nf.study(asked(method), jobs=1).sensitivities["force_at_depth_15_mm", "motion 1"]
    classes = 0.05 if analysis == "delta" else 0.02  # delta's first order is that of classes, whose width it leaves out
    assert np.all(np.abs(found.main - variance_shares()) <= np.maximum(1.5 * found.main_error, classes))
    if analysis == "sobol":
        assert np.all(np.abs(found.total - variance_shares()) <= np.maximum(1.5 * found.total_error, 0.02))


def test_morris_finds_the_slopes_of_a_sum():
    question = asked({"method": "sensitivity", "samples": 20, "analysis": "morris"}, factor=[FRICTION])
    found = nf.study(question, jobs=1).sensitivities["force_at_depth_15_mm", "motion 1"]
    np.testing.assert_allclose(found.total, [15.0 * 0.02], rtol=1e-6)  # over the whole range of the factor


def test_indices_of_the_function_of_ishigami():
    """Its indices are known (Ishigami & Homma 1990): first order 0.3139, 0.4424, 0; total 0.5576, 0.4424, 0.2437."""
    from SALib.sample.sobol import sample

    names = ["a", "b", "c"]
    problem = {"num_vars": 3, "names": names, "bounds": [[0.0, 1.0]] * 3}
    rows = sample(problem, 2048, calc_second_order=True, seed=1)
    x = math.pi * (2.0 * rows - 1.0)
    values = np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])
    found = sensitivity("sobol", names, rows, values, interactions=True)
    assert np.all(np.abs(found.main - [0.3139, 0.4424, 0.0]) <= found.main_error)
    assert np.all(np.abs(found.total - [0.5576, 0.4424, 0.2437]) <= found.total_error)
    assert found.pairs[0, 2] == pytest.approx(0.2437, abs=0.05) and found.pairs[2, 0] == found.pairs[0, 2]
    values[5] = np.nan  # its group of eight is left out, the others stay
    assert sensitivity("sobol", names, rows, values, interactions=True).rows == len(rows) - 8


def test_the_share_within_limits_is_the_probability():
    limited = DEEP | {"high": 0.08 + 15.0 * 0.02}  # half of a symmetric distribution
    result = nf.study(asked({"method": "robust", "samples": 2048}, output=[limited]), jobs=1)
    inside, total = result.within(result.outputs[0], "motion 1")
    assert total == 2048 and inside / total == pytest.approx(0.5, abs=0.02)


def test_factors_have_their_distributions():
    factors = [
        FRICTION,
        CUTTING,
        {"name": "puncture.depth_mm", "distribution": "log-normal", "median": 3.0, "ratio": 1.5, "high": 6.0},
        {"name": "motion.speed_mm_s", "distribution": "choices", "choices": [1.0, 3.0]},
    ]
    table = nf.study(asked({"samples": 1024}, factor=factors), jobs=1).to_dataframe()
    friction, cutting, depth, speed = (table[name].to_numpy(float) for name in COLUMNS)
    assert friction.min() >= 10.0 and friction.max() <= 30.0 and friction.mean() == pytest.approx(20.0, rel=0.01)
    assert cutting.mean() == pytest.approx(0.08, rel=0.01) and cutting.std() == pytest.approx(0.02, rel=0.03)
    assert depth.max() <= 6e-3 and np.mean(np.log(depth[depth < 3e-3] / 3e-3)) < 0.0
    assert np.mean(speed == 1e-3) == pytest.approx(0.5, abs=0.01)
    expected = 15e-3 * friction + cutting
    np.testing.assert_allclose(table["force_at_depth_15_mm"], expected, rtol=1e-9)


def test_a_grid_has_every_combination():
    factors = [
        FRICTION | {"levels": 3},
        {"name": "model.preset", "distribution": "choices", "choices": ["paper", "azar"]},
    ]
    table = nf.study(asked({"method": "grid"}, factor=factors), jobs=1).to_dataframe()
    assert len(table) == 6
    assert sorted(set(table[COLUMNS[0]])) == pytest.approx([10.0, 20.0, 30.0])


def test_the_result_does_not_depend_on_processes_and_continues(tmp_path):
    question = asked({"samples": 1024}, output=[DEEP, {"quantity": "curve", "points": 20}])
    alone = nf.study(question, jobs=1, out=tmp_path / "one")
    nf.study(question, jobs=2, out=tmp_path / "two")
    found = (tmp_path / "one").rglob("*.*")
    files = sorted(path.relative_to(tmp_path / "one") for path in found if path.parent.name != "state")
    assert len(files) >= 4
    for file in files:
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes()
    kept, lost = sorted((tmp_path / "two" / "blocks").glob("*.parquet"))[:2]
    before = kept.stat().st_mtime_ns
    lost.unlink()
    again = nf.study(question, jobs=1, out=tmp_path / "two")
    assert kept.stat().st_mtime_ns == before and lost.exists()
    for name, column in alone.columns.items():
        np.testing.assert_array_equal(again.columns[name], column)
    with pytest.raises(InputError, match="another study"):
        nf.study(asked({"samples": 1024}), out=tmp_path / "two")


def test_draws_of_a_fit_have_its_intervals_and_correlations(tmp_path):
    rows = {"friction_per_length": (18.6, 17.0, 20.2), "cutting_force": (0.08, 0.07, 0.09)}
    rows |= {"puncture_indentation": (3.2e-3, 3.1e-3, 3.3e-3), "stiffness_coefficient": (2e4, 1.9e4, 2.1e4)}
    fit = nf.identify(nf.simulate(nf.preset("paper"), nf.Motion.insert(-5e-3, 3e-3, 20e-3), 200.0))
    document = json.loads(fit.to_json())
    document["parameters"] = [
        {"name": name, "value": value, "low": low, "high": high} for name, (value, low, high) in rows.items()
    ]
    document["correlations"] = {"names": list(rows)[:2], "matrix": [[1.0, -0.8], [-0.8, 1.0]]}
    document["model"] = "identified_cone"
    (tmp_path / "fit.json").write_text(json.dumps(document), encoding="utf-8")
    outputs = [{"quantity": "force_at_depth", "depth_mm": depth} for depth in (10.0, 18.0)]
    (tmp_path / "study.toml").write_text(
        "posterior = true\n[study]\nsamples = 1024\n[model]\nfit = 'fit.json'\n"
        + "".join(f"[[output]]\nquantity = 'force_at_depth'\ndepth_mm = {each['depth_mm']}\n" for each in outputs),
        encoding="utf-8",
    )
    table = nf.study(tmp_path / "study.toml", jobs=1).to_dataframe()
    shallow, deep = table["force_at_depth_10_mm"], table["force_at_depth_18_mm"]
    friction = (deep - shallow) / 8e-3
    cutting = shallow - 10e-3 * friction
    assert friction.std() == pytest.approx(1.6 / 1.96, rel=0.06) and friction.mean() == pytest.approx(18.6, rel=0.01)
    assert np.corrcoef(friction, cutting)[0, 1] == pytest.approx(-0.8, abs=0.05)


def test_values_of_a_campaign_stay_together(tmp_path):
    lines = ["specimen,file,quantity,value,unit,identifiable"]
    for k in range(5):
        known = k < 4  # the fifth condition does not identify its friction
        lines += [f"s{k},,friction_per_length,{10.0 + k},N/m,{known}", f"s{k},,cutting_force,{0.05 + 0.01 * k},N,True"]
        lines += [f"s{k},a.csv,cutting_force,99,N,True"]  # a row of one recording is none of the condition
    (tmp_path / "table.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    of_table = {"distribution": "campaign", "table": str(tmp_path / "table.csv")}
    factors = [
        {"name": FRICTION["name"], "quantity": "friction_per_length", **of_table},
        {"name": CUTTING["name"], "quantity": "cutting_force", **of_table},
    ]
    table = nf.study(asked({"samples": 64}, factor=factors), jobs=1).to_dataframe()
    np.testing.assert_allclose(table[COLUMNS[1]], 0.05 + 0.01 * (table[COLUMNS[0]] - 10.0))
    assert table[COLUMNS[0]].nunique() == 4


def test_a_campaign_in_another_unit_is_refused(tmp_path):
    rows = [f"s{k},,stiffness_coefficient,{k},N/m^2,True" for k in (1, 2)]
    text = "\n".join(["specimen,file,quantity,value,unit,identifiable", *rows])
    (tmp_path / "table.csv").write_text(text, encoding="utf-8")
    factor = {"distribution": "campaign", "table": str(tmp_path / "table.csv"), "quantity": "stiffness_coefficient"}
    with pytest.raises(InputError, match=r"N/m\^2"):
        nf.study(asked(factor=[factor | {"name": FRICTION["name"]}]), jobs=1)


def test_a_real_fit_gives_a_posterior(tmp_path, root):
    fit = nf.identify(nf.read(root / "examples" / "insertion.csv"))
    (tmp_path / "fit.json").write_text(fit.to_json(), encoding="utf-8")
    question = asked({"samples": 32}, factor=[], posterior=True, model={"fit": str(tmp_path / "fit.json")})
    table = nf.study(question, jobs=1).to_dataframe()
    friction, cutting = (fit.parameters[name].value for name in ("friction_per_length", "cutting_force"))
    assert not any(table["why"]) and table["force_at_depth_15_mm"].std() > 0.0
    assert table["force_at_depth_15_mm"].mean() == pytest.approx(15e-3 * friction + cutting, rel=0.1)


def test_a_folder_knows_its_files_and_its_blocks(tmp_path, root):
    preset = tmp_path / "mine.toml"
    preset.write_text((root / "src/needleforce/presets/paper.toml").read_text(encoding="utf-8"), encoding="utf-8")
    question = asked({"samples": 1024}, model={"preset": str(preset)})
    first = nf.study(question, jobs=1, out=tmp_path / "out").columns
    block = tmp_path / "out" / "blocks" / "000001.parquet"
    for content in (block.read_bytes()[:900], (block.parent / "000000.parquet").read_bytes()):
        block.write_bytes(content)
        again = nf.study(question, jobs=1, out=tmp_path / "out").columns
        np.testing.assert_array_equal(again["force_at_depth_15_mm"], first["force_at_depth_15_mm"])
    preset.write_text(preset.read_text(encoding="utf-8").replace("depth_mm = 3.237", "depth_mm = 4"), encoding="utf-8")
    with pytest.raises(InputError, match="files that changed"):
        nf.study(question, jobs=1, out=tmp_path / "out")
    (tmp_path / "out" / "study.json").write_text("{", encoding="utf-8")
    with pytest.raises(InputError, match="damaged"):
        nf.study(question, jobs=1, out=tmp_path / "out")


def test_a_distribution_that_is_cut_stays_within_its_limits():
    tail = {"name": "cutting.force_N", "distribution": "normal", "mean": 0.02, "sd": 0.001, "low": 0.029}
    drawn = nf.study(asked({"samples": 256}, factor=[tail]), jobs=1).to_dataframe()["cutting.force"]
    assert drawn.min() >= 0.029 and drawn.max() < 0.033


def test_a_learning_set_shows_the_sensor_and_keeps_specimens_apart(tmp_path):
    from pyarrow import parquet

    noise = 5e-3
    settings = {"repeats": 2, "samples": 100, "noise_N": noise, "filter_length": 1, "bias_N": 0.0}
    nf.study(asked({"samples": 60}, recordings=settings), jobs=1, out=tmp_path / "set")
    parts = {path.name: parquet.read_table(path).to_pylist() for path in (tmp_path / "set" / "recordings").iterdir()}
    specimens = {name: {row["number"] for row in rows} for name, rows in parts.items()}
    assert sum(len(rows) for rows in parts.values()) == 120 and sum(map(len, specimens.values())) == 60
    for row in parts["split=train"]:
        depth, force, phase = (np.array(row[name]) for name in ("depth", "force", "phase"))
        assert np.std(force[phase == 0]) == pytest.approx(noise, rel=0.5)
        cutting = depth > row["puncture_depths"][0] + 1e-3
        inwards = cutting & (phase == list(nf.Phase).index(nf.Phase.insertion))
        expected = row[COLUMNS[0]] * depth + row[COLUMNS[1]]
        assert np.abs(np.mean((force - expected)[inwards])) < 5.0 * noise / np.sqrt(inwards.sum())


def test_a_deeper_insertion_narrows_friction_more():
    question = asked(
        {"method": "design"},
        motion=[{"name": "8 mm", "depth_mm": 8.0}, {"name": "25 mm", "depth_mm": 25.0}],
        design={"parameters": ["friction_per_length"], "repeats": [1], "experiments": 4},
    )
    result = nf.study(question, jobs=1)
    assert result.candidates[result.order()[0]].motion == 1
    other = nf.study(question | {"study": {"method": "design", "seed": 9}}, jobs=1)
    np.testing.assert_allclose(result.expected(0)[:, 0], other.expected(0)[:, 0], rtol=0.5)


def test_insertions_that_leave_a_law_are_counted_with_their_reason():
    wide = {"name": "cutting.force_N", "distribution": "normal", "mean": 0.02, "sd": 0.01}
    result = nf.study(asked({"samples": 1024}, factor=[wide]), jobs=1)
    assert result.failed.mean() == pytest.approx(0.0228, abs=0.004)  # two standard deviations below the mean
    assert "cutting" in result.reasons[0][0] and "failed" in str(result)


def test_a_page_and_json_show_what_matters(tmp_path):
    method = {"method": "sensitivity", "samples": 32, "interactions": True, "name": "what matters"}
    result = nf.study(asked(method, output=[DEEP, {"quantity": "curve"}]), jobs=1)
    result.report(tmp_path / "study.html")
    page = (tmp_path / "study.html").read_text(encoding="utf-8")
    assert "friction: per length [N/mm]" in page and "What matters" in page and page.count("<svg") >= 8
    assert json.loads(result.to_json())["indices"][0]["factors"] == [FRICTION["name"], CUTTING["name"]]


def test_a_needle_that_bends_in_a_study_is_that_of_the_engine():
    bending = {"foundation_kPa": 50.0, "bevel_half_angle_deg": 20.0, "target_mm": [0.0, 0.0, 15.0]}
    question = asked(
        {"method": "grid"},
        factor=[{"name": "bending.foundation_kPa", "distribution": "choices", "choices": [20.0, 80.0]}],
        motion={"depth_mm": 15.0, "withdraw": False},
        bending=bending,
        output=[{"quantity": "tip_deflection"}, {"quantity": "target_error"}],
    )
    table = nf.study(question, jobs=1).to_dataframe()
    model = nf.preset("paper")
    motion = nf.Motion.insert(-5e-3, 3e-3, 15e-3, withdraw=False)
    depth, _ = motion.at(np.arange(math.floor(motion.duration * 500.0) + 1) / 500.0)
    for foundation, deflection, error in zip((2e4, 8e4), table["tip_deflection"], table["target_error"]):
        bevel = nf.core.Bevel(half_angle=math.radians(20.0), face_share=1.0)
        engine = nf.FlexibleInsertion(model, model.needle, lateral=foundation, bevel=bevel, max_speed=math.inf)
        tip = engine.run(depth, dt=1.0 / 500.0)["tip"][np.argmax(depth)]
        assert deflection == pytest.approx(np.hypot(*tip[:2]), rel=1e-9) and deflection > 1e-6
        assert error == pytest.approx(np.linalg.norm(tip - [0.0, 0.0, 15e-3]), rel=1e-9)


def test_rest_in_a_device_is_the_proof_of_rest():
    from needleforce.control import Device, rest_in_loop
    from needleforce.control.rest import RESTS

    question = asked(
        {"method": "grid"},
        factor=[{"name": "cutting.force_N", "distribution": "choices", "choices": [0.05, 0.1]}],
        device={"mass_g": 500.0, "damping_N_s_per_m": 5.0},
        output=[{"quantity": "rests"}],
    )
    table = nf.study(question, jobs=1).to_dataframe()
    verdict = rest_in_loop(nf.preset("paper"), Device(mass=0.5, damping=5.0, stiffness=0.0, rate=1000.0)).verdict
    assert set(table["rests"]) == {float(verdict == RESTS)}


REFUSED = [
    ({"factor": [{"name": "friction.width_mm", "low": 1, "high": 2}]}, "friction.per_length_N_per_mm"),
    ({"factor": [{"name": "relaxation.time_1_s", "low": 1, "high": 2}]}, "no such value"),
    ({"factor": [FRICTION | {"low": -1.0}]}, "cannot be used"),
    ({"factor": [FRICTION | {"low": 1.0}]}, "low is not below high"),
    ({"factor": [{"name": "cutting.force_N", "distribution": "normal", "mean": 1.0}]}, "sd is None"),
    ({"factor": [FRICTION, FRICTION]}, "given twice"),
    ({"factor": []}, "none"),
    ({"factor": [{"name": "motion.depth_mm", "low": -9.0, "high": 5.0}]}, "cannot be used"),
    ({"output": [{"quantity": "tip_deflection"}]}, r"\[bending\]"),
    ({"output": [{"quantity": "force_at_depth"}]}, "depth_mm"),
    ({"output": [{"quantity": "colour"}]}, "colour"),
    ({"study": {"method": "robust"}}, "limits"),
    ({"study": {"samples": 10_000_000}}, "--yes"),
    ({"study": {"method": "guess"}}, "guess"),
    ({"posterior": True}, "fit"),
    ({"model": {"preset": "nowhere.toml"}}, "nowhere.toml"),
    ({"model": {"preset": "paper", "fit": "a.json"}}, "one of the two"),
    ({"study": {"method": "design"}}, "design"),
    ({"recordings": {}}, "folder"),
    ({"recordings": {"samples": 0}}, "samples"),
    ({"recordings": {"noise_N": -1.0}}, "noise_N"),
    ({"recordings": {"drift_N_per_s": math.inf}}, "drift"),
    ({"study": {"seed": -1}}, "seed"),
    ({"motion": []}, "motion"),
    ({"output": []}, "output"),
    ({"motion": [{"rate_hz": math.nan}]}, "rate_hz"),
    ({"output": [DEEP | {"name": "why"}]}, "name of the output"),
    ({"output": [DEEP | {"name": "../a"}]}, "name of the output"),
    ({"output": [DEEP | {"low": 2.0, "high": 1.0}]}, "low is above high"),
    ({"output": [{"quantity": "work", "depth_mm": 3.0}]}, "force_at_depth"),
    ({"output": [DEEP | {"depth_mm": 25.0}]}, "no motion reaches"),
    ({"factor": [FRICTION, {"name": "friction.per_length_N_per_m", "low": 1.0, "high": 2.0}]}, "same value"),
    ({"factor": [FRICTION, {"name": "layer_1.friction.per_length_N_per_m", "low": 1.0, "high": 2.0}]}, "same value"),
    ({"factor": [FRICTION | {"mean": 1.0}]}, "mean is given"),
    (
        {
            "factor": [
                {"name": "model.preset", "distribution": "choices", "choices": ["paper", "okamura_liver"]},
                FRICTION,
            ]
        },
        "no such value",
    ),
]


@pytest.mark.parametrize(("changes", "words"), REFUSED)
def test_a_question_that_cannot_be_answered_is_refused(changes, words):
    with pytest.raises(InputError, match=words):
        nf.study(asked(**changes) if "study" not in changes else asked() | changes, jobs=1)
