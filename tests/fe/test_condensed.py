# SPDX-License-Identifier: Apache-2.0
"""Condensed solids: against the full solution, the axial law, an independent minimisation, and energy."""

import re
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import lsq_linear

import needleforce as nf
from needleforce import fe

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import reference

RADIUS, LENGTH = 0.35e-3, 40e-3
FRICTION, CUTTING = 20.0, 0.1  # N/m, N


def model(friction=FRICTION, cutting=CUTTING, puncture=0.2, presliding=1e-6, **more):
    return nf.Model(
        nf.laws.Polynomial(linear=100.0, quadratic=0.0),
        nf.laws.PunctureForce(force=puncture),
        nf.laws.Coulomb(per_length=friction, presliding=presliding, dimple_ratio=0.0),
        nf.laws.ConstantCutting(force=cutting, unloading=1e-6),
        **more,
    )


def solid(young=60e3, cell=RADIUS):
    mesh = fe.axisymmetric_block(50e-3, 60e-3, cell, needle_depth=LENGTH)
    held = {"bottom": "fixed", "sides": "fixed"}
    return fe.Tissue(mesh, fe.Elastic(young, 0.45), symmetry="axisymmetric", supports=held)


@pytest.fixture(scope="module")
def gel():
    return solid().condense(fe.NeedlePath(LENGTH, 1e-3, RADIUS))


def moved(insertion, depths, step=5e-6, rate=1e3):
    """The samples at each of some depths, on the way from one to the next in steps."""
    at, found = depths[0], []
    for depth in depths:
        count = max(int(np.ceil(abs(depth - at) / step)), 1)
        for each in np.linspace(at, depth, count + 1)[1:]:
            sample = insertion.step(float(each), None, 1.0 / rate)
        found.append(sample)
        at = depth
    return found


def test_the_table_is_what_the_full_solution_gives():
    tissue, path = solid(cell=2 * RADIUS), fe.NeedlePath(LENGTH, 2e-3, RADIUS)
    found, loads = tissue.condense(path), path.loads(tissue).toarray()
    forces = np.random.default_rng(0).normal(size=len(path.nodes))
    displaced = loads.T @ tissue.solve(loads @ forces)
    np.testing.assert_allclose(found.displacement(forces), displaced, rtol=1e-9)


def test_condensed_stiffness_is_the_schur_complement():
    # on a small mesh, by dense algebra: the stiffness that is left when all but the path is eliminated
    mesh = fe.axisymmetric_block(6e-3, 6e-3, 1e-3, needle_depth=4e-3)
    tissue = fe.Tissue(mesh, fe.Elastic(10e3, 0.3), symmetry="axisymmetric")
    loads = fe.NeedlePath(4e-3, 1e-3, RADIUS).loads(tissue).toarray()[~tissue.held]
    stiffness = tissue.stiffness[~tissue.held][:, ~tissue.held].toarray()
    orthogonal, upper = np.linalg.qr(loads, mode="complete")
    n = loads.shape[1]
    turned = orthogonal.T @ stiffness @ orthogonal
    left = turned[:n, :n] - turned[:n, n:] @ np.linalg.solve(turned[n:, n:], turned[n:, :n])
    expected = upper[:n].T @ np.linalg.solve(left, upper[:n])
    found = tissue.condense(fe.NeedlePath(4e-3, 1e-3, RADIUS)).compliance
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_a_chain_of_springs_has_its_reference_stiffness():
    value = next(each for each in reference.load() if each["name"] == "condensed_spring_chain")
    compliance = np.cumsum(1.0 / np.array(value["inputs"]["k"]))[::-1]  # of each joint, from the free end
    table = np.minimum.outer(compliance, compliance)
    assert fe.CondensedTissue(1e-3, table).displacement([1.0, 0.0, 0.0])[0] == pytest.approx(
        1.0 / value["expected"], rel=1e-12
    )


def test_the_axial_law_is_met_where_the_tissue_does_not_give(gel):
    stiff = replace(gel, compliance=1e-7 * gel.compliance)
    depths = [-1e-3, 1e-3, 1.9e-3, 10e-3, 25e-3, 24e-3, 30e-3, 35e-3, 20e-3, 5e-3, 1e-3, -1e-3]
    condensed, axial = moved(fe.CondensedInsertion(stiff, model()), depths), moved(nf.Insertion(model()), depths)
    for one, other in zip(condensed, axial):
        for part in ("force", "friction", "cutting", "stiffness"):
            assert getattr(one, part) == pytest.approx(getattr(other, part), abs=2e-4), (one.depth, part)


def test_friction_while_sliding_is_per_length_of_the_tissue_along_the_shaft(gel):
    insertion = fe.CondensedInsertion(gel, model())
    for depth in (10e-3, 20e-3, 30e-3):
        sample = moved(insertion, [insertion.tip, depth])[-1]
        assert sample.friction == pytest.approx(FRICTION * insertion.tip, rel=1e-3)
        assert sample.cutting == pytest.approx(CUTTING, rel=1e-3)
        # the tip is where tissue and needle are: its place in the tissue and what it was displaced by there
        nodes = gel.nodes
        at = np.interp(insertion.tip, nodes, insertion.displacement)
        assert insertion.tip + at == pytest.approx(depth, abs=2e-4) and insertion.tip < depth


def balanced(compliance, wanted, bounds):
    """Forces within bounds whose energy minus work is smallest, by another algorithm: bounded least squares."""
    root = np.linalg.cholesky(compliance)
    return lsq_linear(root.T, np.linalg.solve(root, wanted), bounds=(-bounds, bounds), tol=1e-14, method="bvls").x


@pytest.mark.parametrize("back", [0.02e-3, 0.05e-3, 0.1e-3, 0.2e-3])
@pytest.mark.parametrize("step", [5e-6, 20e-6])
def test_stick_and_slip_on_the_way_back_are_those_of_a_minimisation(gel, back, step):
    soft = replace(gel, compliance=3.0 * gel.compliance)
    insertion = fe.CondensedInsertion(soft, model(cutting=0.0, puncture=0.0, presliding=1e-9))
    moved(insertion, [-1e-3, 30e-3], step)
    saturated, pulled = insertion.shaft_force, insertion.displacement
    tip = insertion.tip
    first = moved(insertion, [30e-3, 30e-3 - back], step)[-1]
    for _ in range(5):  # a step does eight sweeps at most: at a sudden reversal it is within a percent, then exact
        sample = insertion.step(30e-3 - back, None, 1e-3)
    bounds = np.abs(saturated)
    here = bounds > 0.0
    expected = balanced(soft.compliance[np.ix_(here, here)], pulled[here] - back, bounds[here])
    assert insertion.tip == pytest.approx(tip, abs=1e-6)  # it sticks, so that the path is as long as before
    np.testing.assert_allclose(insertion.shaft_force[here], expected, atol=1e-3 * bounds.max())
    assert sample.friction == pytest.approx(expected.sum(), abs=1e-4 * bounds.sum())
    assert first.friction == pytest.approx(expected.sum(), abs=1e-2 * bounds.sum())


def test_the_force_does_not_depend_on_the_length_of_the_steps(gel):
    depths = [-1e-3, 15e-3, 30e-3, 29.8e-3, 29.5e-3, 32e-3, 31e-3, 20e-3, 5e-3]
    fine = [each.force for each in moved(fe.CondensedInsertion(gel, model(), max_speed=10.0), depths, 2e-6)]
    for step, error in ((5e-6, 1e-3), (50e-6, 2e-3), (0.5e-3, 5e-3)):
        coarse = [each.force for each in moved(fe.CondensedInsertion(gel, model(), max_speed=10.0), depths, step)]
        np.testing.assert_allclose(coarse, fine, atol=error * max(fine))


def test_no_motion_returns_energy(gel):
    soft, rng = replace(gel, compliance=2.0 * gel.compliance), np.random.default_rng(3)
    for number in range(8):
        insertion = fe.CondensedInsertion(soft, model(puncture=0.1 * (number % 2)))
        turns = np.concatenate([[-1e-3], rng.uniform(-2e-3, 35e-3, 12), [-5e-3]])
        path = np.concatenate([np.linspace(a, b, 400) for a, b in pairwise(turns)])
        force = insertion.run(path, np.full(len(path), 1e-2))["force"]
        work = np.concatenate([[0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(path))])
        assert work[-1] > 0.0 and work.min() > -1e-6


def test_tissue_is_pulled_up_before_the_needle_leaves(gel):
    soft = replace(gel, compliance=5.0 * gel.compliance)
    insertion = fe.CondensedInsertion(soft, model())
    moved(insertion, [-1e-3, 20e-3])
    assert insertion.displacement[0] > 0.0
    moved(insertion, [20e-3, 5e-3])
    assert insertion.displacement[0] < -1e-4  # the surface
    samples = moved(insertion, np.arange(5e-3, -5e-3, -1e-5), 2e-5)
    left = next(sample.depth for sample in samples if sample.exit)
    assert -3e-3 < left < -2e-5 and samples[-1].force == 0.0
    assert np.all(insertion.shaft_force == 0.0) and np.abs(insertion.displacement).max() < 1e-9


def test_each_layer_has_its_friction_and_cutting(gel):
    second = nf.Layer(
        top=15e-3,
        stiffness=nf.laws.Polynomial(linear=100.0, quadratic=0.0), puncture=nf.laws.PunctureForce(force=0.3),
        friction=nf.laws.Coulomb(per_length=60.0, presliding=1e-6, dimple_ratio=0.0),
        cutting=nf.laws.ConstantCutting(force=0.25, unloading=1e-6),
    )  # fmt: skip
    insertion = fe.CondensedInsertion(gel, model(deeper=(second,)))
    samples = moved(insertion, np.arange(-1e-3, 35e-3, 1e-5), 2e-5)
    punctures = [(sample.depth, sample.force) for sample in samples if sample.punctured]
    assert len(punctures) == 2 and 15e-3 < punctures[1][0] < 20e-3
    tip = insertion.tip
    assert samples[-1].friction == pytest.approx(FRICTION * 15e-3 + 60.0 * (tip - 15e-3), rel=0.02)
    assert samples[-1].cutting == pytest.approx(0.25, rel=1e-3)
    # between touching the interface and breaking through, the tip bears no less than it did in the layer above
    second_puncture = next(k for k, sample in enumerate(samples) if sample.depth == punctures[1][0])
    bearing = [sample.stiffness + sample.cutting for sample in samples[:second_puncture] if sample.depth > 10e-3]
    assert min(bearing) > 0.999 * CUTTING
    peak = max(sample.stiffness for sample in samples if sample.depth > 15e-3)
    assert peak == pytest.approx(0.3, rel=0.02)


@pytest.mark.parametrize("stiffness", [30.0, 300.0, 1000.0])
@pytest.mark.parametrize("softer", [1.0, 6.0])
def test_a_contact_that_is_stiffer_than_the_solid_has_a_balance(gel, stiffness, softer):
    # two springs side by side that are each stiffer alone than together would have none: force went back and forth
    soft = replace(gel, compliance=softer * gel.compliance)
    laws = {
        "stiffness": nf.laws.Polynomial(linear=stiffness, quadratic=0.0), "puncture": nf.laws.PunctureForce(force=0.3),
        "friction": nf.laws.Coulomb(per_length=20.0, presliding=1e-6, dimple_ratio=0.0),
        "cutting": nf.laws.ConstantCutting(force=0.05, unloading=1e-6),
    }  # fmt: skip
    insertion = fe.CondensedInsertion(soft, nf.Model(**laws, deeper=(nf.Layer(top=15e-3, **laws),)))
    samples = [insertion.step(float(depth), None, 1e-3) for depth in np.arange(-1e-3, 35e-3, 20e-6)]
    assert max(sample.stiffness + sample.cutting for sample in samples) <= 0.3 * (1.0 + 1e-6)
    assert [sum(getattr(each, event) for each in samples) for event in ("contact", "punctured", "exit")] == [1, 2, 0]
    held = [insertion.step(samples[-1].depth, None, 1e-3).force for _ in range(40)]
    assert np.ptp(held[10:]) < 1e-3


@pytest.mark.parametrize("softer", [1.0, 6.0])
@pytest.mark.parametrize("step", [5e-6, 20e-6, 50e-6])
def test_friction_stays_within_what_the_covered_shaft_bears(gel, softer, step):
    insertion = fe.CondensedInsertion(
        replace(gel, compliance=softer * gel.compliance), model(cutting=0.0, puncture=0.0)
    )
    events = np.zeros(3, dtype=int)
    for depth in np.concatenate([np.arange(-1e-3, 28e-3, step), np.arange(28e-3, -6e-3, -step)]):
        sample = insertion.step(float(depth), None, 1e-3)
        assert abs(sample.friction) <= FRICTION * insertion.tip + 1e-9
        assert sample.phase != "free" or sample.force == 0.0
        events += [sample.contact, sample.punctured, sample.exit]
    assert list(events) == [1, 1, 1]


def test_a_first_step_in_the_tissue_finds_the_needle_there(gel):
    insertion = fe.CondensedInsertion(gel, model())
    sample = insertion.step(20e-3, None, 1e-3)
    assert sample.force == 0.0 and insertion.tip == 20e-3 and sample.phase == "hold"


def test_a_layer_thinner_than_a_spacing_has_its_friction(gel):
    thin = nf.Layer(
        top=10.2e-3, stiffness=nf.laws.Polynomial(linear=100.0, quadratic=0.0),
        puncture=nf.laws.PunctureForce(force=0.0), friction=nf.laws.Coulomb(per_length=500.0, presliding=1e-6),
        cutting=nf.laws.ConstantCutting(force=0.1, unloading=1e-6),
    )  # fmt: skip
    below = replace(thin, top=10.5e-3, friction=nf.laws.Coulomb(per_length=FRICTION, presliding=1e-6))
    insertion = fe.CondensedInsertion(gel, model(deeper=(thin, below)))
    sample = moved(insertion, [-1e-3, 25e-3])[-1]
    assert sample.friction == pytest.approx(FRICTION * (insertion.tip - 0.3e-3) + 500.0 * 0.3e-3, rel=2e-3)


def test_a_tiny_step_does_not_disturb_the_next(gel):
    forces = []
    for tiny in (0.0, 1e-11, 1e-9):
        insertion = fe.CondensedInsertion(gel, model(), max_speed=10.0)
        moved(insertion, [-1e-3, 20e-3])
        insertion.step(19e-3, None, 1e-3)
        insertion.step(19e-3 + tiny, None, 1e-3)
        forces.append([insertion.step(19e-3 - 20e-6 * k, None, 1e-3).force for k in range(1, 10)])
    np.testing.assert_allclose(forces[1], forces[0], atol=2e-4)
    np.testing.assert_allclose(forces[2], forces[0], atol=2e-4)


def test_a_state_is_copied_saved_and_restored(gel):
    insertion = fe.CondensedInsertion(gel, model())
    moved(insertion, [-1e-3, 20e-3, 19e-3])
    copy, saved = insertion.snapshot(), insertion.save()
    ahead = [each.force for each in moved(insertion, [19e-3, 22e-3, 10e-3])]
    assert [each.force for each in moved(copy, [19e-3, 22e-3, 10e-3])] == ahead
    insertion.restore(saved)
    assert [each.force for each in moved(insertion, [19e-3, 22e-3, 10e-3])] == ahead
    other = fe.CondensedInsertion(replace(gel, compliance=1.01 * gel.compliance), model())
    altered = bytearray(saved)
    altered[100] ^= 1
    for insertion, state in ((other, saved), (copy, bytes(altered)), (copy, saved[:-8])):
        with pytest.raises(nf.InputError, match="snapshot"):
            insertion.restore(state)


def test_input_that_no_sensor_should_give_is_refused_and_changes_nothing(gel):
    insertion = fe.CondensedInsertion(gel, model())
    moved(insertion, [-1e-3, 20e-3])
    before = insertion.save()
    for depth, dt, status in (
        (np.nan, 1e-3, "not_finite"), (20e-3, np.inf, "not_finite"), (20e-3, -1.0, "outside_range"),
        (39e-3, 1e-3, "outside_range"), (2.0, 1.0, "outside_range"), (41e-3, 1e9, "outside_range"),
    ):  # fmt: skip
        sample = insertion.step(depth, None, dt)
        assert sample.status == status and sample.force == 0.0
    fresh = fe.CondensedInsertion(gel, model())
    fresh.restore(before)
    assert insertion.tip == fresh.tip and np.array_equal(insertion.shaft_force, fresh.shaft_force)


def test_a_file_keeps_the_table_and_its_origin(gel, tmp_path):
    path = tmp_path / "gel.toml"
    gel.save(path)
    found = fe.load_condensed(path)
    assert np.array_equal(found.compliance, gel.compliance) and found.spacing == gel.spacing
    assert found.fingerprint == gel.fingerprint and found.unknowns == gel.unknowns and found.summary == gel.summary
    assert solid(61e3).condense(fe.NeedlePath(LENGTH, 1e-3, RADIUS)).fingerprint != gel.fingerprint


HEAD = 'condensed_tissue = "a"\nspacing = 1e-3\nradius = 0.0\nfingerprint = ""\nunknowns = 1\ncompliance = '


@pytest.mark.parametrize(
    "text, words",
    [
        ("", "missing required field"),
        ("nonsense", "condensed tissue"),
        (HEAD + "[[1.0]]", "2 to 64"),
        (HEAD + "[[1.0, 2.0], [2.0]]", "square"),
        (HEAD + "[[1.0, 2.0], [2.0, 1.0]]", "not positive definite"),
        (HEAD + "[[1.0, 0.2], [0.3, 1.0]]", "not symmetric"),
    ],
)
def test_files_that_are_no_condensed_tissue_are_refused(tmp_path, text, words):
    path = tmp_path / "wrong.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(nf.InputError, match=words) as caught:
        fe.load_condensed(path)
    assert str(path) in str(caught.value)


def test_paths_and_models_that_do_not_fit_are_named(gel):
    with pytest.raises(nf.InputError, match=r"is 81, must be at most 64. Use a spacing of at least 0.635"):
        solid().condense(fe.NeedlePath(LENGTH, 0.5e-3, RADIUS))
    with pytest.raises(nf.InputError, match=r"spacing of the path is 0.645 mm, is finer than the mesh.*smaller cells"):
        solid(cell=20 * RADIUS).condense(fe.NeedlePath(LENGTH, LENGTH / 62, RADIUS))
    with pytest.raises(nf.InputError, match="not a Model"):
        fe.CondensedInsertion(gel, "paper")
    relaxing = replace(model(), relaxation=nf.laws.PronyAtRest(share_1=0.5, time_1=1.0))
    with pytest.raises(nf.InputError, match=r"relaxes.*Use coulomb, karnopp or lugre"):
        fe.CondensedInsertion(gel, relaxing)


def test_less_shaft_is_embedded_where_the_tissue_is_dragged_along(gel):
    engines = nf.Insertion(model()), fe.CondensedInsertion(gel, model())
    axial, soft = (moved(each, [-1e-3, 35e-3])[-1].force for each in engines)
    assert len(gel.compliance) == 41 and 0.85 * axial < soft < axial


def test_a_simulated_recording_in_a_solid_is_that_of_its_engine_and_identified():
    apart = np.abs(np.subtract.outer(np.arange(31), np.arange(31)))
    tissue = fe.CondensedTissue(1e-3, 2e-3 * np.exp(-0.25 * apart), summary="a table")
    motion = nf.Motion.insert(start=-2e-3, speed=5e-3, depth=25e-3, hold=0.5, withdraw=True)
    recording = nf.simulate(nf.preset("paper"), motion, tissue=tissue)
    engine = fe.CondensedInsertion(tissue, nf.preset("paper"))
    alone = engine.run(recording.depth, np.full(len(recording.depth), 1e-3))
    np.testing.assert_array_equal(recording.force, alone["force"])
    assert recording.card.tissue == "solid: a table" and recording.notes == ()
    fit = nf.identify(recording)
    assert fit.parameters["friction_per_length"].value == pytest.approx(nf.preset("paper").friction.per_length, rel=0.1)
    deep = nf.Motion.insert(start=-2e-3, speed=5e-3, depth=35e-3)
    assert nf.simulate(nf.preset("paper"), deep, tissue=tissue).notes[0].kind == "outside_range"
    with pytest.raises(nf.InputError, match="not a CondensedTissue"):
        nf.simulate(nf.preset("paper"), motion, tissue="cup.toml")


def test_a_contact_law_that_is_stiffer_than_the_solid_is_named():
    apart = np.abs(np.subtract.outer(np.arange(31), np.arange(31)))
    soft, firm = (fe.CondensedTissue(1e-3, scale * np.exp(-0.25 * apart)) for scale in (2e-2, 1e-3))
    model = nf.preset("paper")
    depth, force = fe.CondensedInsertion(soft, model).puncture
    [sentence] = fe.CondensedInsertion(soft, model).warnings
    assert f"{1e3 * 2e-2 * force:.3g} mm down where the tip is {1e3 * depth:.3g} mm deep" in sentence
    assert fe.CondensedInsertion(firm, model).warnings == ()
    recording = nf.simulate(model, nf.Motion.insert(start=-1e-3, speed=5e-3, depth=5e-3), tissue=soft)
    assert sentence in recording.card.assumptions


def test_tissue_that_cutting_displaces_by_spacings_is_named_with_the_spacing_to_take(gel):
    assert fe.CondensedInsertion(replace(gel, compliance=3.0 * gel.compliance), model(puncture=0.0)).warnings == ()
    soft = replace(gel, compliance=5.0 * gel.compliance)  # 12 kPa
    [sentence] = fe.CondensedInsertion(soft, model(puncture=0.0)).warnings
    displaced = CUTTING * soft.compliance[20, 20]
    assert f"by {1e3 * displaced:.3g} mm, {displaced / 1e-3:.2g} spacings" in sentence
    said = re.search(r"by up to (\d+) %. Condense with a spacing of ([\d.]+) mm or more", sentence)
    assert float(said[2]) == pytest.approx(500.0 * displaced, rel=1e-2)
    depths, bare = [-1e-3, 5e-3, 10e-3, 20e-3, 19e-3, 15e-3, 25e-3], model(puncture=0.0)
    fine, coarse = (
        np.array([each.force for each in moved(fe.CondensedInsertion(soft, bare, max_speed=10.0), depths, step)])
        for step in (5e-6, 0.5e-3)
    )
    assert np.abs(coarse - fine).max() < 0.01 * float(said[1]) * fine.max()


def layered(thickness, cell):
    parts = [("film", thickness), ("fat", 1.0)]
    mesh = fe.axisymmetric_block(10e-3, 20e-3, cell, needle_depth=10e-3, layers=parts)
    return fe.Tissue(mesh, {"film": fe.Elastic(80e3), "fat": fe.Elastic(20e3)}, symmetry="axisymmetric")


def test_a_layer_that_is_thinner_than_the_needle_is_named():
    tissue = layered(0.6e-3, 0.2e-3)
    tissue.condense(fe.NeedlePath(10e-3, 1e-3, 0.25e-3))
    message = r"layer 'film' is at 0 mm, 0.6 mm thick, is thinner than the needle, 0.7 mm"
    with pytest.raises(nf.InputError, match=message):
        tissue.condense(fe.NeedlePath(10e-3, 1e-3, 0.35e-3))
    layered(0.7e-3, 0.35e-3).condense(fe.NeedlePath(10e-3, 1e-3, 0.35e-3))  # as thick as the needle
