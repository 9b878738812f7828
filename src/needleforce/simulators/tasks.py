# SPDX-License-Identifier: Apache-2.0
"""What a needle is to do in an episode: insert to a depth, find the layer and stop, hold still in tissue that moves."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ..errors import InputError
from ..models.model import Insertion, Model

DEEPEST = 30e-3  # m, of any needle in these tasks
SLOW = 2e-3  # m/s, of the insertion from which the limits of force are made
STILL = 1e-3  # m/s
REST_STEPS = 10  # after which a needle that stands still has decided

Draw = dict[str, float]
State = dict[str, np.ndarray]


class KnownTissue:
    """What a task needs to know of a model: the largest force down to each depth, and where the first layer breaks."""

    def __init__(self, model: Model):
        self.model, self.engine = model, Insertion(model)
        self.depths = np.linspace(-1e-3, DEEPEST, 621)
        samples = [self.engine.step(float(depth), None, 50e-6 / SLOW) for depth in self.depths]
        self.largest = np.maximum.accumulate([sample.force for sample in samples])
        before = zip(self.depths[:-1], samples[1:])
        self.layer = next((float(z) for z, sample in before if sample.punctured and z > 0.5e-3), None)

    def largest_to(self, depth: float) -> float:
        """The largest force of a slow insertion to a depth [N]."""
        return float(np.interp(depth, self.depths, self.largest))

    def force_at(self, depth: float, dt: float) -> float:
        """The force of a needle that is put there [N]."""
        self.engine.reset()
        return self.engine.step(depth, 0.0, dt).force


@dataclass(frozen=True)
class Insert:
    """To a target depth, and rest there; no more force than 1.15 times that of a slow insertion to it."""

    name: ClassVar[str] = "insert"
    models: ClassVar[tuple[str, ...]] = ("paper", "paper_116", "lugre", "stribeck", "relaxing")

    def draw(self, random: np.random.Generator, tissue: KnownTissue) -> Draw:
        """The numbers of an episode."""
        target = random.uniform(8e-3, 25e-3)
        return {
            "start": -random.uniform(1e-3, 5e-3),
            "target": target,
            "limit": 1.15 * tissue.largest_to(target),
        }

    def surface(self, state: State) -> np.ndarray:
        """Where the surface of the tissue is [m], + along the insertion."""
        return np.zeros_like(state["time"])

    def goal(self, state: State) -> np.ndarray:
        """The distance to the target [mm]."""
        return 1e3 * (state["target"] - state["position"])

    def judge(self, state: State) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Reward, whether the episode ends, and whether it succeeded."""
        error = np.abs(state["target"] - state["position"])
        there = (error <= 0.5e-3) & (state["rest"] >= REST_STEPS)
        over = state["true_force"] > state["limit"]
        return -0.01 * error / 10e-3 + there * ~over - 1.0 * over, there | over, there & ~over


@dataclass(frozen=True)
class Find:
    """Through the first layer, and stop: resting after contact is the answer, right up to 2 mm behind the layer. Where
    the surface is, nobody knows."""

    name: ClassVar[str] = "find"
    models: ClassVar[tuple[str, ...]] = ("paper", "maurin", "stick_slip", "okamura_liver", "layered")
    allowed: float = 2e-3

    def draw(self, random: np.random.Generator, tissue: KnownTissue) -> Draw:
        """The numbers of an episode."""
        if tissue.layer is None:
            raise InputError(
                "models",
                tissue.model.name,
                f"without a layer that breaks above {DEEPEST * 1e3:g} mm",
                next_step="Choose the task insert, or a model that is punctured.",
            )
        layer = tissue.layer
        return {
            "start": -random.uniform(1e-3, 10e-3),
            "target": layer,
            "limit": 3.0 * tissue.largest_to(layer + self.allowed),
        }

    def surface(self, state: State) -> np.ndarray:
        """Where the surface of the tissue is [m]: positions count from where the needle begins."""
        return -state["start"]

    def goal(self, state: State) -> np.ndarray:
        """Nothing: the layer is what is sought."""
        return np.zeros_like(state["time"])

    def judge(self, state: State) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Reward, whether the episode ends, and whether it succeeded."""
        beyond = state["deepest"] - state["target"]
        too_far = (beyond > 2.5 * self.allowed) | (state["true_force"] > state["limit"])
        answered = (state["rest"] >= REST_STEPS) & (state["deepest"] > 0.0)
        right = answered & ~too_far & (beyond >= 0.0) & (beyond <= self.allowed)
        ends = too_far | answered
        return np.where(right, 1.0 - 0.5 * beyond / self.allowed, -1.0 * ends) - 1e-3, ends, right


@dataclass(frozen=True)
class Hold:
    """Stay where the needle is in tissue that breathes and relaxes, from force and own motion alone: 1 mm in the mean,
    never 4 mm off."""

    name: ClassVar[str] = "hold"
    models: ClassVar[tuple[str, ...]] = ("paper", "physical", "relaxing")

    def draw(self, random: np.random.Generator, tissue: KnownTissue) -> Draw:
        """The numbers of an episode."""
        start = random.uniform(8e-3, 15e-3)
        return {
            "start": start,
            "target": start,
            "limit": 3.0 * tissue.largest_to(DEEPEST),
            "amplitude": random.uniform(1e-3, 3e-3),
            "pace": 2.0 * np.pi / random.uniform(3.0, 6.0),
        }

    def surface(self, state: State) -> np.ndarray:
        """Where the surface of the tissue is [m]: at rest in the beginning."""
        return state["amplitude"] * (np.cos(state["pace"] * state["time"]) - 1.0)

    def goal(self, state: State) -> np.ndarray:
        """The force when the hold began [N]."""
        return state["first_force"]

    def judge(self, state: State) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Reward, whether the episode ends, and whether it would have succeeded if it ended here."""
        error = np.abs(state["depth"] - state["target"])
        lost = (error > 4e-3) | (state["true_force"] > state["limit"])
        return -0.01 * error / 1e-3 - 1.0 * lost, lost, ~lost & (state["mean_error"] <= 1e-3)


TASKS: dict[str, Any] = {task.name: task for task in (Insert, Find, Hold)}
