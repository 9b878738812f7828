# SPDX-License-Identifier: Apache-2.0
"""Whether a needle held in tissue comes to rest in a device's loop: a proof, a counterexample, or undecided."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..checks import instance_of
from ..display.quantities import plain
from ..display.result import Printed
from ..errors import InputError
from ..models.model import Model
from .device_loop import RANGES, SECONDS, Chatter, Device, growth, linear_limit, simulated_hold, stiffness_at_rest
from .rest_proof import GAMMAS, Loop

RESTS, OSCILLATES, UNDECIDED = "rests", "oscillates", "undecided"
GAIN_MARGIN = 2.0  # the usual gain margin of a control loop
SHARES_OF_LOAD, KICKS = (0.0, 0.9, 0.3), (0.0, 0.05, -0.05)  # of the sliding force; m/s
SEARCHED_CYCLES, LONGER = 12_000, 3.0  # at most, of a loop; an oscillation is confirmed over so many times the time
HEAD = ("quantity", "value", "meaning")


@dataclass(frozen=True, repr=False)
class RestResult(Printed):
    """Whether a model's needle comes to rest in a device's loop, and what would make it rest.

    Attributes
    ----------
    verdict : str
        ``"rests"`` is proved from any state; ``"oscillates"`` has a simulated counterexample; otherwise
        ``"undecided"``.
    reason : str
        A sentence.
    model, device : Model, Device
        As given.
    depth : float
        Largest depth considered [m].
    stiffness : float
        Largest stiffness of the tissue at rest, down to that depth [N/m], from the engine.
    max_stiffness : float
        Largest stiffness for which rest is proved [N/m].
    linear_limit : float
        Stiffness beyond which a mere spring oscillates in the loop [N/m].
    gamma : float
        The multiplier of the proof.
    stretch_factor : float
        Factor on the travels over which friction and cutting are loaded that is proved to rest; 1 if none is needed,
        infinite if none is enough.
    controller_damping : float
        Damping of the controller with which the model rests as it is [N s/m]; infinite if none is enough.
    margin : float
        Gain margin of both.
    counterexample : Chatter or None
        The oscillation that was found.
    """

    verdict: str
    reason: str
    model: Model
    device: Device
    depth: float
    stiffness: float
    max_stiffness: float
    linear_limit: float
    gamma: float
    stretch_factor: float
    controller_damping: float
    margin: float
    counterexample: Chatter | None

    def with_stretch(self) -> Model:
        """The model with the stretch that is proved to rest.

        Returns
        -------
        Model

        Raises
        ------
        InputError
            If no stretch within the laws' ranges is enough, with what else would help.
        """
        if math.isfinite(self.stretch_factor):
            return stretched(self.model, self.stretch_factor)
        fixed = stiffness_at_rest(stretched(self.model, math.inf), self.depth, self.device.cycle)
        limit = f"with all stretches at the end of their ranges, above the {self.max_stiffness:.3g} N/m that rest"
        step = "Reduce the lag and the delay, or hold the device with more damping."
        if math.isfinite(self.controller_damping):
            step = f"Give the controller a damping of {self.controller_damping:.3g} N s/m, or reduce lag and delay."
        raise InputError("stiffness of the tissue", f"{fixed:.3g} N/m", limit, self.device.name, step)

    @property
    def changes(self) -> list[tuple[str, float, float]]:
        """Every stretched parameter: name, present value and value of ``with_stretch()``, in SI; none without one."""
        if not math.isfinite(self.stretch_factor):
            return []
        pairs = zip(self.model._parts(), self.with_stretch()._parts())
        return [
            (f"{path}.{name}", value, new.parameters()[name])
            for (path, old), (_, new) in pairs
            for name, value in old.parameters().items()
            if new.parameters()[name] != value
        ]

    @property
    def rows(self) -> list[tuple[str, str, str]]:
        """Name, value and meaning of each quantity, as text."""
        factor, damping = self.stretch_factor, self.controller_damping
        rows = [
            ("stiffness", plain(self.stiffness, "N/m"), f"of the tissue at rest, down to {1e3 * self.depth:.3g} mm"),
            ("max_stiffness", plain(self.max_stiffness, "N/m"), "rest is proved up to here"),
            ("linear_limit", plain(self.linear_limit, "N/m"), "a mere spring oscillates beyond"),
            ("stretch_factor", f"{factor:.4g}" if math.isfinite(factor) else "none is enough", "proved to rest"),
            ("controller_damping", plain(damping, "N s/m") if math.isfinite(damping) else "none is enough", "instead"),
            ("margin", f"{self.margin:.3g}", "gain margin of stretch and damping"),
        ]
        if self.counterexample:
            start = f"load {self.counterexample.load_share:g} of sliding, {self.counterexample.kick:g} m/s"
            rows.append(("counterexample", str(self.counterexample), start))
        changed = [(path, f"{before:.4g} → {after:.4g}", "stretched, SI") for path, before, after in self.changes]
        return rows + changed

    def __repr__(self) -> str:
        return f"<RestResult: {self.model.name} in {self.device.name}: {self.verdict}>"

    def _heading(self) -> str:
        return f"{self.model.name} in {self.device.name}: {self.verdict}. {self.reason}"

    def _cells(self) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
        return HEAD, self.rows


def rest_in_loop(
    model: Model, device: Device, *, depth: float | None = None, margin: float = GAIN_MARGIN
) -> RestResult:
    """Decide whether a needle held in the tissue comes to rest in a device's loop, at any depth down to ``depth``.

    Parameters
    ----------
    model : Model
        The model in the loop.
    device : Device
        The device with its loop.
    depth : float, optional
        Largest depth of the tip [m], at most 0.5; the default is the needle's length, or twice the depth of the
        deepest puncture.
    margin : float
        Gain margin of the stretch and of the damping that are proposed, at least 1. Where no stretch reaches it, the
        result has the one that is reached.

    Returns
    -------
    RestResult

    Raises
    ------
    InputError
        If nothing in the loop takes energy out, or the device alone does not come to rest.
    """
    depth = _checked(model, device, depth, margin)
    gammas, weakening, gap = _applicable(model)
    proved, gamma = Loop.of(device).max_stiffness(weakening, gammas)
    if proved == 0.0:
        raise _unstable(device)
    stiffness = stiffness_at_rest(model, depth, device.cycle)
    enough = stiffness <= proved and not gap
    found = None if enough else counterexample(model, device, depth)
    verdict = RESTS if enough else OSCILLATES if found else UNDECIDED
    factor, margin = (math.inf, margin) if gap else _stretch(model, depth, device.cycle, (proved / margin, proved))
    return RestResult(
        verdict=verdict,
        reason=_reason(verdict, stiffness / proved, growth(device, stiffness), gap),
        model=model,
        device=device,
        depth=depth,
        stiffness=stiffness,
        max_stiffness=proved,
        linear_limit=linear_limit(device),
        gamma=gamma,
        stretch_factor=factor,
        controller_damping=math.inf if gap else _damping(device, stiffness * margin, weakening, gammas),
        margin=margin,
        counterexample=found,
    )


def _checked(model: Model, device: Device, depth: float | None, margin: float) -> float:
    instance_of("model", model, Model, "Give nf.preset(…) or nf.Model(…).")
    instance_of("device", device, Device, "Give Device(mass=…, damping=…).")
    if not 1.0 <= margin < math.inf:
        raise InputError("margin", margin, "below 1", next_step="Give the gain margin, such as 2.")
    if device.damping + device.controller_damping == 0.0:
        limit = "nothing takes out the energy that a force held over a cycle puts in: no stiffness comes to rest"
        step = "Give the damping of the device and of the hand that holds it, or controller_damping."
        raise InputError("device.damping", "0 N s/m", limit, next_step=step)
    if depth is None:
        return model.needle.length if model.needle else model._plotted_depth()
    if not 0.0 < depth <= 0.5:
        raise InputError("depth", f"{depth} m", "not above 0, or above 0.5 m", next_step="Give the depth in m.")
    return float(depth)


def _unstable(device: Device) -> InputError:
    if device.controller_damping:
        limit, step = (
            "too much for this lag and delay: the device alone oscillates",
            "Reduce it, or the lag and the delay.",
        )
        return InputError("device.controller_damping", f"{device.controller_damping:g} N s/m", limit, next_step=step)
    limit = "no stiffness is proved to rest"
    return InputError("device.damping", f"{device.damping:g} N s/m", limit, next_step="Reduce the lag and the delay.")


def _applicable(model: Model) -> tuple[tuple[float, ...], float, str]:
    """The multipliers that apply to the model's laws, the weakening [N/m], and why nothing is proved, if so."""
    laws = [law for layer in model.layers for law in (layer.friction, layer.cutting, layer.relaxation)]
    active = [law.name for law in laws if not law.is_passive]
    if active:
        return (1.0,), 0.0, f"Nothing is proved for {active[0]}, which may return energy"
    if all(law.is_monotone for law in laws):
        return GAMMAS, 2.0 * max(layer.friction.per_length for layer in model.layers), ""
    return (1.0,), 0.0, ""


def _reason(verdict: str, ratio: float, grows: float, gap: str) -> str:
    if verdict == RESTS:
        return f"Proved from any state: the tissue has {100 * ratio:.3g} % of the largest stiffness that comes to rest."
    cause = gap or f"The tissue is {ratio:.3g} times as stiff as what is proved to come to rest"
    if verdict == OSCILLATES:
        return f"{cause}; a simulated loop keeps oscillating."
    linear = "grow" if grows > 1.0 else "decay"
    return f"{cause}; no simulated loop keeps oscillating, and small motions of stuck tissue {linear}."


def stretched(model: Model, factor: float) -> Model:
    """The model with every elastic travel of friction and cutting longer by a factor, within the ranges of the laws:
    ``presliding``, ``bristle_stiffness``, ``unloading`` and stiffness of a cutting law. What is measured, the contact
    and the stiffness of dragged tissue, is not changed."""
    first, *deeper = [
        replace(each, friction=_longer(each.friction, factor), cutting=_longer(each.cutting, factor))
        for each in model.layers
    ]
    return model.replace(friction=first.friction, cutting=first.cutting, deeper=tuple(deeper))


def _longer(law: Any, factor: float) -> Any:
    values = law.parameters()
    for row in law.table():
        name = row["name"]
        grows = name in ("presliding", "unloading")
        if grows or name == "bristle_stiffness" or (name == "stiffness" and law.family == "cutting"):
            wanted = values[name] * factor if grows else values[name] / factor
            values[name] = min(max(wanted, row["low"]), row["high"])
    return type(law)(**values)


def _stretch(model: Model, depth: float, cycle: float, allowed: tuple[float, float]) -> tuple[float, float]:
    """The smallest factor, to 1 %, with which the stiffness is allowed, and its margin below the last value allowed."""

    def softened(factor: float) -> float:
        return stiffness_at_rest(stretched(model, factor), depth, cycle)

    softest = softened(math.inf)
    wanted = next((each for each in allowed if softest <= each), None)
    if wanted is None:
        return math.inf, allowed[1] / allowed[0]
    present = softened(1.0)
    low, high = 1.0, max(1.0, present / wanted)
    while softened(high) > wanted:
        low, high = high, 2.0 * high
    while high > 1.01 * low and present > wanted:
        middle = math.sqrt(low * high)
        low, high = (low, middle) if softened(middle) <= wanted else (middle, high)
    return high, allowed[1] / wanted


def _damping(device: Device, stiffness: float, weakening: float, gammas: tuple[float, ...]) -> float:
    """The smallest damping of the controller [N s/m], to 5 %, with which a stiffness rests; infinite if none does."""

    def allows(damping: float) -> bool:
        return Loop.of(device.replace(controller_damping=damping)).proposed(weakening, gammas)[0] > 1.001 * stiffness

    given = device.controller_damping
    if allows(given):
        return given
    scale = max(device.damping, 10.0 * device.mass)
    tried = [each for each in np.geomspace(1e-3, 1e3, 13) * scale if given < each <= RANGES["controller_damping"][2]]
    high = next((each for each in tried if allows(each)), math.inf)
    low = max((each for each in [given, *tried] if each < high), default=given)
    while high > 1.05 * low and math.isfinite(high):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if allows(middle) else (middle, high)
    proved = math.isfinite(high) and Loop.of(device.replace(controller_damping=high)).max_stiffness(weakening, gammas)
    return float(high) if proved and proved[0] >= stiffness else math.inf


def counterexample(model: Model, device: Device, depth: float) -> Chatter | None:
    """A simulated loop that keeps oscillating, the first one found over loads and kicks; None without one."""
    seconds = min(SECONDS, SEARCHED_CYCLES / device.rate)
    for kick in KICKS:
        for share in SHARES_OF_LOAD:
            start = {"load_share": share, "kick": kick}
            found = simulated_hold(model, device, depth, seconds=seconds, **start)
            longer = (
                simulated_hold(model, device, depth, seconds=LONGER * seconds, **start) if found.sustained else found
            )
            if longer.sustained and longer.force > 0.8 * found.force:
                return longer
    return None
