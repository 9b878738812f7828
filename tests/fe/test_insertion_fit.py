# SPDX-License-Identifier: Apache-2.0
"""Moduli from whole insertions, made on finer meshes, along paths of another spacing, and with tissue that has mass."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from closed_forms import bonded_shaft_stiffness

import needleforce as nf
from needleforce import fe
from needleforce.fe.elastic.shaft_stiffness import stiffness_by_label

RADIUS, LENGTH, DEEP = 0.35e-3, 15e-3, 22e-3
YOUNG, RATIO = 30e3, 0.49
FRICTION, CUTTING, CONTACT, OFFSET = 20.0, 0.1, 4e-3, 0.05
CYCLE = (-2e-3, 9e-3, 7e-3, 13e-3, -3e-3)  # a pull-back on the way, then out
PATH, FINE_PATH = fe.NeedlePath(LENGTH, 1e-3, RADIUS), fe.NeedlePath(LENGTH, 0.6e-3, RADIUS)
LAYERS = [("skin", 4e-3), ("fat", 1.0)]


def block(radii, cell, young=YOUNG, layers=()):
    """In a cup of some radii of the needle, of one material or one for each layer."""
    mesh = fe.axisymmetric_block(radii * RADIUS, DEEP, cell * RADIUS, needle_depth=LENGTH, layers=layers)
    moduli = young if isinstance(young, dict) else dict.fromkeys([name for name, _ in layers] or ["tissue"], young)
    materials = {name: fe.Elastic(value, RATIO) for name, value in moduli.items()}
    return fe.Tissue(mesh, materials, symmetry="axisymmetric", supports={"bottom": "fixed", "sides": "fixed"})


def laws(friction=FRICTION, cutting=CUTTING, puncture=0.1):
    if not hasattr(friction, "family"):
        friction = nf.laws.Coulomb(per_length=friction, presliding=1e-9, dimple_ratio=0.0)
    parts = nf.laws.Polynomial(linear=200.0, quadratic=0.0), nf.laws.PunctureForce(force=puncture)
    return (*parts, friction, nf.laws.ConstantCutting(force=cutting, unloading=1e-6))


def motion(stops, speed=5e-3, rate=500.0, rest=0.2):
    """Depths from stop to stop, with a rest at each."""
    parts = []
    for start, end in pairwise(stops):
        count = int(abs(end - start) / speed * rate)
        parts += [np.linspace(start, end, count + 1)[1:], np.full(int(rest * rate), end)]
    return np.concatenate(parts)


def recorded(depth, force, noise=3e-3, depth_noise=1e-6, seed=0, rate=500.0):
    """With white noise, a zero of its own and an offset."""
    random, n = np.random.default_rng(seed), len(depth)
    measured = depth + CONTACT + random.normal(0.0, depth_noise, n)
    return np.arange(n) / rate, measured, force + OFFSET + random.normal(0.0, noise, n)


def insertion(condensed, model=None, stops=CYCLE, rest=0.2, **sensors):
    depth = motion(stops, rest=rest)
    needle = fe.CondensedInsertion(condensed, model or nf.Model(*laws()))
    return recorded(depth, needle.run(depth, np.full(len(depth), 2e-3))["force"], **sensors)


def modulus(found):
    return found.young_modulus["tissue"]


@pytest.fixture(scope="module")
def true():
    """The solid that recordings are made in: cells of a quarter of the needle's radius."""
    return block(40, 0.25).condense(FINE_PATH)


@pytest.fixture(scope="module")
def specimen():
    """Its geometry, with other cells, another path and a modulus that is not known."""
    return block(40, 0.5, young=80e3)


@pytest.fixture(scope="module")
def fitted(true, specimen):
    """What is found of the recording that is made with no options."""
    return fe.fit_insertion(specimen, PATH, insertion(true))


def test_with_the_geometry_the_modulus_is_found_and_a_half_space_gives_too_much(fitted, many):
    factors = []
    narrower = [(block(radii, 0.5, 80e3), block(radii, 0.25).condense(FINE_PATH)) for radii in (10, 20)[: many(1, 2)]]
    for found in (*(fe.fit_insertion(start, PATH, insertion(solid)) for start, solid in narrower), fitted):
        assert modulus(found) == pytest.approx(YOUNG, rel=0.03)
        assert found.parameters.friction_per_length.value == pytest.approx(FRICTION, rel=0.03)
        assert found.parameters.cutting_force.value == pytest.approx(CUTTING, abs=0.01)
        assert found.parameters.force_offset.value == pytest.approx(OFFSET, abs=4e-3)
        assert found.parameters.contact_depth.value == pytest.approx(CONTACT, abs=0.2e-3)
        assert found.geometry_factor == pytest.approx(found.half_space_modulus / modulus(found))
        factors.append(found.geometry_factor)
    # the walls of the cup are taken for a stiffer tissue
    assert factors[0] > 1.6 and 1.2 < factors[-1] < 1.4
    assert all(1.4 < each < 1.6 for each in factors[1:-1])


@pytest.mark.long
def test_the_wrong_block_gives_the_wrong_modulus(true):
    found = fe.fit_insertion(block(10, 0.5), PATH, insertion(true))
    assert modulus(found) < 0.8 * YOUNG


def test_in_a_large_block_it_is_the_half_space_and_its_shaft_that_of_a_pile():
    mesh = fe.axisymmetric_block(0.15, 0.15, 0.5 * RADIUS, needle_depth=LENGTH)
    large = fe.Tissue(mesh, fe.Elastic(YOUNG, RATIO), symmetry="axisymmetric")
    start = large.with_materials(fe.Elastic(9e3, RATIO))
    found = fe.fit_insertion(start, PATH, insertion(large.condense(FINE_PATH)))
    assert modulus(found) == pytest.approx(YOUNG, rel=0.03)
    assert found.geometry_factor == pytest.approx(1.0, abs=0.01)
    pile = bonded_shaft_stiffness(fe.Elastic(YOUNG, RATIO), RADIUS, 12e-3)
    assert found.condensed.bonded_stiffness(12e-3) == pytest.approx(pile, rel=0.1)


# modulus [Pa], friction [N/m], cutting force [N]: from tissue that the tip hardly cuts to a shaft that hardly slides
ROWS = [
    (5e3, 2.0, 0.03), (8e3, 20.0, 0.1), (30e3, 20.0, 0.5), (116e3, 5.0, 0.5), (5e3, 20.0, 0.5), (8e3, 5.0, 0.1),
    (8e3, 5.0, 0.5), (30e3, 2.0, 0.03), (30e3, 5.0, 0.5), (30e3, 60.0, 0.1), (116e3, 20.0, 0.1), (116e3, 60.0, 0.5),
]  # fmt: skip


def made_of(young, friction, cutting, cell, spacing, step, **sensors):
    """In tissue of a modulus, with cells, spacing and steps of its own."""
    solid = block(40, cell).condense(fe.NeedlePath(LENGTH, spacing, RADIUS))
    rate = 5e-3 / step
    depth = motion(CYCLE, rate=rate)
    needle = fe.CondensedInsertion(
        replace(solid, compliance=YOUNG / young * solid.compliance), nf.Model(*laws(friction, cutting))
    )
    return recorded(depth, needle.run(depth, np.full(len(depth), 1.0 / rate))["force"], rate=rate, **sensors)


def test_intervals_hold_what_was_made_with_other_spacings_steps_and_cells(specimen, many):
    hits, warned = [], 0
    for row in ROWS[: many(2, len(ROWS))]:
        for cell, spacing, step in [(0.25, 0.6e-3, 10e-6), (0.35, 0.75e-3, 4e-6)][: many(1, 2)]:
            found = fe.fit_insertion(specimen, PATH, made_of(*row, cell, spacing, step))
            friction, cutting = found.parameters.friction_per_length, found.parameters.cutting_force
            ends = [
                (found.low["tissue"], found.high["tissue"]),
                *((each.low, each.high) for each in (friction, cutting)),
            ]
            hits += [low <= true <= high for true, (low, high) in zip(row, ends)]
            warned += any("times the noise" in text for text in found.warnings)
            assert found.high["tissue"] < 4.0 * found.low["tissue"]
    assert np.mean(hits) >= 0.93
    assert warned <= 0.25 * len(hits) / 3  # where friction is strong, by the spacing


@pytest.mark.long
def test_intervals_hold_the_modulus_of_each_of_many_recordings(true, specimen):
    hits = []
    for seed in range(8):
        found = fe.fit_insertion(specimen, PATH, insertion(true, noise=30e-3, depth_noise=2e-6, seed=seed))
        hits.append(found.low["tissue"] < YOUNG < found.high["tissue"])
        assert not any("times the noise" in text for text in found.warnings)
    assert sum(hits) >= 7


def test_what_the_model_has_not_is_named_with_its_place(true, specimen, many):
    time, depth, force = insertion(true)
    stiffer = OFFSET + (force - OFFSET) * (1.0 + 0.5 * np.clip((depth - CONTACT) / 13e-3, 0.0, 1.0))
    for wrong in (stiffer, force + 0.05 * time / time[-1])[: many(1, 2)]:
        found = fe.fit_insertion(specimen, PATH, (time, depth, wrong))
        assert "times the noise, most of it at " in found.warnings[0] and "wards: there the tissue" in found.warnings[0]
        assert found.warnings[0] in str(found).replace("\n    ", " ")
    noise = np.random.default_rng(1).normal(0.0, 1e-3, len(force))
    for k in range(1, len(noise)):
        noise[k] += 0.95 * noise[k - 1]
    found = fe.fit_insertion(specimen, PATH, (time, depth, force + noise))  # the sensor's own, slow
    assert not any("the tissue does" in text for text in found.warnings)


def test_tissue_with_mass_in_an_independent_simulation(specimen, many):
    # nodes that stick and slip by another algorithm, a tip that is spread over two spacings, waves
    moving = fe.TissueDynamics(block(40, 1.0), damping=fe.Rayleigh.from_ratios((10.0, 200.0), (0.05, 0.05)))
    path = fe.NeedlePath(LENGTH, 0.75e-3, RADIUS)
    reduced = fe.ReducedTissue(moving, path, modes=20)
    for speed, dt in ((50e-3, 2e-3), (5e-3, 10e-3))[: many(1, 2)]:
        needle = fe.DynamicInsertion(reduced, path, friction=FRICTION, cutting=CUTTING, dt=dt, theta=1.0)
        run = needle.run(np.concatenate([fe.stroke(b, speed, dt, start=a) for a, b in pairwise(CYCLE)]))
        time = np.arange(run.time[0], run.time[-1], 0.2 * dt)
        depth, force = np.interp(time, run.time, run.depth), np.interp(time, run.time, run.force)
        found = fe.fit_insertion(specimen, PATH, recorded(depth, force, depth_noise=0.0, rate=5.0 / dt))
        assert modulus(found) == pytest.approx(YOUNG, rel=0.06)


def test_less_friction_outwards(true, specimen):
    outwards = nf.laws.Karnopp(
        coulomb_in=20.0, coulomb_out=-14.0, viscous_in=0.0, viscous_out=0.0, static_in=20.0, static_out=-14.0
    )
    found = fe.fit_insertion(specimen, PATH, insertion(true, nf.Model(*laws(outwards))))
    assert modulus(found) == pytest.approx(YOUNG, rel=0.03)
    assert found.parameters.withdrawal_ratio.value == pytest.approx(0.7, abs=0.03)


@pytest.mark.long
def test_friction_that_falls_with_the_speed(true, specimen):
    stribeck = nf.laws.Lugre(
        bristle_stiffness=1e6, bristle_damping=0.0, viscous=200.0, coulomb=18.0, static_friction=30.0,
        stribeck_speed=2e-3, stribeck_exponent=2.0,
    )  # fmt: skip
    found = fe.fit_insertion(specimen, PATH, insertion(true, nf.Model(*laws(stribeck))))
    assert modulus(found) == pytest.approx(YOUNG, rel=0.05)


def test_a_spring_between_shaft_and_tissue(true, specimen, many):
    # in series with the tissue, which seems softer while it is not seen
    for presliding, seen in ((50e-6, False), (200e-6, True))[many(1, 0) :]:
        spring = nf.laws.Coulomb(per_length=FRICTION, presliding=presliding, dimple_ratio=0.0)
        found = fe.fit_insertion(specimen, PATH, insertion(true, nf.Model(*laws(spring))))
        assert 0.9 < modulus(found) / YOUNG < 1.02
        assert ("presliding" in found.parameters) == seen
    assert found.parameters.presliding.low < 200e-6 < found.parameters.presliding.high
    assert found.low["tissue"] < YOUNG < found.high["tissue"]


def own_insertion(solid, depth, dt, friction, cutting, share, tau):
    """Force of a needle by a scheme of its own: backward Euler for what relaxes, sets of nodes that stick or slide."""
    nodes, n = solid.nodes, len(solid.nodes)
    soft, kept = 1.0 / (1.0 - share * dt / (tau + dt)), share * tau / (tau + dt)
    tip, cut, slow, anchor, force, forces = 0.0, 0.0, np.zeros(n + 1), np.full(n, np.nan), np.zeros(n + 1), []
    for now in depth:
        for _ in range(4):
            hats = np.maximum(1.0 - np.abs(nodes - tip) / solid.spacing, 0.0)
            to_tip = solid.compliance @ hats
            table = np.block([[solid.compliance, to_tip[:, None]], [to_tip, np.diagonal(solid.compliance) @ hats]])
            middles = tip * (np.arange(200) + 0.5) / 200
            length = np.maximum(1.0 - np.abs(np.subtract.outer(nodes, middles)) / solid.spacing, 0.0).mean(axis=1) * tip
            anchor = np.where(np.isnan(anchor) & (length > 0.0), now, anchor)
            most = np.append(friction * length, cutting if tip >= cut else 0.0)
            least, used = np.append(-friction * length, 0.0), most > friction * 1e-9
            goal, offset = now - np.append(np.nan_to_num(anchor), tip), soft * kept * slow
            force, free = np.where(used, np.clip(force, least, most), 0.0), used.copy()
            for _ in range(40):
                gap, some = goal - offset - soft * table @ np.where(free, 0.0, force), np.flatnonzero(free)
                force[some] = np.linalg.solve(soft * table[np.ix_(some, some)], gap[some])
                out = free & ((force > most) | (force < least))
                force = np.clip(force, least, most)
                slip = goal - offset - soft * table @ force
                back = used & ~free & (((force >= most) & (slip < -1e-12)) | ((force <= least) & (slip > 1e-12)))
                if not (out.any() or back.any()):
                    break
                free = (free & ~out) | back
            moved = offset + soft * table @ force
            farthest = nodes[-1] if force[n] > 0.0 else tip if used[n] else cut
            to = tip if free[n] else np.clip(now - moved[n], 0.0, farthest)
            tip, cut, stays = to, max(cut, to), abs(to - tip) < 1e-9
            if stays:
                break
        anchor = np.where(used[:n] & ~free[:n], now - moved[:n], np.where(length > 1e-9, anchor, np.nan))
        slow = (tau * slow + dt * moved) / (tau + dt)
        forces.append(force.sum())
    return np.array(forces)


def test_what_relaxes_is_found_where_the_needle_rests(true, specimen):
    share, tau, dt = 0.4, 0.8, 10e-3
    ways = [np.linspace(a, b, int(abs(b - a) / 50e-6) + 1)[1:] for a, b in pairwise(CYCLE)]
    depth = np.concatenate([np.append(way, np.full(200, way[-1])) for way in ways])
    force = own_insertion(true, depth, dt, FRICTION, CUTTING, share, tau)
    found = fe.fit_insertion(specimen, PATH, recorded(depth, force, rate=1.0 / dt))
    assert modulus(found) == pytest.approx(YOUNG, rel=0.06) and found.low["tissue"] < YOUNG < found.high["tissue"]
    parameters = found.parameters
    for name, value in {"relaxation_share_1": share, "relaxation_time_1": tau, "friction_per_length": FRICTION}.items():
        assert parameters[name].low < value < parameters[name].high
    assert parameters.relaxation_share_1.value == pytest.approx(share, abs=0.05)
    run = fe.CondensedInsertion(found.condensed, found.model).run(depth, np.full(len(depth), dt))
    assert np.std(run["force"] - force) < 0.03 * np.ptp(force)


def test_what_a_motion_does_not_show_of_relaxation_is_said(true, specimen):
    for rest, seen in ((0.0, False), (3.0, True)):
        found = fe.fit_insertion(specimen, PATH, insertion(true, stops=(-2e-3, 13e-3, 8e-3), rest=rest))
        share = found.parameters.relaxation_share_1
        assert share.low == 0.0 and share.identifiable == seen
    assert share.high < 0.2


@pytest.mark.parametrize("depth_noise", [pytest.param(0.0, marks=pytest.mark.long), 50e-6])
def test_noise_of_the_depth(true, specimen, depth_noise):
    found = fe.fit_insertion(specimen, PATH, insertion(true, depth_noise=depth_noise))
    assert modulus(found) == pytest.approx(YOUNG, rel=0.03)


def test_stiff_tissue_is_found_until_the_depth_does_not_resolve_how_far_the_shaft_sticks(true, specimen):
    found = fe.fit_insertion(specimen, PATH, insertion(replace(true, compliance=YOUNG / 1e6 * true.compliance)))
    assert modulus(found) == pytest.approx(1e6, rel=0.04)
    rigid = replace(true, compliance=YOUNG / 30e6 * true.compliance)
    with pytest.raises(nf.InputError, match=r"shaft sticks is .* um, the depth resolves .*too stiff.*Record slower"):
        fe.fit_insertion(specimen, PATH, insertion(rigid))


def test_a_pull_back_is_enough_and_a_small_one_is_refused(true, specimen):
    found = fe.fit_insertion(specimen, PATH, insertion(true, stops=(-2e-3, 13e-3, 11.5e-3)))
    assert modulus(found) == pytest.approx(YOUNG, rel=0.04)
    assert not found.parameters.withdrawal_ratio.high < 1.2  # it never slides outwards
    with pytest.raises(nf.InputError, match=r"longest reversal is 0.3\d* mm, the shaft sticks for .* mm.*Pull back by"):
        fe.fit_insertion(specimen, PATH, insertion(true, stops=(-2e-3, 13e-3, 12.7e-3)))


def test_moduli_friction_and_cutting_of_two_layers():
    moduli = {"skin": 60e3, "fat": 20e3}
    upper, lower = laws(30.0, 0.12), nf.Layer(4e-3, *laws(15.0, 0.06, puncture=0.0))
    recording = insertion(block(40, 0.25, moduli, LAYERS).condense(FINE_PATH), nf.Model(*upper, deeper=(lower,)))
    start = block(40, 0.5, 40e3, LAYERS)
    found = fe.fit_insertion(start, PATH, recording, labels=("skin", "fat"))
    for name, value, friction in (("skin", 60e3, 30.0), ("fat", 20e3, 15.0)):
        assert found.young_modulus[name] == pytest.approx(value, rel=0.08)
        assert 0.96 * found.low[name] < value < 1.04 * found.high[name]
        assert found.parameters[f"{name}_friction_per_length"].value == pytest.approx(friction, rel=0.04)
    assert found.parameters.fat_cutting_force.value == pytest.approx(0.06, abs=0.01)
    uniform = fe.fit_insertion(start, PATH, recording)
    assert 20e3 < uniform.young_modulus["fat"] < 60e3 and "times the noise" in uniform.warnings[0]
    with pytest.raises(nf.InputError, match=r"label is bone, the mesh has \['fat', 'skin'\]"):
        fe.fit_insertion(start, PATH, recording, labels=("bone",))


def test_shares_of_labels_are_the_change_of_a_tissue_that_is_condensed_again():
    moduli = {"skin": 60e3, "fat": 20e3}
    tissue = block(20, 1.0, moduli, LAYERS)
    solid = stiffness_by_label(tissue, PATH, ("skin",))
    np.testing.assert_allclose(solid.compliance(np.zeros(1)), solid.condensed.compliance, rtol=1e-6)
    for step, error in ((1e-3, 1e-5), (0.1, 5e-3)):
        other = block(20, 1.0, {"skin": 60e3 * np.exp(step), "fat": 20e3}, LAYERS).condense(PATH).compliance
        np.testing.assert_allclose(solid.compliance(np.array([step])), other, rtol=error)
    both = stiffness_by_label(tissue, PATH, ("skin", "fat")).compliance(np.log([3.0, 3.0]))
    np.testing.assert_allclose(both, solid.condensed.compliance / 3.0, rtol=1e-6)


def test_a_recording_and_given_events_are_taken_and_the_result_runs_in_the_loop(true, specimen, fitted):
    time, depth, force = insertion(true)
    recording = nf.Recording(time=time, depth=depth, force=force)
    given = fe.fit_insertion(specimen, PATH, recording, contact_depth=CONTACT, puncture_depth=7e-3)
    assert modulus(given) == pytest.approx(modulus(fitted), rel=0.02)
    run = fe.CondensedInsertion(fitted.condensed, fitted.model).run(motion(CYCLE), np.full(len(depth), 2e-3))
    late = depth > 9e-3 + CONTACT
    assert np.std(run["force"][late] + OFFSET - force[late]) < 6e-3


def test_recordings_that_show_no_modulus_are_named(true, specimen):
    time, depth, force = insertion(true)
    broken = force.copy()
    broken[7] = np.nan
    for recording, words in (
        ((time, depth, force[:-1]), "shape of force"),
        ((time, depth, broken), "force is nan at sample 7, must be finite"),
        ((time, np.full_like(depth, 5e-3), force), "travel of the needle is 0 mm, must be more than 3 mm"),
        ((time, 2.0 * depth, force), r"depth of the path is 15 mm, the needle goes .* mm deep. Give a path of"),
        ((time, depth, np.zeros_like(force)), "contact is not found"),
        (insertion(true, stops=(-2e-3, 13e-3)), "number of reversals in the tissue is 0"),
    ):
        with pytest.raises(nf.InputError, match=words):
            fe.fit_insertion(specimen, PATH, recording)
    with pytest.raises(nf.InputError, match="contact_depth is 90 mm, is outside the recorded depths"):
        fe.fit_insertion(specimen, PATH, (time, depth, force), contact_depth=90e-3)
    with pytest.raises(nf.InputError, match=r"travel after the breakthrough is .* means, at least 10"):
        fe.fit_insertion(specimen, PATH, (time, depth, force), puncture_depth=16.5e-3)


def test_wrong_kinds_of_choices_are_named():
    mesh = fe.axisymmetric_block(10e-3, 20e-3, 0.5e-3, needle_depth=10e-3)
    tissue = fe.Tissue(mesh, fe.Elastic(20e3), symmetry="axisymmetric")
    path, curve = fe.NeedlePath(10e-3, 1e-3, 0.35e-3), (np.arange(3.0), np.arange(3.0), np.arange(3.0))
    for wrong, message in (
        ({"labels": ["tissue", "tissue"]}, "each once"),
        ({"labels": "tissue"}, "must be names"),
        ({"contact_depth": "0"}, "contact_depth is '0', not a finite"),
        ({"contact_depth": 1e-3, "puncture_depth": 0.5e-3}, "must not be above the contact"),
    ):
        with pytest.raises(nf.InputError, match=message):
            fe.fit_insertion(tissue, path, curve, **wrong)
    with pytest.raises(nf.InputError, match="tissue is NoneType, not a Tissue"):
        fe.fit_insertion(None, path, curve)
