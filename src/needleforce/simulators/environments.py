# SPDX-License-Identifier: Apache-2.0
"""Environments for Gymnasium on ``InsertionBatch``: many needles at once, and a single one through the same code."""

from collections.abc import Sequence
from os import PathLike
from typing import Any

import numpy as np

from ..checks import not_below_zero, one_of, random_seed
from ..errors import InputError
from ..models.insertion_batch import InsertionBatch
from ..models.members import whole_number
from ..models.model import Model
from ..preset_files.presets import models_of
from .tasks import DEEPEST, STILL, TASKS, KnownTissue

try:
    import gymnasium as gym
    from gymnasium.vector import AutoresetMode
    from gymnasium.vector.utils import batch_space
except ImportError as error:
    raise ImportError('needleforce.simulators.environments needs Gymnasium: pip install "needleforce[gym]"') from error

DT, MAX_SPEED, MAX_STEPS = 0.02, 20e-3, 500
# position [mm], velocity [mm/s], force [N], its change [N/s], goal of the task, limit of the force [N]
_HIGH = np.array([200.0, 1e3 * MAX_SPEED, 100.0, 5000.0, 200.0, 300.0], dtype=np.float32)
_NUMBERS = ("position", "depth", "velocity", "force", "true_force", "rate", "deepest", "rest", "time", "steps")
_NUMBERS += ("mean_error", "first_force", "start", "target", "limit", "amplitude", "pace")


class NeedleVectorEnv(gym.vector.VectorEnv):
    """n needles, each in an episode of its own.

    The action is the speed of the needle over 20 mm/s, -1 to 1, for 20 ms. An observation is position [mm], velocity
    [mm/s], measured force [N], its change [N/s], the goal (distance to the target [mm] of ``insert``, force when the
    hold began [N] of ``hold``, 0 of ``find``) and the limit of the force [N].

    Parameters
    ----------
    task : str
        ``"insert"``, ``"find"`` or ``"hold"``.
    num_envs : int
        How many.
    models : sequence of Model, str or path, optional
        One is drawn for each episode: presets, preset files, JSON of a fit, or of a campaign: all of its conditions.
        Default: those of the task.
    force_noise : float
        Standard deviation of the measured force [N].
    autoreset_mode : gymnasium.vector.AutoresetMode
        As Gymnasium defines them; with ``DISABLED`` ended needles wait for ``reset(options={"reset_mask": …})``.
    threads : int
        As of ``InsertionBatch``.

    Raises
    ------
    InputError
        If the task, a model or a number is none.
    """

    def __init__(
        self,
        task: str = "insert",
        num_envs: int = 1,
        *,
        models: Sequence[Model | str] | None = None,
        force_noise: float = 2e-3,
        autoreset_mode: AutoresetMode = AutoresetMode.NEXT_STEP,
        threads: int = 1,
    ):
        one_of("task", task, TASKS)
        self.task, self.force_noise = TASKS[task](), not_below_zero("force_noise", force_noise, "N")
        whole_number("num_envs", num_envs, 0)
        given = [models] if isinstance(models, str | PathLike | Model) else models
        given = list(self.task.models if given is None else given)
        if not given:
            raise InputError("models", "[]", "none", next_step="Give at least one model, or leave it out.")
        self.tissues = [KnownTissue(model) for source in given for model in models_of(source)]
        self.num_envs, self.autoreset_mode = num_envs, AutoresetMode(autoreset_mode)
        self.metadata = {"autoreset_mode": self.autoreset_mode, "render_modes": []}
        self.single_action_space = gym.spaces.Box(-1.0, 1.0, (1,), np.float32)
        self.single_observation_space = gym.spaces.Box(-_HIGH, _HIGH, dtype=np.float32)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.batch = InsertionBatch([self.tissues[0].model] * num_envs, threads=threads)
        self.state = {name: np.zeros(num_envs) for name in _NUMBERS}
        self.ended = np.ones(num_envs, dtype=bool)
        self._which = np.zeros(num_envs, dtype=int)
        self._randoms = [np.random.default_rng() for _ in range(num_envs)]
        # drawn when an episode begins: a draw for each needle in each step would take longer than the step
        self._noise = np.zeros((num_envs, MAX_STEPS if force_noise else 1), dtype=np.float32)

    def reset(self, *, seed: Any = None, options: dict[str, Any] | None = None) -> tuple[np.ndarray, dict[str, Any]]:
        """New episodes for all, or for those of ``options["reset_mask"]``.

        Parameters
        ----------
        seed : int or sequence of int, optional
            With a number, needle i has the seed ``seed + i``: its episodes depend on no other needle.
        options : dict, optional
            ``reset_mask``, a boolean array (num_envs,).

        Returns
        -------
        tuple
            Observations (num_envs, 6) and infos.
        """
        if seed is not None:
            one = np.ndim(seed) == 0
            seeds = [random_seed(seed) + i for i in range(self.num_envs)] if one else list(seed)
            if len(seeds) != self.num_envs:
                raise InputError("seed", f"{len(seeds)} numbers", f"not {self.num_envs}", next_step="Give one number.")
            checked = [
                None if each is None else random_seed(each, f"seed of needle {i}") for i, each in enumerate(seeds)
            ]
            super().reset(seed=int(seed) if one else None)
            self._randoms = [np.random.default_rng(each) for each in checked]
        mask = (options or {}).get("reset_mask", np.ones(self.num_envs, dtype=bool))
        if np.shape(mask) != (self.num_envs,) or np.asarray(mask).dtype != bool:
            limit = f"not a boolean array ({self.num_envs},)"
            raise InputError("reset_mask", f"{np.asarray(mask).dtype} {np.shape(mask)}", limit)
        self._begin(mask)
        return self._observations(), {}

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Moves each needle for 20 ms.

        Parameters
        ----------
        actions : ndarray
            (num_envs, 1), -1 to 1; what is no number or beyond is refused.

        Returns
        -------
        tuple
            Observations, rewards, terminations, truncations and infos, as Gymnasium defines them.
        """
        speed = self._speeds(actions)
        begins = self.ended.copy()
        if begins.any() and self.autoreset_mode is not AutoresetMode.NEXT_STEP:
            raise InputError(
                f"needle {int(begins.argmax())}",
                "stepped",
                "its episode has ended or not begun",
                next_step="Call reset(), or reset(options={'reset_mask': …}) for some needles.",
            )
        if begins.any():
            self._begin(begins)
        self._move(np.where(begins, 0.0, speed), begins)
        rewards, over, right = self.task.judge(self.state)
        cut = self.state["steps"] >= MAX_STEPS
        self.ended = (over | cut) & ~begins
        infos = {"success": right & self.ended, "_success": self.ended.copy()} if self.ended.any() else {}
        found = self._observations()
        if self.autoreset_mode is AutoresetMode.SAME_STEP and self.ended.any():
            found, infos = self._begun_at_once(found, infos)
        going = ~begins
        return found, rewards * going, over & going, cut & ~over & going, infos

    def _begun_at_once(self, found: np.ndarray, infos: dict) -> tuple[np.ndarray, dict]:
        mask, last = self.ended.copy(), np.full(self.num_envs, None, dtype=object)
        for i in np.flatnonzero(mask):
            last[i] = found[i]
        self._begin(mask)
        return self._observations(), {"final_obs": last, "_final_obs": mask, "final_info": infos, "_final_info": mask}

    def _speeds(self, actions: np.ndarray) -> np.ndarray:
        given = np.asarray(actions, dtype=float)
        if given.shape != (self.num_envs, 1):
            raise InputError("the shape of actions", given.shape, f"not ({self.num_envs}, 1)")
        if not np.all(np.abs(given) <= 1.0):
            worst = given[~(np.abs(given) <= 1.0)][0]
            raise InputError("actions", worst, "outside -1 to 1", next_step="Clip them: numpy.clip(actions, -1, 1).")
        return MAX_SPEED * given[:, 0]

    def _begin(self, mask: np.ndarray) -> None:
        """New episodes of some needles: a tissue and the numbers of the task, each from the needle's own seed."""
        state = self.state
        for numbers in state.values():
            numbers[mask] = 0.0
        for i in np.flatnonzero(mask):
            random = self._randoms[i]
            which = int(random.integers(len(self.tissues)))
            tissue = self.tissues[which]
            if which != self._which[i]:
                self.batch.replace(i, tissue.model)
                self._which[i] = which
            for name, number in self.task.draw(random, tissue).items():
                state[name][i] = number
            state["first_force"][i] = tissue.force_at(state["start"][i], DT)
            if self.force_noise:
                random.standard_normal(dtype=np.float32, out=self._noise[i])
        self.batch.reset(mask)
        state["depth"][mask] = state["deepest"][mask] = state["start"][mask]
        state["position"][mask] = (state["start"] + self.task.surface(state))[mask]
        state["force"][mask] = state["true_force"][mask] = state["first_force"][mask]
        self.ended[mask] = False

    def _move(self, speed: np.ndarray, begins: np.ndarray) -> None:
        """One step of all needles but those whose episode begins, which stay as they are."""
        state, going = self.state, ~begins
        position = np.clip(state["position"] + speed * DT, -10e-3, DEEPEST)
        velocity = (position - state["position"]) / DT
        state["time"] += DT * going
        state["steps"] += going
        depth = np.where(begins, state["depth"], position - self.task.surface(state))
        force = self.batch.step(depth, None, DT).force
        self.batch.reset(begins)
        noise = self._noise[np.arange(self.num_envs), np.minimum(state["steps"].astype(int), self._noise.shape[1]) - 1]
        measured = force + self.force_noise * noise
        state["rate"][going] = ((measured - state["force"]) / DT)[going]
        state["rest"] = np.where(going & (np.abs(velocity) < STILL), state["rest"] + 1, 0)
        news = {"position": position, "depth": depth, "velocity": velocity, "force": measured, "true_force": force}
        for name, values in news.items():
            state[name][going] = values[going]
        state["deepest"] = np.maximum(state["deepest"], state["depth"])
        error = np.abs(state["depth"] - state["target"])
        state["mean_error"] += (error - state["mean_error"]) / np.maximum(state["steps"], 1.0) * going

    def _observations(self) -> np.ndarray:
        state = self.state
        columns = (1e3 * state["position"], 1e3 * state["velocity"], state["force"], state["rate"])
        found = np.stack([*columns, self.task.goal(state), state["limit"]], axis=1)
        return np.clip(found, -_HIGH, _HIGH).astype(np.float32)


class NeedleEnv(gym.Env):
    """One needle: ``NeedleVectorEnv`` with one member, of which a step after the end of the episode is refused.

    Parameters
    ----------
    task : str
        ``"insert"``, ``"find"`` or ``"hold"``.
    render_mode : None
        There is nothing to look at.
    **options
        ``models``, ``force_noise``, ``threads`` of ``NeedleVectorEnv``.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012

    def __init__(self, task: str = "insert", render_mode: None = None, **options: Any):
        if render_mode is not None:
            raise InputError("render_mode", repr(render_mode), "unknown", next_step="Leave it out: nothing is drawn.")
        self.one = NeedleVectorEnv(task, 1, autoreset_mode=AutoresetMode.DISABLED, **options)
        self.action_space, self.observation_space = self.one.single_action_space, self.one.single_observation_space
        self.render_mode = render_mode

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """A new episode; the same one for the same seed."""
        found, infos = self.one.reset(seed=seed)
        super().reset(seed=None if seed is None else int(seed))
        return found[0], infos

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Moves the needle for 20 ms; ``action`` is (1,), -1 to 1."""
        given = np.reshape(np.asarray(action, dtype=float), (1, -1))
        found, rewards, over, cut, infos = self.one.step(given)
        return found[0], float(rewards[0]), bool(over[0]), bool(cut[0]), _of_one(infos)


def _of_one(infos: dict[str, Any]) -> dict[str, Any]:
    return {"success": bool(infos["success"][0])} if infos else {}


for _task in TASKS:
    gym.register(
        id=f"needleforce/{_task.capitalize()}-v0",
        entry_point=NeedleEnv,
        vector_entry_point=NeedleVectorEnv,
        kwargs={"task": _task},
    )
