# SPDX-License-Identifier: Apache-2.0
"""The environments follow Gymnasium's rules, seeds decide everything, and a script succeeds where chance does not."""

import re
import shutil
import subprocess
import sys
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

import needleforce as nf
from needleforce.campaign import campaign
from needleforce.simulators.environments import MAX_STEPS, NeedleEnv, NeedleVectorEnv
from needleforce.simulators.policies import policy, successes

TASKS = ("insert", "find", "hold")


@pytest.mark.parametrize("task", TASKS)
def test_gymnasium_accepts_it(task):
    one = gymnasium.make(f"needleforce/{task.capitalize()}-v0")
    check_env(one.unwrapped)
    many = gymnasium.make_vec(
        f"needleforce/{task.capitalize()}-v0", num_envs=3, vectorization_mode="vector_entry_point"
    )
    seen, _ = many.reset(seed=5)
    assert many.observation_space.contains(seen) and many.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP


@pytest.mark.parametrize("task", TASKS)
def test_a_member_is_the_single_environment_of_its_seed_through_its_first_episodes(task):
    """Gymnasium's own vector of single environments has the same numbers, resets included."""
    many, theirs = NeedleVectorEnv(task, 4), gymnasium.vector.SyncVectorEnv([lambda: NeedleEnv(task)] * 4)
    scripted, random = policy("scripted", task, 4), np.random.default_rng(2)
    begun, ended = np.ones(4, dtype=bool), 0
    seen = many.reset(seed=11)[0]
    np.testing.assert_array_equal(seen, theirs.reset(seed=11)[0])
    for _ in range(MAX_STEPS + 150):
        actions = np.clip(scripted(seen, begun) + random.normal(0.0, 0.02, (4, 1)), -1.0, 1.0).astype(np.float32)
        ours, others = many.step(actions), theirs.step(actions)
        for mine, other in zip(ours[:4], others[:4]):
            np.testing.assert_array_equal(mine, other)
        seen, begun = ours[0], ours[2] | ours[3]
        ended += begun.sum()
        np.testing.assert_array_equal(ours[4].get("success", begun & False), others[4].get("success", begun & False))
    assert ended >= 4
    theirs.close()


def test_the_three_ways_to_begin_again():
    actions = np.ones((2, 1), dtype=np.float32)
    at_once = NeedleVectorEnv("find", 2, autoreset_mode=AutoresetMode.SAME_STEP)
    by_hand = NeedleVectorEnv("find", 2, autoreset_mode=AutoresetMode.DISABLED)
    at_once.reset(seed=1)
    by_hand.reset(seed=1)
    ends = np.zeros(2, dtype=bool)
    while not ends.any():
        one, other = at_once.step(actions), by_hand.step(actions)
        ends = other[2] | other[3]
    first = int(ends.argmax())
    np.testing.assert_array_equal(one[4]["final_obs"][first], other[0][first])
    with pytest.raises(nf.InputError, match=f"needle {first}.*its episode has ended"):
        by_hand.step(actions)
    begun = by_hand.reset(options={"reset_mask": ends})[0]
    np.testing.assert_array_equal(begun, one[0])


def test_after_the_end_and_other_input_that_is_refused():
    env = NeedleEnv("insert", models=["paper"])
    env.reset(seed=3)
    for _ in range(MAX_STEPS):
        *_, over, cut, infos = env.step(np.zeros(1, dtype=np.float32))
    assert cut and not over and infos == {"success": False}
    without = nf.preset("paper").replace(puncture=nf.laws.PunctureDepth(depth=0.0))
    for wrong, words in (
        (lambda: env.step(np.zeros(1)), r"reset\(\)"),
        (lambda: NeedleVectorEnv("cut"), "insert, find, hold"),
        (lambda: NeedleVectorEnv(models=["papyrus"]), "paper"),
        (lambda: NeedleVectorEnv(models=[]), "at least one model"),
        (lambda: NeedleVectorEnv("find", models=[without]).reset(), "without a layer that breaks"),
        (lambda: NeedleVectorEnv(num_envs=2).step(np.zeros(2)), r"not \(2, 1\)"),
        (lambda: NeedleVectorEnv(num_envs=2).step(np.full((2, 1), np.nan)), "outside -1 to 1"),
        (lambda: NeedleVectorEnv(num_envs=2).reset(options={"reset_mask": np.ones(3, bool)}), "reset_mask"),
        (lambda: NeedleVectorEnv(num_envs=2).reset(options={"reset_mask": np.ones(2, int)}), "is int64 .*boolean"),
        (lambda: NeedleVectorEnv(num_envs=2).reset(seed=[1]), "1 numbers, not 2"),
        (lambda: NeedleVectorEnv(num_envs=2).reset(seed="a"), "seed"),
        (lambda: NeedleVectorEnv(num_envs=2).reset(seed=1.5), "seed is 1.5, must be a whole number"),
        (lambda: NeedleVectorEnv(num_envs=2).reset(seed=[1, 1.5]), "seed of needle 1 is 1.5"),
        (lambda: NeedleEnv().reset(seed=True), "seed is True"),
        (lambda: policy("random", "hold", 2, seed=1.5), "seed is 1.5"),
        (lambda: policy("best", "hold", 2), "random, threshold, scripted"),
        (lambda: NeedleVectorEnv(num_envs=-1), "num_envs"),
        (lambda: NeedleVectorEnv(num_envs=1.5), "num_envs is 1.5, not a whole number"),
        (lambda: NeedleEnv(render_mode="human"), "nothing is drawn"),
    ):
        with pytest.raises(nf.InputError, match=words):
            wrong()


@pytest.mark.parametrize("task", TASKS)
def test_a_script_succeeds_where_chance_does_not(task):
    share = {name: successes(NeedleVectorEnv(task, 100), policy(name, task, 100), 7) for name in ("random", "scripted")}
    assert share["random"][0] <= 0.05 and share["scripted"][0] >= 0.98
    assert share["scripted"][1] > share["random"][1]


def test_no_needles():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        none = NeedleVectorEnv("insert", 0)
    assert none.reset(seed=1)[0].shape == (0, 6) and none.step(np.zeros((0, 1)))[1].shape == (0,)


def test_models_of_fits_and_campaigns(root, tmp_path):
    """As a user has them: the JSON of identify, and of a campaign whose conditions are tissues."""
    recording = root / "examples" / "insertion.csv"
    for name in ("gel_1", "gel_2", "liver_1"):
        shutil.copy(recording, tmp_path / f"{name}.csv")
    fit, done = tmp_path / "fit.json", tmp_path / "campaign.json"
    fit.write_text(nf.identify(nf.read(recording), needle="paper").to_json())
    found = campaign(tmp_path.glob("*.csv"), pattern="{tissue}_{repeat}", needle="paper", jobs=1)
    done.write_text(found.to_json())
    page, gel = (root / "docs" / "reference" / "hosts.md").read_text(encoding="utf-8"), tmp_path / "gel.toml"
    gel.write_text(re.search(r"```toml\n(.*?)```", page, re.S)[1])
    many = NeedleVectorEnv("find", 50, models=[nf.preset("stribeck"), fit, str(done), str(gel)])
    many.reset(seed=1)
    expected = [nf.preset("stribeck"), nf.preset(fit), *(each.model for each in found.conditions), nf.preset(gel)]
    assert expected[-1].puncture_depth == 3.16e-3 and expected[-1].cutting.force == 0.106
    assert [tissue.model.layers for tissue in many.tissues] == [model.layers for model in expected]
    assert len(expected) == 5 and set(many.batch.models) == {tissue.model for tissue in many.tissues}
    assert successes(many, policy("scripted", "find", 50), 3)[0] > 0.9
    (tmp_path / "mine.json").write_text('{"conditions": [{"preset": null}]}')
    for wrong, words in (("mine.toml", r"mine\.toml"), ("mine.json", r"mine\.json: campaign.*no condition has")):
        with pytest.raises(nf.InputError, match=words):
            NeedleVectorEnv(models=str(tmp_path / wrong))


NEEDED = (("environments", "gymnasium", "gym"), ("warp", "warp", "warp"))


@pytest.mark.parametrize(("module", "missing", "extra"), NEEDED)
def test_a_host_that_is_not_installed_is_named(module, missing, extra):
    program = f"import sys\nsys.modules[{missing!r}] = None\nimport needleforce.simulators.{module}"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 1 and f'pip install "needleforce[{extra}]"' in done.stderr
