# SPDX-License-Identifier: Apache-2.0
"""How the force converges with the step, for every law in the paper's model and for every preset. ``--write`` puts the
table into ``docs/evidence/convergence.md``, which says how it is measured."""

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.progress import track

import needleforce as nf
from needleforce.models.laws import FAMILIES, laws_of

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "docs"))
from law_pages.typical import around, example  # noqa: E402

PAGE = ROOT / "docs" / "evidence" / "convergence.md"
HEAD = "| law or preset | states | order | error at 8 ms | at 1 ms | at 0.25 ms |\n|---|---|---|---|---|---|\n"
COARSEST, HALVINGS, PHASES = 8e-3, 7, (0.0, 0.29, 0.53, 0.83)
LEGS = ((2e-3, 4.8), (1e-3, 8.0), (0.0, 1.6), (-1e-3, 9.6), (2e-3, 3.2), (0.0, 0.8), (-4e-3, 3.6))  # [m/s], [s]
DEEPEST = 16e-3
ROUNDING = 1e-9  # of the largest force, after half a million steps


@dataclass(frozen=True)
class Convergence:
    """The errors of a model with each step, over its largest force."""

    name: str
    states_exact: bool
    steps: np.ndarray  # [s], the coarsest first
    errors: np.ndarray

    @property
    def exact(self) -> bool:
        """True if steps of any size agree but for rounding."""
        return bool(self.errors.max() < ROUNDING)

    @property
    def order(self) -> float:
        """Slope of the error over the step, in logarithms; the steps next to the finest are too close to it."""
        return float(np.polyfit(np.log(self.steps[:-2]), np.log(self.errors[:-2]), 1)[0])

    def cells(self) -> tuple[str, ...]:
        """The line of the table, without the name."""
        order = "exact" if self.exact else f"{self.order:.1f}"
        errors = ("0" if self.exact else f"{100.0 * self.errors[k]:.2g} %" for k in (0, 3, 5))
        return ("exact" if self.states_exact else "first order", order, *errors)


def table(measured: list[Convergence]) -> str:
    """Laws and presets with the same values share a row."""
    names: dict[tuple, list[str]] = {}
    for each in measured:
        names.setdefault(each.cells(), []).append(each.name)
    return HEAD + "".join("| " + " | ".join([", ".join(shared), *cells]) + " |\n" for cells, shared in names.items())


def depths(step: float, phase: float, scale: float) -> np.ndarray:
    """Depths [m] at every ``step`` [s] of the motion, from above the surface, a phase of a step higher."""
    speeds, durations = np.array(LEGS).T * np.array([[scale], [1.0]])
    times = np.concatenate([[0.0], np.cumsum(durations)])
    corners = np.concatenate([[0.0], np.cumsum(speeds * durations)])
    start = -0.1 * DEEPEST * scale - phase * speeds[0] * COARSEST
    return start + np.interp(step * np.arange(1, round(times[-1] / step) + 1), times, corners)


def run(model: nf.Model, halvings: int, phase: float, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """Force [N] at the times of the coarsest step, and whether a rupture fell in the step before each."""
    n, step = 2**halvings, COARSEST / 2**halvings
    at = depths(step, phase, scale)
    result = nf.Insertion(model, max_speed=np.inf).run(at, None, np.full(at.size, step))
    ruptures = (np.diff(result["stiffness"], prepend=0.0) < 0.0) & (np.diff(at, prepend=at[0]) > 0.0)
    return result["force"][n - 1 :: n], ruptures.reshape(-1, n).any(axis=1)


def converges(name: str, model: nf.Model, halvings: int = HALVINGS, phases: tuple = PHASES) -> Convergence:
    """Steps a model with every step at every phase, through its deepest puncture."""
    last = max(layer.top + layer.laws.puncture_depth for layer in model.layers)
    scale = max(1.0, 1.2 * last / DEEPEST)
    errors, largest = np.zeros(halvings), 0.0
    for phase in phases:
        runs = [run(model, k, phase, scale) for k in range(halvings + 1)]
        finest = runs[-1][0]
        largest = max(largest, np.abs(finest).max())
        ruptured = np.any([now for _, now in runs], axis=0)
        kept = ~(ruptured | np.roll(ruptured, 1))
        for k, (force, _) in enumerate(runs[:-1]):
            errors[k] = max(errors[k], np.abs(force - finest)[kept].max())
    laws = [getattr(layer, family) for layer in model.layers for family in FAMILIES]
    exact = all(law.steps_exactly for law in laws)
    return Convergence(name, exact, COARSEST / 2.0 ** np.arange(halvings), errors / largest)


def models() -> dict[str, nf.Model]:
    """Every law with typical values in the paper's model, then every preset."""
    laws = {f"`{law.name}`": around(example(law).law) for family in FAMILIES for law in laws_of(family)}
    return laws | {f"preset `{name}`": nf.preset(name) for name in nf.presets()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="put the table into docs/evidence/convergence.md")
    write = parser.parse_args().write
    text = table([converges(name, model) for name, model in track(models().items(), "models")])
    if write:
        before, _, _ = PAGE.read_text(encoding="utf-8").partition(HEAD)
        PAGE.write_text(before + text, encoding="utf-8")
    else:
        print(text)


if __name__ == "__main__":
    main()
