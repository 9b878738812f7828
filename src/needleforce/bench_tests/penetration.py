# SPDX-License-Identifier: Apache-2.0
"""Penetration test of a needle: force over travel through a film or foil, and the figures of its report."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..display.axes import FORCE, TRAVEL
from ..display.canvas import MEASURED, MODEL
from ..display.quantities import counted, plain, quantity
from ..display.result import Result
from ..identification.statistics.noise import INTERVAL, TWO_SIDED
from .penetration_curve import (
    Curve,
    Plateau,
    check_options,
    curve_arrays,
    curve_of,
    insertion_stroke,
    line_errors,
    plateau,
    stretch,
    work_of,
)
from .penetration_peaks import peaks, steps
from .penetration_tops import Feature, top_of

if TYPE_CHECKING:
    import pandas

MIN_SAMPLES = 20  # of a curve
END_SAMPLES = 4  # over which a force still rises at the end of a curve
FALL_PASSED = 0.9  # of a fall, after which the force may be steady
FIGURES = {
    "contact_travel": ("m", "contact, in the recording's travel"),
    "entry_force": ("N", "peak at tip entry"),
    "entry_travel": ("m", "travel at tip entry"),
    "entry_fall": ("N", "fall after tip entry"),
    "entry_work": ("J", "work to tip entry"),
    "heel_force": ("N", "peak at the heel"),
    "heel_travel": ("m", "travel at the heel"),
    "drag": ("N", "plateau drag"),
    "drag_sd": ("N", "standard deviation of the drag"),
    "drag_min": ("N", "smallest drag"),
    "drag_max": ("N", "largest drag"),
    "max_force": ("N", "maximum force"),
    "max_travel": ("m", "travel at the maximum"),
    "work": ("J", "work"),
    "falls": ("1", "falls"),
    "largest_fall": ("N", "largest fall"),
}
"""Name of each figure -> unit and meaning."""


@dataclass(frozen=True, kw_only=True)
class Figure:
    """One figure of a penetration test.

    Parameters
    ----------
    name, unit, meaning : str
        As in ``FIGURES``; SI.
    value : float or None
        None if the curve does not show it.
    low, high : float or None
        95 % interval, from noise and rounding of force and travel; None without one. The force of a peak at which the
        sensor is saturated has only a ``low``, itself.
    reason : str
        Why there is no value; empty with one.
    """

    name: str
    unit: str
    meaning: str
    value: float | None = None
    low: float | None = None
    high: float | None = None
    reason: str = ""

    def __str__(self) -> str:
        if self.value is None:
            return "–"
        if self.unit == "1":
            return f"{self.value:g}"
        if self.low is None or self.high is None:
            return "at least " * (self.low is not None) + plain(self.value, self.unit)
        return str(quantity(self.value, self.low, self.high, self.unit))


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class PenetrationTest(Result):
    """The figures of one needle.

    Parameters
    ----------
    name : str
        Of the needle.
    figures : dict of str to Figure
        By the names in ``FIGURES``; those that the curve does not show have no value, but a reason.
    features : tuple of Feature
        All peaks and steps, in order of travel: tip entry, heel, further ones.
    plateau : Plateau or None
        The steady end.
    travel, force : (n,) array
        The insertion stroke: travel [m] from the contact, or from the first sample of a curve that begins in contact,
        and force [N] above that of the free travel.
    noise : float
        Standard deviation of a reading [N].
    notes : tuple of str
        What was assumed and found.
    """

    name: str
    figures: dict[str, Figure]
    features: tuple[Feature, ...] = ()
    plateau: Plateau | None = None
    travel: np.ndarray = field(default_factory=lambda: np.empty(0))
    force: np.ndarray = field(default_factory=lambda: np.empty(0))
    noise: float = 0.0
    notes: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> Figure:
        return self.figures[name]

    @property
    def empty(self) -> bool:
        """Whether there is no figure at all."""
        return not len(self.travel)

    def __repr__(self) -> str:
        known = [
            f"{name} {self[name]}" for name in ("entry_force", "drag", "max_force") if self[name].value is not None
        ]
        return f"<PenetrationTest {self.name}: {', '.join(known) or self['max_force'].reason}>"

    def _heading(self) -> str:
        return f"Penetration test {self.name}"

    def _cells(self) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
        rows = [(each.meaning, str(each), each.reason) for each in self.figures.values()]
        return ("figure", f"value, {INTERVAL}", "not given because"), rows

    def _remarks(self) -> Iterable[tuple[str, Iterable[str]]]:
        yield "Notes", self.notes

    def _draw(self, axes: Any) -> tuple[str, ...]:
        """Force over travel with peaks and plateau."""
        axes.plot(1e3 * self.travel, self.force, color=MEASURED, lw=0.9)
        places = [each.travel for each in self.features], [each.force for each in self.features]
        axes.plot(1e3 * np.array(places[0]), places[1], "o", color=MODEL, label="peaks and steps" if places[0] else "")
        if self.plateau is not None:
            ends, drag = 1e3 * np.array([self.plateau.start, self.plateau.stop]), [self.plateau.mean] * 2
            axes.plot(ends, drag, color=MODEL, lw=2.2, label="plateau drag")
        return TRAVEL, FORCE, self.name

    def document(self) -> dict:
        """The numbers for JSON: figures, peaks and plateau."""
        return {
            "figures": [asdict(each) for each in self.figures.values()],
            "peaks": [asdict(each) for each in self.features],
            "plateau": None if self.plateau is None else asdict(self.plateau),
            "noise_N": self.noise,
            "notes": list(self.notes),
        }

    def to_dataframe(self) -> "pandas.DataFrame":
        """A pandas DataFrame with a row for each figure, indexed by name."""
        import pandas

        return pandas.DataFrame([asdict(each) for each in self.figures.values()]).set_index("name")


def penetration_test(
    travel: Any,
    force: Any = None,
    *,
    name: str = "",
    work_to: float | None = None,
    plateau_travel: tuple[float, float] | None = None,
    min_fall: float = 0.0,
    tips: int = 1,
    baseline: bool = True,
) -> PenetrationTest:
    """The figures of a penetration test of one needle, from force over travel at constant speed.

    Parameters
    ----------
    travel : (n,) array, float or Recording
        Travel of the needle [m] in order of time, increasing inwards; one number is the constant travel from sample to
        sample; a Recording has both columns.
    force : (n,) array
        Axial force [N], positive against the insertion. Rows that are not numbers are left out.
    name : str
        Of the needle.
    work_to : float, optional
        Travel [m] up to which the work is given, from the contact, or from the first sample of a curve that begins in
        contact; default: the whole insertion.
    plateau_travel : tuple of float, optional
        First and last travel [m] of the drag, counted likewise, as a test procedure may state it; by default the
        longest steady stretch at the end.
    min_fall : float
        Falls of less [N] are not counted, nor are steps; default: all that the noise does not explain.
    tips : int
        Number of tips that enter; of several the next peak after the entry is not called that of the heel.
    baseline : bool
        Subtract the mean force of the free travel; False keeps the recorded zero.

    Returns
    -------
    PenetrationTest
        A figure that the curve does not show is None, with a reason.

    Raises
    ------
    InputError
        Arrays of unequal length, infinite values, samples in no order, or an option out of range.

    Notes
    -----
    docs/reference/penetration_figures.md defines them. Conformity to a standard is not claimed.
    """
    check_options(work_to, plateau_travel, min_fall, tips)
    name, travel, force, notes = curve_arrays(travel, force, name)
    z, f, remarks = insertion_stroke(travel, force)
    notes += remarks
    if len(z) < MIN_SAMPLES:
        many = "no values" if not len(travel) else counted(len(z), "sample") + " of the insertion"
        return without_figures(name, f"The curve has {many}; at least {MIN_SAMPLES} are needed.", notes)
    if not np.ptp(f) > 0.0:
        return without_figures(name, "The force is constant: nothing is penetrated.", notes)
    return _Analysis(name, curve_of(z, f, notes, baseline=baseline)).result(work_to, plateau_travel, min_fall, tips)


def without_figures(name: str, reason: str, notes: tuple[str, ...] = ()) -> PenetrationTest:
    """A needle without a curve, such as a broken one: every figure is None for the same reason."""
    none = {each: Figure(name=each, unit=unit, meaning=text, reason=reason) for each, (unit, text) in FIGURES.items()}
    return PenetrationTest(name=name, figures=none, notes=notes)


class _Analysis:
    """The figures of one curve."""

    def __init__(self, name: str, curve: Curve):
        self.name, self.curve, self.notes = name, curve, list(curve.notes)
        self.travel, self.force, self.noise = curve.travel, curve.force, curve.noise
        self.figures: dict[str, Figure] = {}

    def result(
        self, work_to: float | None, wanted: tuple[float, float] | None, min_fall: float, tips: int
    ) -> PenetrationTest:
        """All figures; the options are those of ``penetration_test``."""
        curve, start = (self.travel, self.force, self.noise), self.curve.start
        # before the contact a force is that of the machine, such as at its start
        found = [each for each in peaks(*curve) if each.fall >= min_fall and each.index >= start]
        bends = [each for each in steps(*curve, found) if each.index >= start and not min_fall]
        features = sorted(found + bends, key=lambda each: each.travel)
        steady, why = self._plateau(features, wanted)
        if self.curve.contact is None:
            self._none("contact_travel", "The curve begins in contact.")
        else:
            error = self.curve.contact_error + self.curve.rounding
            self._put("contact_travel", self.curve.contact, self.curve.contact - error, self.curve.contact + error)
        self._entry(features, min_fall)
        self._heel(features, steady, tips)
        self._drag(steady, why)
        self._maximum(features)
        self._work("work", float(self.travel[-1]) if work_to is None else work_to)
        self._falls(found)
        return PenetrationTest(
            name=self.name,
            figures={name: self.figures[name] for name in FIGURES},
            features=tuple(features),
            plateau=steady,
            travel=self.travel,
            force=self.force,
            noise=self.noise.of_mean(1),
            notes=tuple(self.notes),
        )

    def _put(self, name: str, value: float, low: float | None = None, high: float | None = None) -> None:
        unit, meaning = FIGURES[name]
        self.figures[name] = Figure(name=name, unit=unit, meaning=meaning, value=value, low=low, high=high)

    def _none(self, names: str, reason: str) -> None:
        for name in names.split():
            unit, meaning = FIGURES[name]
            self.figures[name] = Figure(name=name, unit=unit, meaning=meaning, reason=reason)

    def _force(self, name: str, value: float, low: float, high: float) -> None:
        """A force with the error of its zero in the interval; of a saturated sensor it is a lower bound."""
        if value > self.curve.limit - TWO_SIDED * self.noise.of_mean(1):
            self._put(name, self.curve.limit, self.curve.limit)
            return
        zero = TWO_SIDED * self.curve.zero_error
        below, above = ((part * part + zero * zero) ** 0.5 for part in (value - low, high - value))
        self._put(name, value, value - below, value + above)

    def _place(self, name: str, each: Feature) -> None:
        error = self.curve.rounding + self.curve.contact_error
        self._put(name, each.travel, each.travel_low - error, each.travel_high + error)

    def _entry(self, features: list[Feature], min_fall: float) -> None:
        if not features:
            why = "The force never falls by more than its noise explains, and its slope falls nowhere at once."
            if min_fall:
                why = f"The force never falls by {plain(min_fall, 'N')}, the smallest fall that is to count."
            self._none("entry_force entry_travel entry_fall entry_work", why)
            return
        entry = features[0]
        self._force("entry_force", entry.force, entry.low, entry.high)
        self._place("entry_travel", entry)
        if entry.kind == "peak":
            self._put("entry_fall", entry.fall, entry.fall_low, entry.fall_high)
        else:
            self._none("entry_fall", "The entry is a step: the slope falls, the force does not.")
        self._work("entry_work", entry.travel)

    def _heel(self, features: list[Feature], steady: Plateau | None, tips: int) -> None:
        heel = features[1] if len(features) > 1 else None
        reason = ""
        if tips > 1:
            reason = f"Of {tips} tips the peaks after the first are entries of others."
        elif heel is None:
            reason = "No second peak or step is above the noise." if features else "No tip entry is above the noise."
        elif steady is not None and heel.travel >= steady.start:
            reason = "The next peak lies within the steady part."
        if reason or heel is None:
            self._none("heel_force heel_travel", reason)
            return
        self._force("heel_force", heel.force, heel.low, heel.high)
        self._place("heel_travel", heel)

    def _plateau(self, features: list[Feature], wanted: tuple[float, float] | None) -> tuple[Plateau | None, str]:
        """The steady end, or that within the ``wanted`` travel; otherwise None and why."""
        if wanted is not None:
            first, last = np.searchsorted(self.travel, wanted[0]), np.searchsorted(self.travel, wanted[1], side="right")
            if wanted[1] > self.travel[-1] + self.curve.rounding or last - first < 3:
                end = plain(float(self.travel[-1]), "m")
                return None, f"The curve ends at {end}, before the end of the stated travel of the drag."
            part = slice(int(first), int(last))
            error = line_errors(self.travel[part], self.force[part])[2]
            return stretch(self.travel, self.force, int(first), int(last), error), ""
        if not features:
            return None, "No tip entry is above the noise: the friction of a shaft in the film is not shown."
        found = plateau(self.travel, self.force, self._left(features[-1]))
        if found is None and len(features) > 1:  # the last peaks may belong to the friction itself
            found = plateau(self.travel, self.force, self._left(features[0]))
        return (
            found,
            "" if found else "The force is not steady at the end of the travel: the curve ends before a plateau.",
        )

    def _left(self, each: Feature) -> int:
        """The sample by which the force has left a peak: nine tenths of its fall are behind."""
        low = self.force[each.index : each.end + 1] < each.force - FALL_PASSED * each.fall
        return each.index + int(low.argmax()) if low.any() else each.index

    def _drag(self, steady: Plateau | None, why: str) -> None:
        if steady is None:
            self._none("drag drag_sd drag_min drag_max", why)
            return
        # a slope within its error moves the level at the end by up to twice the error of the mean
        error = 2.0 * TWO_SIDED * max(steady.error, self.noise.quantum / 12**0.5 if self.noise.coarse else 0.0)
        self._force("drag", steady.mean, steady.mean - error, steady.mean + error)
        self._put("drag_sd", steady.sd)
        self._put("drag_min", steady.smallest)
        self._put("drag_max", steady.largest)

    def _maximum(self, features: list[Feature]) -> None:
        index, last = int(self.force.argmax()), len(self.force) - 1
        known = (each for each in features if each.kind == "peak" and each.reading >= self.force[index])
        top = next(known, None) or top_of(self.travel, self.force, self.noise, index=index, width=1, first=0, last=last)
        growth = 0.0
        if top.travel >= self.travel[-1]:
            self.notes.append("The force is largest at the end of the travel.")
            # the test may have ended up to a sample later
            growth = max(float(self.force[last] - self.force[last - END_SAMPLES]), 0.0) / END_SAMPLES
        self._force("max_force", top.force, top.low, top.high + growth)
        self._place("max_travel", top)

    def _work(self, name: str, end: float) -> None:
        """The work from zero to the travel ``end``."""
        last = float(self.travel[-1])
        if end > last + self.curve.rounding + 1e-12:
            self._none(name, f"The curve ends at {plain(last, 'm')}, before the stated travel of the work.")
            return
        work, error = work_of(self.curve, end)
        self._put(name, work, work - error, work + error)

    def _falls(self, found: list[Feature]) -> None:
        self._put("falls", float(len(found)))
        if not found:
            self._none("largest_fall", "The force never falls by more than its noise explains.")
            return
        largest = max(found, key=lambda each: each.fall)
        self._put("largest_fall", largest.fall, largest.fall_low, largest.fall_high)
