# SPDX-License-Identifier: Apache-2.0
"""Many insertions at a time have the values of single ones."""

import numpy as np
import pytest

import needleforce as nf
from needleforce import core

FIELDS = (
    "depth", "velocity", "force", "stiffness", "friction", "cutting", "lateral", "force_by_depth", "force_by_velocity",
    "contact", "punctured", "exit",
)  # fmt: skip
PAPER = nf.preset("paper")


def deeper(top, puncture, **changed):
    """The paper's tissue again, from a depth on."""
    laws = {"stiffness": PAPER.stiffness, "friction": PAPER.friction, "cutting": PAPER.cutting, **changed}
    return nf.Layer(top=top, puncture=nf.laws.PunctureDepth(puncture), **laws)


SOFTER = nf.laws.Coulomb(per_length=9.0, presliding=1e-3, dimple_ratio=0.5)
# the third layer continues the second without an interface; in the last nothing is cut
STACK = PAPER.replace(
    deeper=(
        deeper(4e-3, 1e-3, friction=SOFTER),
        deeper(6e-3, 0.0, friction=SOFTER),
        deeper(8e-3, 2e-3, cutting=nf.laws.NoCutting()),
    )
)
MODELS = {name: nf.preset(name) for name in ("paper", "physical", "maurin", "layered", "lugre", "relaxing")}
MODELS["stack"] = STACK
BEVEL = core.Bevel(half_angle=0.35, friction_coefficient=0.1, face_share=0.5)


def motions(steps, n, seed):
    """In, out, at rest and again, each member at its own speed, with a leap and numbers that are none."""
    rng = np.random.default_rng(seed)
    legs = rng.choice([-6e-3, -1e-3, 0.0, 4e-3, 8e-3], (steps // 300 + 1, n), p=[0.15, 0.1, 0.15, 0.3, 0.3])
    speeds = np.repeat(legs, 300, axis=0)[:steps] * rng.uniform(0.5, 1.5, (steps, n))
    depths = np.cumsum(speeds, axis=0) * 1e-3 - 1e-3
    depths[rng.integers(1, steps, n), np.arange(n)] = rng.choice([np.nan, np.inf, 0.5, 2.0], n)
    return depths


def singles(models, n, **options):
    each = models if isinstance(models, list) else [models] * n
    return [nf.Insertion(model, **options) for model in each]


def as_single(batch, engines, depths, velocities, dt):
    """Steps both; each field of each step must be the same to the last bit."""
    names = [phase.value for phase in nf.Phase], [status.value for status in nf.Status]
    for row, z in enumerate(depths):
        v = None if velocities is None else velocities[row]
        many = batch.step(z, v, dt)
        alone = [engine.step(z[i], None if v is None else v[i], dt) for i, engine in enumerate(engines)]
        for field in FIELDS:
            np.testing.assert_array_equal(getattr(many, field), [getattr(s, field) for s in alone], f"{field}, {row}")
        assert [names[0][k] for k in many.phase] == [s.phase for s in alone], row
        assert [names[1][k] for k in many.status] == [s.status for s in alone], row


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("measured", [False, True])
def test_values_are_those_of_single_insertions(name, measured):
    model, n, depths = MODELS[name], 13, motions(1500, 13, 3)
    speeds = np.gradient(np.nan_to_num(depths, posinf=0.0), 1e-3, axis=0) if measured else None
    batch = nf.InsertionBatch(model, n, bevel=BEVEL)
    as_single(batch, singles(model, n, bevel=BEVEL), depths, speeds, 1e-3)


def test_each_member_may_have_a_model_of_its_own():
    soft, stiff = (nf.preset("paper"), nf.preset("paper_116"))
    models = [soft, stiff, soft, stiff, stiff]
    as_single(nf.InsertionBatch(models), singles(models, 5), motions(1200, 5, 4), None, 2e-3)
    mixed = [soft, nf.preset("layered"), nf.preset("lugre")]
    as_single(nf.InsertionBatch(mixed), singles(mixed, 3), motions(900, 3, 5), None, 2e-3)


def test_members_with_the_same_tip_have_one_table_and_each_its_own_modulus():
    """The table of a tip takes longer than thousands of steps: it is made once, and kept as long as the tip."""
    sharp = PAPER.replace(stiffness=nf.laws.TipContact(1e5, 0.5e-3, tip=core.tips.TangentOgive(0.5e-3, 2e-3)))
    softer = sharp.replace(stiffness=nf.laws.TipContact(4e4, 0.5e-3, tip=sharp.stiffness.tip))
    stack = (deeper(4e-3, 1e-3), deeper(7e-3, 1e-3, stiffness=softer.stiffness))
    models = [each.replace(deeper=stack) for each in (sharp, softer, softer, PAPER, PAPER, sharp)]
    batch, engines = nf.InsertionBatch(models), singles(models, 6)
    as_single(batch, engines, motions(900, 6, 14)[:500], None, 1e-3)
    batch.replace(1, models[0])
    engines[1] = nf.Insertion(models[0])
    as_single(batch, engines, motions(900, 6, 14)[500:], None, 1e-3)
    thinner = PAPER.replace(stiffness=nf.laws.TipContact(1e5, 0.4e-3, tip=core.tips.TangentOgive(0.4e-3, 2e-3)))
    alike, apart = [sharp, softer, softer, sharp, sharp], [sharp, thinner, softer, thinner, sharp]
    bytes_of = [nf.InsertionBatch(models).nbytes for models in ([PAPER] * 5, alike, apart)]
    assert bytes_of[0] == bytes_of[1] < bytes_of[2] - 4 * 500


def test_a_dimple_that_stays_with_long_presliding():
    model = nf.preset("paper").replace(friction=nf.laws.Coulomb(per_length=25.0, presliding=2e-3, dimple_ratio=0.7))
    as_single(nf.InsertionBatch(model, 7), singles(model, 7), motions(1200, 7, 12), None, 1e-3)


@pytest.mark.parametrize("lanes", [4, 2, 1])
@pytest.mark.parametrize("name", ["paper", "stack", "relaxing"])
def test_whole_motions_are_those_of_single_insertions_on_any_processor(name, lanes):
    depths = motions(3000, 15, 11)
    batch = nf.InsertionBatch([MODELS[name]] * 15)
    batch._narrow(lanes)
    alone = [
        engine.forces(np.ascontiguousarray(z), np.full(3000, 1e-3))
        for engine, z in zip(singles(MODELS[name], 15), depths.T)
    ]
    np.testing.assert_array_equal(batch.run(depths, 1e-3), np.transpose(alone))


@pytest.mark.parametrize("name", ["paper", "stack", "layered"])
def test_whole_motions_and_threads_give_the_same(name):
    model, n = MODELS[name], 3000
    depths = np.linspace(-1e-3, 15e-3, 60)[:, None] * np.linspace(0.2, 1.0, n)
    one, four = nf.InsertionBatch(model, n), nf.InsertionBatch(model, n, threads=4)
    together, apart = four.run(depths, 5e-3), np.array([one.step(z, None, 5e-3).force for z in depths])
    np.testing.assert_array_equal(together, apart)
    alone = nf.Insertion(model).forces(np.ascontiguousarray(depths[:, 17]), np.full(60, 5e-3))
    np.testing.assert_array_equal(together[:, 17], alone)


@pytest.mark.parametrize("name", ["paper", "stack", "layered"])
def test_some_members_start_again_or_return(name):
    model, n, depths = MODELS[name], 10, motions(800, 10, 6)
    batch, engines = nf.InsertionBatch(model, n), singles(model, n)
    as_single(batch, engines, depths[:500], None, 1e-3)
    saved, kept = batch.snapshot(), [engine.snapshot() for engine in engines]
    as_single(batch, engines, depths[500:600], None, 1e-3)
    batch.restore(saved, members=[1, 4])
    for i in (1, 4):
        engines[i].restore(kept[i])
    batch.reset(members=np.arange(n) == 7)
    engines[7].reset()
    as_single(batch, engines, depths[500:700], None, 1e-3)
    batch.restore(saved)
    as_single(batch, kept, depths[500:700], None, 1e-3)


@pytest.mark.parametrize("members", [None, [0, 2, 3], [True, False, True, True]])
@pytest.mark.parametrize("kept", [{}, {"hold_time": 0.1}])  # its members stand in columns, or not
def test_what_returns_is_the_memory_and_settings_stay(members, kept):
    faster = nf.InsertionBatch(PAPER, 4, max_speed=0.5)
    slower = nf.InsertionBatch(PAPER, 4, max_speed=1e-2, bevel=BEVEL, **kept)
    faster.run(np.linspace(0.0, 9e-3, 40)[:, None] * np.ones(4), 1e-2)
    slower.restore(faster, members)
    for engine, allowed, lateral in ((faster.snapshot(), True, False), (slower, False, True)):
        refused = engine.snapshot().step(10e-3, None, 1e-2)  # 0.1 m/s
        assert (refused.status == 0)[[0, 2, 3]].tolist() == [allowed] * 3
        followed = engine.step(9.05e-3, None, 1e-2)  # 5 mm/s: within both
        assert not followed.status[[0, 2, 3]].any() and np.all((followed.lateral[[0, 2, 3]] != 0.0) == lateral)
    alone = nf.Insertion(PAPER)
    alone.forces(np.linspace(0.0, 9e-3, 40), np.full(40, 1e-2))
    assert np.all(followed.force[[0, 2, 3]] == alone.step(9.05e-3, None, 1e-2).force)


@pytest.mark.parametrize("others", ["paper_116", "lugre", "layered"])
@pytest.mark.parametrize("own", [False, True])
def test_a_member_gets_another_model_and_the_others_continue(others, own):
    model, n, depths = nf.preset("paper"), 9, motions(900, 9, 8)
    batch, engines = nf.InsertionBatch([model] * n if own else model, None if own else n), singles(model, n)
    as_single(batch, engines, depths[:500], None, 1e-3)
    before = batch.snapshot()
    for i in (2, 7):
        batch.replace(i, nf.preset(others))
        engines[i] = nf.Insertion(nf.preset(others))
    as_single(batch, engines, depths[500:700], None, 1e-3)
    saved, kept = batch.snapshot(), [engine.snapshot() for engine in engines]
    assert saved.models == batch.models and batch.models[7].name == nf.preset(others).name
    as_single(batch, engines, depths[700:], None, 1e-3)
    batch.restore(saved)
    as_single(batch, kept, depths[700:], None, 1e-3)
    with pytest.raises(nf.InputError, match="not of this batch"):
        batch.restore(before)


def test_none_and_a_million():
    model = nf.preset("paper")
    none = nf.InsertionBatch(model, 0)
    assert len(none.step([], None, 1e-3).force) == 0 and none.run(np.zeros((5, 0)), 1e-3).shape == (5, 0)
    many = nf.InsertionBatch(model, 10**6, threads=2)
    for depth in (0.0, 1e-3, 12e-3):
        forces = many.step(depth, None, 1.0).force
    assert np.all(forces == forces[0]) and forces[0] > 0.1
    assert 50e6 < many.nbytes < 100e6


def test_members_with_another_dt_or_without_a_number_are_refused_alone():
    batch = nf.InsertionBatch(nf.preset("paper"), 4)
    dt = batch.step([0.0, 1e-3, 2e-3, np.nan], None, [1e-3, 0.0, np.nan, 1e-3])
    assert list(dt.status) == [0, 1, 3, 3] and not dt.force[1:].any()
    after = batch.step([1e-4, 1e-3, 1e-3, 1e-3], [0.1, 0.0, np.inf, 0.0], 1e-3)
    assert list(after.status) == [0, 0, 3, 0] and after.force[1] > 0.0


MODEL = nf.preset("paper")
BROKEN = nf.preset("layered")
object.__setattr__(BROKEN, "deeper", (BROKEN.deeper[0].replace(top=-1.0),))


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda b: nf.InsertionBatch(MODEL), "needed with one model"),
        (lambda b: nf.InsertionBatch(MODEL, -1), "below 0"),
        (lambda b: nf.InsertionBatch(MODEL, 2.5), "n is 2.5, not a whole number"),
        (lambda b: nf.InsertionBatch(MODEL, "3"), "not a whole number"),
        (lambda b: nf.InsertionBatch(MODEL, 10**15), "more than memory has room for"),
        (lambda b: nf.InsertionBatch([MODEL] * 2, 3), "not the number of models, 2"),
        (lambda b: nf.InsertionBatch("paper", 3), "model 0"),
        (lambda b: nf.InsertionBatch(None, 3), "model 0"),
        (lambda b: nf.InsertionBatch([MODEL, BROKEN, MODEL]), "model 1: layer 2, top"),
        (lambda b: nf.InsertionBatch(MODEL, 3, threads=0), "threads is 0, below 1"),
        (lambda b: nf.InsertionBatch(MODEL, 3, threads="two"), "threads"),
        (lambda b: b.step([0.0, 1.0], None, 1e-3), r"the shape of depths is \(2,\), not \(3,\)"),
        (lambda b: b.step([[0.0], [0.0, 1.0], 0.0], None, 1e-3), "depths is rows of different lengths"),
        (lambda b: b.step([0.0] * 3, "fast", 1e-3), "velocities"),
        (lambda b: b.step([0.0] * 3, None, [1e-3] * 2), "the shape of dt"),
        (lambda b: b.step([0.0] * 3, None, None), "dt"),
        (lambda b: b.run([[0.0] * 3, [0.0]], 1e-3), "let a shorter motion end with its last depth"),
        (lambda b: b.run([0.0] * 3, 1e-3), r"not \(steps, 3\)"),
        (lambda b: b.run(np.zeros((4, 2)), 1e-3), "Give a column for each member"),
        (lambda b: b.run(np.zeros((4, 3)) * 1j, 1e-3), "not real numbers"),
        (lambda b: b.run(np.zeros((4, 3)), [1e-3] * 3), r"the shape of dt is \(3,\), not \(4,\)"),
        (lambda b: b.run(np.zeros((4, 3)), np.ones((4, 3))), r"are moved by step\(\)"),
        (lambda b: b.replace(-1, MODEL), "member is -1"),
        (lambda b: b.replace(3, MODEL), "not between 0 and 2"),
        (lambda b: b.replace(1.5, MODEL), "not a whole number"),
        (lambda b: b.replace(1, "paper"), "model is str"),
        (lambda b: b.replace(1, BROKEN), "layer 2"),
        (lambda b: b.reset([3]), "not between 0 and 2"),
        (lambda b: b.reset([0.5]), "neither places nor a mask"),
        (lambda b: b.reset([np.nan]), "neither places nor a mask"),
        (lambda b: b.reset([[0, 1], [1, 2]]), "neither places nor a mask"),
        (lambda b: b.reset([2**70]), "neither places nor a mask"),
        (lambda b: b.reset([True, False]), "the length of members"),
        (lambda b: b.restore(b.snapshot(), ["a"]), "neither places nor a mask"),
        (lambda b: b.restore(None), "Give what snapshot"),
        (lambda b: b.restore(nf.InsertionBatch(MODEL, 2)), "not of this batch"),
        (lambda b: b.restore(nf.InsertionBatch(nf.preset("lugre"), 3)), "not of this batch"),
    ],
)
def test_what_is_refused_changes_no_member(call, words):
    batch = nf.InsertionBatch(MODEL, 3)
    batch.run(np.linspace(0.0, 9e-3, 40)[:, None] * np.ones(3), 1e-2)
    before = batch.snapshot()
    with pytest.raises(nf.InputError, match=words):
        call(batch)
    steps = [each.step(9e-3, None, 1e-3) for each in (batch, before)]
    np.testing.assert_array_equal(steps[0].force, steps[1].force)
