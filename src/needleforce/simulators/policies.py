# SPDX-License-Identifier: Apache-2.0
"""What an agent has to beat: random, threshold and scripted policies, and how they do over many episodes.

Each is called with observations (n, 6) and which episodes have just begun (n,), and gives actions (n, 1).
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from ..checks import one_of, random_seed
from .environments import MAX_SPEED, NeedleVectorEnv
from .tasks import TASKS

Policy = Callable[[np.ndarray, np.ndarray], np.ndarray]
FULL = 1e3 * MAX_SPEED  # mm/s
FALL = 0.02  # N, ten times the noise of the default sensor


def policy(name: str, task: str, num_envs: int, seed: int = 0) -> Policy:
    """A policy of a task.

    Parameters
    ----------
    name : str
        ``"random"``; ``"threshold"``, which stops or turns at a fixed number of the force; ``"scripted"``, which
        slows down before the limit, stops at a fall of the force, or follows the tissue by it.
    task : str
        Of ``NeedleVectorEnv``.
    num_envs, seed : int
        How many needles, and the seed of the random one.

    Returns
    -------
    callable
    """
    one_of("policy", name, ("random", "threshold", "scripted"))
    one_of("task", task, TASKS)
    if name == "random":
        random = np.random.default_rng(random_seed(seed))
        return lambda seen, begun: random.uniform(-1.0, 1.0, (num_envs, 1)).astype(np.float32)
    return _Memory(_SPEEDS[name, task], num_envs)


class _Memory:
    """A rule for the speed [mm/s] from the columns of an observation, the largest force of the episode, and whether the
    needle has stopped for good."""

    def __init__(self, speed: Any, num_envs: int):
        self.speed, self.peak, self.stopped = speed, np.zeros(num_envs), np.zeros(num_envs, dtype=bool)

    def __call__(self, seen: np.ndarray, begun: np.ndarray) -> np.ndarray:
        """Actions (n, 1)."""
        force = seen[:, 2]
        self.peak = np.where(begun, force, np.maximum(self.peak, force))
        self.stopped &= ~begun
        speed, stops = self.speed(*seen.T, self.peak)
        self.stopped |= stops
        return np.clip(np.where(self.stopped, 0.0, speed / FULL), -1.0, 1.0).astype(np.float32)[:, None]


def _threshold_insert(position, velocity, force, rate, goal, limit, peak):
    return np.full_like(force, FULL), (goal <= 0.0) | (force > 0.9 * limit)


def _scripted_insert(position, velocity, force, rate, goal, limit, peak):
    spare = np.clip((limit - force) / (0.3 * limit), 0.1, 1.0)
    return np.clip(4.0 * goal, -FULL, FULL * spare), np.zeros(len(force), dtype=bool)


def _threshold_find(position, velocity, force, rate, goal, limit, peak):
    return np.full_like(force, 0.5 * FULL), rate < -2.0


def _scripted_find(position, velocity, force, rate, goal, limit, peak):
    return np.full_like(force, 0.25 * FULL), force < peak - np.maximum(FALL, 0.04 * peak)


def _threshold_hold(position, velocity, force, rate, goal, limit, peak):
    off = goal - force
    return np.where(np.abs(off) > 0.05, 4.0 * np.sign(off), 0.0), np.zeros(len(force), dtype=bool)


def _scripted_hold(position, velocity, force, rate, goal, limit, peak):
    # friction has a sign and little else: the speed follows it as fast as a breath changes
    return velocity + 0.6 * np.clip((goal - force) / 0.05, -1.0, 1.0), np.zeros(len(force), dtype=bool)


_SPEEDS = {
    ("threshold", "insert"): _threshold_insert,
    ("scripted", "insert"): _scripted_insert,
    ("threshold", "find"): _threshold_find,
    ("scripted", "find"): _scripted_find,
    ("threshold", "hold"): _threshold_hold,
    ("scripted", "hold"): _scripted_hold,
}


def successes(environments: NeedleVectorEnv, policy: Policy, seed: int = 0) -> tuple[float, float]:
    """How a policy does in the first episode of each needle.

    Parameters
    ----------
    environments : NeedleVectorEnv
        With the autoreset of Gymnasium, ``NEXT_STEP``.
    policy : callable
        As from ``policy``.
    seed : int
        Of the episodes.

    Returns
    -------
    tuple of float
        Share of the episodes that succeeded, and their mean return.
    """
    seen, _ = environments.reset(seed=seed)
    begun, ends = np.ones(environments.num_envs, dtype=bool), np.zeros(environments.num_envs, dtype=bool)
    done, right, returned = ends.copy(), ends.copy(), np.zeros(environments.num_envs)
    while not done.all():
        seen, rewards, over, cut, infos = environments.step(policy(seen, begun))
        returned += np.where(done, 0.0, rewards)
        begun, ends = ends, over | cut  # the step after the end begins the next episode
        right |= ends & ~done & infos.get("success", False)
        done |= ends
    return float(right.mean()), float(returned.mean())
