# SPDX-License-Identifier: Apache-2.0
"""The wrenches of a log: which of them to trust, what is missing between them, their bias, and the axial one."""

from collections.abc import Mapping

import numpy as np

from ...errors import InputError
from ...units import parse
from ..columns import AXES as KNOWN
from ..columns import dimension
from ..recording import Note
from ..stream import Stream
from .messages import Log, Mark, Messages

AXES = ("fx", "fy", "fz", "tx", "ty", "tz")


def trusted(log: Log, notes: list[Note]) -> Messages:
    """The wrenches without those whose status was a fault; notes tell how many, and of doubled ones."""
    if log.wrench.doubled:
        notes.append(Note("doubled", f"{log.wrench.doubled} wrenches came twice: once each", log.wrench.doubled))
    marked = [mark.facts.get("sequence") for mark in log.marks if mark.kind == "status"]
    faulty = [sequence & 0xFFFFFFFF for sequence in marked if isinstance(sequence, int)]
    wrong = np.isin(log.wrench.sequence % 2**32, np.array(faulty, np.int64)) if log.wrench.counted else np.zeros(
        len(log.wrench), bool)  # fmt: skip
    if wrong.any():
        count = int(wrong.sum())
        words = sorted({str(mark.facts.get("words", "")) for mark in log.marks if mark.kind == "status"})
        notes.append(Note("status", f"{count} wrenches had a fault ({'; '.join(words)[:200]}): left out", count))
    return log.wrench.kept(~wrong)


def told_losses(wrench: Messages, notes: list[Note]) -> None:
    """A note on the wrenches that never came, by the sensor's own counter and clock."""
    if not wrench.counted or len(wrench) < 2:
        return
    steps = np.diff(wrench.sequence)
    lost = int(steps.sum()) - len(steps)
    if lost:
        longest = 1e-9 * float(np.max(np.diff(wrench.device)[steps > 1]))
        share = 100.0 * lost / (lost + len(wrench))
        what = f"{lost} of {lost + len(wrench)} wrenches ({share:.3g} %) are not there, the longest gap is "
        notes.append(Note("lost", f"{what}{longest * 1e3:.4g} ms", lost))


def without_bias(wrench: Messages, marks: list[Mark], stream: Stream) -> np.ndarray:
    """The values (n, 6) less the bias marked last before each; what comes before the first mark has its bias."""
    biases = [(mark.arrival, bias) for mark in marks if mark.kind == "bias" for bias in [_six(mark.facts)] if bias]
    if not biases:
        return wrench.values
    arrivals, values = np.array([at for at, _ in biases]), np.array([bias for _, bias in biases])
    which = np.maximum(np.searchsorted(arrivals, wrench.arrival, "right") - 1, 0)
    told = ", ".join(f"{axis} {value:.6g}" for axis, value in zip(AXES, values[0]))
    stream.notes.append(Note("baseline", f"the bias measured before contact is removed: {told} N, N m", len(biases)))
    return wrench.values - values[which]


def axes_of(values: np.ndarray, chosen: str, units: Mapping[str, str], card: Mapping[str, str], stream: Stream):
    """Force and the other axes, in SI, from (n, 6): ``chosen`` is the axial one, such as ``fz`` or ``-fx``."""
    axial = chosen.removeprefix("-")
    if axial not in AXES[:3]:
        limit, advice = "known are fx, fy, fz, and with a minus", "Give --column force=fz, or the axis it is."
        raise InputError("axis of the force", repr(chosen[:40]), limit, stream.place, advice)
    there = card["axes"].split() if "axes" in card else AXES
    force = values[:, AXES.index(axial)] * (-1.0 if chosen.startswith("-") else 1.0)
    found = {"force": _in_si("force", force, units)}
    for index, name in enumerate(AXES):
        if name in KNOWN and name in there and name != axial:
            found[name] = _in_si(name, values[:, index], units)
    if axial != "fz":
        stream.notes.append(Note("left_out", "fz is left out: the name stands for the axial force"))
    return found


def _in_si(quantity: str, values: np.ndarray, units: Mapping[str, str]) -> np.ndarray:
    if quantity not in units:
        return values
    return parse(units[quantity], dimension(quantity), quantity).to_si(values)


def _six(facts: Mapping) -> list[float] | None:
    bias = facts.get("wrench")
    good = isinstance(bias, list) and len(bias) == 6 and all(isinstance(each, int | float) for each in bias)
    return [float(each) for each in bias] if good and np.isfinite(bias).all() else None
