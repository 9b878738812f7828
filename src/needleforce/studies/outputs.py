# SPDX-License-Identifier: Apache-2.0
"""The quantities of a simulated insertion that a study can ask for."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..display.quantities import scale
from ..vocabulary import Phase

_PHASES = list(Phase)
_DEFORMATION, _INSERTION = (float(_PHASES.index(phase)) for phase in (Phase.deformation, Phase.insertion))


@dataclass(frozen=True, eq=False)
class Run:
    """A simulated insertion: depth (n,) [m], and by name force, its parts and phase (n,), and tip (n, 3) [m]."""

    depth: np.ndarray
    columns: Mapping[str, np.ndarray]

    @property
    def force(self) -> np.ndarray:
        """Force (n,) [N]."""
        return self.columns["force"]

    @property
    def deepest(self) -> int:
        """The sample at which the tip first reaches its deepest point."""
        return int(np.argmax(self.depth))

    @property
    def punctures(self) -> np.ndarray:
        """The last sample before each puncture."""
        phase = self.columns["phase"]
        return np.flatnonzero((phase[:-1] == _DEFORMATION) & (phase[1:] == _INSERTION))

    @property
    def puncture(self) -> int | None:
        """The last sample before the first puncture; None without one."""
        return int(self.punctures[0]) if len(self.punctures) else None


@dataclass(frozen=True)
class OutputKind:
    """A quantity: its unit in SI, what it is, how it is found, and which tables of the study it needs."""

    unit: str
    meaning: str
    value: Callable[[Run, "Output"], Any]
    needs: tuple[str, ...] = ()


@dataclass(frozen=True)
class Output:
    """A quantity with its settings in SI: the depth at which it is wanted, points of a curve, limits."""

    quantity: str
    name: str
    depth: float
    points: int
    low: float | None
    high: float | None

    @property
    def kind(self) -> OutputKind:
        """What the quantity is."""
        return OUTPUTS[self.quantity]

    @property
    def is_curve(self) -> bool:
        """Whether it has several values for each insertion."""
        return self.quantity == "curve"

    @property
    def label(self) -> str:
        """Name and unit as on an axis."""
        unit = scale(1e-3, self.kind.unit)[1]
        return f"{self.name.replace('_', ' ')} [{unit or 1}]"

    @property
    def factor(self) -> float:
        """From SI to the unit shown."""
        return scale(1e-3, self.kind.unit)[0]


def output_of(section: Any) -> Output:
    """The output of a section of a study file."""
    depth = np.nan if section.depth_mm is None else 1e-3 * section.depth_mm
    named = section.quantity if section.depth_mm is None else f"{section.quantity}_{section.depth_mm:g}_mm"
    factor = scale(1e-3, OUTPUTS[section.quantity].unit)[0]
    low, high = (None if limit is None else limit / factor for limit in (section.low, section.high))
    return Output(
        quantity=section.quantity,
        name=section.name or named,
        depth=depth,
        points=section.points,
        low=low,
        high=high,
    )


def _puncture_depth(run: Run, output: Output) -> float:
    return np.nan if run.puncture is None else float(run.depth[run.puncture])


def _puncture_force(run: Run, output: Output) -> float:
    return np.nan if run.puncture is None else float(run.force[: run.puncture + 1].max())


def _force_at_depth(run: Run, output: Output) -> float:
    inwards = slice(0, run.deepest + 1)
    depth = run.depth[inwards]
    if not depth[0] <= output.depth <= depth[-1] + np.diff(depth).max(initial=0.0):  # known to one sample
        return np.nan
    return float(np.interp(output.depth, depth, run.force[inwards]))


def _friction_share(run: Run, output: Output) -> float:
    inwards = slice(0, run.deepest + 1)
    depth = run.depth[inwards]
    total = np.trapezoid(run.force[inwards], depth)
    return float(np.trapezoid(run.columns["friction"][inwards], depth) / total) if total else np.nan


def _curve(run: Run, output: Output) -> np.ndarray:
    inwards = slice(0, run.deepest + 1)
    depth = run.depth[inwards]
    return np.interp(np.linspace(depth[0], depth[-1], output.points), depth, run.force[inwards])


def _tip_deflection(run: Run, output: Output) -> float:
    return float(np.hypot(*run.columns["tip"][run.deepest, :2]))


def _target_error(run: Run, output: Output) -> float:
    return float(np.linalg.norm(run.columns["tip"][run.deepest] - 1e-3 * np.array(run.columns["target_mm"])))


OUTPUTS = {
    "peak_force": OutputKind("N", "largest force", lambda run, output: float(run.force.max())),
    "puncture_depth": OutputKind("m", "depth of the tip at the first puncture", _puncture_depth),
    "puncture_force": OutputKind("N", "largest force up to the first puncture", _puncture_force),
    "force_at_depth": OutputKind("N", "force at depth_mm in the insertion stroke", _force_at_depth),
    "withdrawal_force": OutputKind("N", "smallest force: the largest pull", lambda run, output: float(run.force.min())),
    "work": OutputKind(
        "J", "work over the whole motion", lambda run, output: float(np.trapezoid(run.force, run.depth))
    ),
    "friction_share": OutputKind("1", "friction's share of the work in the insertion stroke", _friction_share),
    "curve": OutputKind("N", "force at equal steps of depth in the insertion stroke", _curve),
    "tip_deflection": OutputKind("m", "tip across the axis at the deepest point", _tip_deflection, ("bending",)),
    "target_error": OutputKind("m", "distance of the tip from target_mm", _target_error, ("bending",)),
    "rests": OutputKind("1", "1 if a needle held in the device is proved to rest", None, ("device",)),
}
"""Quantity -> what it is."""
