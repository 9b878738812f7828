# SPDX-License-Identifier: Apache-2.0
"""The result of a tension or compression test: the laws that were fitted, the modulus, and its page."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..display.canvas import (
    MEASURED,
    MODEL,
    QUIET,
    SECOND,
    SLATE,
    THICK,
    THIN,
    Labels,
    Sheet,
    axis_names,
    panels,
    save_drawing,
)
from ..display.markup import listing, table
from ..display.page import Figure, Page, note, section
from ..display.quantities import DASH, percent, plain, quantity, scale
from ..identification.estimates import Estimate, EstimateResult
from ..identification.statistics.evidence import Departure
from ..identification.statistics.noise import INTERVAL, TWO_SIDED
from .law_fit import LawFit, StressCurve
from .laws import MODES, coefficient_names, initial_stiffness, mode_number, nominal_stress

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Drawing

MAX_MISFIT = 0.05  # [of the peak stress] rms residual above which a warning is given
MIN_WEIGHT = 0.05  # a law with a smaller weight does not fit comparably
STRETCH = "stretch [1]"
LAW_HEAD = ("law", "weight", "Young's modulus", "misfit", "coefficients", "stable (Drucker) at stretches", "excluded")
NAMES = {
    "neo_hookean": "neo-Hookean", "mooney_rivlin": "Mooney-Rivlin", "yeoh": "Yeoh", "ogden_1": "Ogden, 1 term",
    "ogden_2": "Ogden, 2 terms", "ogden_3": "Ogden, 3 terms",
}  # fmt: skip
HEIGHTS = 380.0, 380.0
MAX_MARKS = 80  # readings of a curve; more are drawn as a line
_POINTS = 200  # of a drawn curve
_MARKS = "os^Dv"  # of several curves
CAPTION = (
    "Marks or dark line: readings. Thick: the best law. Blue, dashed: laws that fit comparably. Grey: the others. "
    "Below: measured minus fitted."
)
WEIGHTS = (
    "Weights are Akaike's, from the effective number of readings. The interval of the result is of the mixture of all "
    "laws by these weights; that of a law in the table is without the choice."
)


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class StressFit(EstimateResult):
    """The laws fitted to one material, the best first, and its initial Young modulus.

    Attributes
    ----------
    laws : tuple of LawFit
        By weight; excluded laws last.
    young_modulus : Estimate
        E [Pa] of the best law. Its interval is that of the mixture of all laws by their weights.
    curves : tuple of StressCurve
        The readings used, in the order of stretch; means of neighbours if there are more than three hundred.
    effective_readings : float
        How many independent readings the correlated ones count for.
    zeros : tuple of float
        Zero of the stress of each curve [Pa], where it is part of the fit.
    departure : Departure
        The slow part of the residual over the noise of the readings, and what noise alone gives once in 1000 curves.
    notes : tuple of str
        Assumptions and limits, in sentences.
    """

    laws: tuple[LawFit, ...]
    young_modulus: Estimate
    curves: tuple[StressCurve, ...]
    effective_readings: float
    zeros: tuple[float, ...] = ()
    departure: Departure
    notes: tuple[str, ...]

    @property
    def best(self) -> LawFit:
        """The law with the largest weight."""
        return self.laws[0]

    @property
    def misfit(self) -> float:
        """Root mean square residual of the best law over the largest stress [1]."""
        return self.best.misfit

    @property
    def by_start(self) -> bool:
        """Whether the modulus is the slope at the start, which no law describes."""
        return self.young_modulus.value != self.best.young_modulus

    def predict(self, stretch: ArrayLike, mode: str = "uniaxial") -> np.ndarray:
        """Nominal stress [Pa] of the best law at ``stretch`` (any shape) [1]."""
        return nominal_stress(self.best.law, stretch, self.best.coefficients, mode)

    @property
    def estimates(self) -> tuple[Estimate, ...]:
        """``tissue_young_modulus`` [Pa]."""
        return (self.young_modulus,)

    def headline(self, mode_assumed: bool = False) -> str:
        """The result in a sentence; ``mode_assumed`` is whether the loading mode was."""
        modes = ", ".join(dict.fromkeys(curve.mode for curve in self.curves)) + " (assumed)" * mode_assumed
        modulus = self.young_modulus
        found = f"E = {modulus.shown} ({INTERVAL}, with the choice of the law), {law_name(self.best)}"
        if self.by_start:
            found = f"E = {modulus.shown} ({INTERVAL}), by the slope at the start"
        if not math.isfinite(modulus.high - modulus.low):
            found = f"E is not determined ({law_name(self.best)}: {plain(modulus.value, 'Pa')})"
        return (
            f"{found}, {modes}; misfit of {law_name(self.best)} {percent(self.misfit)} of the largest stress"
            + f", above {percent(MAX_MISFIT)}" * (self.misfit > MAX_MISFIT)
            + "".join(f"; fitted zero of the stress {plain(zero, 'Pa')}" for zero in self.zeros)
        )

    def _heading(self) -> str:
        return self.headline()

    def _cells(self) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
        return LAW_HEAD, law_rows(self)

    def _draw(self, axes: Any) -> tuple[str, ...]:
        """Nominal stress over stretch with the curves of all laws."""
        factor, unit = stress_scale(self.curves)
        draw_curves(axes, self.laws, self.curves, factor)
        return STRETCH, f"nominal stress [{unit}]"

    def document(self) -> dict:
        """The numbers for JSON: modulus and laws."""
        return {
            "modes": [curve.mode for curve in self.curves],
            "readings": [len(curve.stress) for curve in self.curves],
            "effective_readings": self.effective_readings,
            **super().document(),
            "law": self.best.law,
            "misfit": self.misfit,
            "residual_over_noise": self.departure.ratio**0.5,
            "zeros_Pa": list(self.zeros),
            "laws": [_law_document(law) for law in self.laws],
            "notes": list(self.notes),
        }

    def _page(self, assumptions: Sequence[str] = (), mode_assumed: bool = False) -> Page:
        """The page; ``assumptions`` are those of reading the file."""
        names = ", ".join(curve.name for curve in self.curves if curve.name)
        figure = Figure(
            name="stress",
            draw=partial(stress_figure, laws=self.laws, curves=self.curves),
            heights=HEIGHTS,
            caption=CAPTION,
            alt="Nominal stress over stretch, measured and of each law; residuals below. The values are in the table.",
        )
        others = modulus_by_mode(self) if len(self.curves) == 1 else {}
        modes = listing(f"{mode}: {plain(value, 'Pa')}" for mode, value in others.items())
        laws = table(LAW_HEAD, law_rows(self), class_="cards numbers dense")
        return Page(
            title=f"Young's modulus: {names or 'stress-stretch curve'}",
            kind="tension and compression",
            outcome=f"{self.headline(mode_assumed)}.",
            sections=[
                section("Stress and stretch", figure, name="curve"),
                section("Laws", laws, note(WEIGHTS), name="laws"),
                section("Assumptions and limits", listing([*assumptions, *self.notes]), name="limits"),
                section("The same slope in another loading mode", modes, name="modes"),
            ],
            links=False,
        )

    def save_figure(self, path: str | Path) -> None:
        """Write the figure as SVG, PNG or PDF, by the ending. Raises InputError for another one."""
        save_drawing(Path(path), partial(stress_figure, laws=self.laws, curves=self.curves), HEIGHTS[0])


def _law_document(law: LawFit) -> dict:
    return {
        "law": law.law,
        "coefficients": dict(zip(coefficient_names(law.law), law.coefficients.tolist(), strict=True)),
        "young_modulus_Pa": law.young_modulus,
        "standard_error_Pa": law.standard_error,
        "misfit": law.misfit,
        "criterion": law.criterion,
        "weight": law.weight,
        "stable_stretch": {mode: list(ends) for mode, ends in law.stable.items()},
        "excluded": law.excluded,
    }


def law_name(law: LawFit) -> str:
    """The law's name as it is written."""
    return NAMES.get(law.law, law.law)


def stress_scale(curves: Sequence[StressCurve]) -> tuple[float, str]:
    """The factor from Pa to the unit in which the stresses are shown, and that unit."""
    return scale(max(float(np.abs(curve.stress).max()) for curve in curves), "Pa")


def law_rows(fit: StressFit) -> list[tuple[str, ...]]:
    """Each law as text under ``LAW_HEAD``, the best first."""
    return [
        (
            law_name(law),
            percent(law.weight) if law.weight >= 0.001 else "<0.1 %" if not law.excluded else DASH,
            str(quantity(law.young_modulus, *_limits(law), "Pa")),
            percent(law.misfit),
            _coefficients(law),
            _stable(law),
            law.excluded,
        )
        for law in fit.laws
    ]


def _limits(law: LawFit) -> tuple[float, float]:
    half = TWO_SIDED * law.standard_error if math.isfinite(law.standard_error) and not law.excluded else math.nan
    return law.young_modulus - half, law.young_modulus + half


def _coefficients(law: LawFit) -> str:
    units = ("1" if name.startswith("alpha") else "Pa" for name in coefficient_names(law.law))
    pairs = zip(coefficient_names(law.law), law.coefficients, units, strict=True)
    return ", ".join(f"{name} {plain(float(value), unit)}" for name, value, unit in pairs)


def _stable(law: LawFit) -> str:
    """The stretches between which the law is stable, for each mode."""
    texts = []
    for mode, (low, high) in law.stable.items():
        ends = [f"from {low:.3g}"] * (low > 0.0) + [f"to {high:.3g}"] * bool(np.isfinite(high))
        texts.append(f"{mode}: " * (len(law.stable) > 1) + (" ".join(ends) or "all tested"))
    return "; ".join(texts)


def modulus_by_mode(fit: StressFit) -> dict[str, float]:
    """E [Pa] that the same initial slope of one curve means in each loading mode."""
    slope = fit.young_modulus.value * float(initial_stiffness(mode_number(fit.curves[0].mode)))
    return {mode: slope / float(initial_stiffness(t)) for mode, t in MODES.items()}


def stress_figure(figure: "Drawing", sheet: Sheet, laws: Sequence[LawFit], curves: Sequence[StressCurve]) -> None:
    """Nominal stress over stretch with the curves of all laws, and their residuals below."""
    margins = {"left": 46.0, "down": 44.0}
    upper, lower = panels(figure, sheet, 2, 1, margins, sharex=True, height_ratios=(2.2, 1.0)).ravel()
    factor, unit = stress_scale(curves)
    drawn = draw_curves(upper, laws, curves, factor)
    axis_names(upper, "", f"nominal stress [{unit}]")
    measured = [(curve.stretch, factor * curve.stress) for curve in curves]
    labels = Labels(upper, [*measured, *(line for _, line in drawn)])
    for law, line in _labelled(drawn, laws, curves):
        labels.on(law_name(law), *line, _style(law, laws, len(curves))["color"])
    for curve in curves if len(curves) > 1 else ():
        labels.at(curve.mode, float(curve.stretch[-1]), factor * float(curve.stress[-1]), SLATE)
    _draw_residuals(lower, laws, curves)
    axis_names(lower, STRETCH, "residual [% of the largest stress]")


def draw_curves(
    axes: "Axes", laws: Sequence[LawFit], curves: Sequence[StressCurve], factor: float
) -> list[tuple[LawFit, tuple[np.ndarray, np.ndarray]]]:
    """Draw readings and laws; each law with its line, curve by curve, the best law first."""
    drawn = []
    for k, curve in enumerate(curves):
        mark = _MARKS[k % len(_MARKS)]
        readings = {"color": SLATE, "mfc": "white", "mec": SLATE, "mew": 0.9, "ms": 3.5, "zorder": 3}
        dense = len(curve.stretch) > MAX_MARKS
        style = {"marker": "" if dense else mark, "ls": "-" if dense else "", "lw": 1.2}
        axes.plot(curve.stretch, factor * curve.stress, **readings, **style)
        stretch = np.linspace(min(curve.stretch.min(), 1.0), max(curve.stretch.max(), 1.0), _POINTS)
        for law in laws:
            stress = factor * nominal_stress(law.law, stretch, law.coefficients, curve.mode)
            axes.plot(stretch, stress, **_style(law, laws, len(curves)))
            drawn.append((law, (stretch, stress)))
    stresses = np.concatenate([factor * curve.stress for curve in curves] + [np.zeros(1)])
    axes.set_ylim(stresses.min() - 0.1 * np.ptp(stresses), stresses.max() + 0.12 * np.ptp(stresses))
    return drawn


def _labelled(
    drawn: list[tuple[LawFit, tuple]], laws: Sequence[LawFit], curves: Sequence[StressCurve]
) -> list[tuple[LawFit, tuple]]:
    """The laws to label, on their line of the first curve: the best, comparable ones, and of a single curve those that
    differ visibly."""
    first = drawn[: len(laws)]
    clear = 2.0 * max(laws[0].misfit, 0.005)
    return [
        (law, line)
        for law, line in first
        if law is laws[0] or law.weight >= MIN_WEIGHT or (len(curves) == 1 and law.misfit > clear)
    ]


def _style(law: LawFit, laws: Sequence[LawFit], curves: int) -> dict:
    """The line of a law: the best one strong, those that fit comparably in a second colour, the others grey."""
    if law is laws[0]:
        return {"color": MODEL, "lw": THICK, "zorder": 4}
    if law.weight >= MIN_WEIGHT:
        return {"color": SECOND, "lw": 1.1, "ls": (0, (5, 2)), "zorder": 3.5}
    faint = 1.0 if curves == 1 else 0.4
    return {
        "color": QUIET if not law.excluded else MEASURED,
        "lw": THIN,
        "ls": (0, (2, 2)),
        "alpha": faint,
        "zorder": 2,
    }


def _draw_residuals(axes: "Axes", laws: Sequence[LawFit], curves: Sequence[StressCurve]) -> None:
    """Residuals of the laws that fit comparably, in per cent of the largest stress."""
    peak = max(float(np.abs(curve.stress).max()) for curve in curves)
    axes.axhline(0.0, color=QUIET, lw=0.6)
    ends = np.cumsum([len(curve.stretch) for curve in curves])[:-1]
    for law in reversed([law for law in laws if law is laws[0] or law.weight >= MIN_WEIGHT]):
        for k, (curve, part) in enumerate(zip(curves, np.split(100.0 * law.residual / peak, ends))):
            mark = _MARKS[k % len(_MARKS)] if len(part) <= MAX_MARKS else ""
            axes.plot(curve.stretch, part, marker=mark, ms=2.5, **_style(law, laws, len(curves)) | {"lw": 0.8})
