# SPDX-License-Identifier: Apache-2.0
"""The page and the figure of a tension or compression test: readings and all laws, residuals below, tables."""

import math
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..bench_tests.laws import coefficient_names, nominal_stress
from ..bench_tests.stress_fit import MAX_MISFIT, MIN_WEIGHT, LawFit, StressFit, modulus_by_mode
from ..display.markup import Markup, element, join, listing, section, table
from ..display.quantities import DASH, percent, plain, quantity, scale
from ..identification.statistics.noise import INTERVAL, TWO_SIDED
from ..vocabulary import __version__
from .canvas import (
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
    drawing,
    panels,
    save_drawing,
)
from .frame import framed

LAW_HEAD = ("law", "weight", "Young's modulus", "misfit", "coefficients", "stable (Drucker) at stretches", "excluded")
HEIGHTS = 380.0, 380.0
NAMES = {
    "neo_hookean": "neo-Hookean", "mooney_rivlin": "Mooney-Rivlin", "yeoh": "Yeoh", "ogden_1": "Ogden, 1 term",
    "ogden_2": "Ogden, 2 terms", "ogden_3": "Ogden, 3 terms",
}  # fmt: skip
MAX_MARKS = 80  # readings of a curve; more are drawn as a line
_POINTS = 200  # of a drawn curve
_MARKS = "os^Dv"  # of several curves


def law_rows(fit: StressFit) -> list[tuple[str, ...]]:
    """Each law as text under ``LAW_HEAD``, the best first."""
    return [
        (
            NAMES.get(law.law, law.law),
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


def outcome(fit: StressFit, mode_assumed: bool = False) -> str:
    """The result in a sentence."""
    modes = ", ".join(dict.fromkeys(curve.mode for curve in fit.curves)) + " (assumed)" * mode_assumed
    return (
        f"E = {fit.young_modulus.shown} ({INTERVAL}, with the choice of the law), "
        f"{NAMES.get(fit.best.law, fit.best.law)}, {modes}; misfit {percent(fit.misfit)} of the largest stress"
        + f", above {percent(MAX_MISFIT)}"
        * (fit.misfit > MAX_MISFIT)
    )


def stress_figure(figure: Figure, sheet: Sheet, fit: StressFit) -> None:
    """Nominal stress over stretch with the curves of all laws, and their residuals below."""
    margins = {"left": 46.0, "down": 44.0}
    upper, lower = panels(figure, sheet, 2, 1, margins, sharex=True, height_ratios=(2.2, 1.0)).ravel()
    factor, unit = scale(max(float(np.abs(curve.stress).max()) for curve in fit.curves), "Pa")
    drawn = _draw_curves(upper, fit, factor)
    axis_names(upper, "", f"nominal stress [{unit}]")
    measured = [(curve.stretch, factor * curve.stress) for curve in fit.curves]
    labels = Labels(upper, [*measured, *(line for _, line in drawn)])
    for law, line in _labelled(drawn, fit):
        labels.on(NAMES.get(law.law, law.law), *line, _style(law, fit)["color"])
    for curve in fit.curves if len(fit.curves) > 1 else ():
        labels.at(curve.mode, float(curve.stretch[-1]), factor * float(curve.stress[-1]), SLATE)
    _draw_residuals(lower, fit)
    axis_names(lower, "stretch [1]", "residual [% of the largest stress]")


def _draw_curves(axes: Axes, fit: StressFit, factor: float) -> list[tuple[LawFit, tuple[np.ndarray, np.ndarray]]]:
    """Draw readings and laws; each law with its line, curve by curve, the best law first."""
    drawn = []
    for k, curve in enumerate(fit.curves):
        mark = _MARKS[k % len(_MARKS)]
        readings = {"color": SLATE, "mfc": "white", "mec": SLATE, "mew": 0.9, "ms": 3.5, "zorder": 3}
        dense = len(curve.stretch) > MAX_MARKS
        style = {"marker": "" if dense else mark, "ls": "-" if dense else "", "lw": 1.2}
        axes.plot(curve.stretch, factor * curve.stress, **readings, **style)
        stretch = np.linspace(min(curve.stretch.min(), 1.0), max(curve.stretch.max(), 1.0), _POINTS)
        for law in fit.laws:
            stress = factor * nominal_stress(law.law, stretch, law.coefficients, curve.mode)
            axes.plot(stretch, stress, **_style(law, fit))
            drawn.append((law, (stretch, stress)))
    stresses = np.concatenate([factor * curve.stress for curve in fit.curves] + [np.zeros(1)])
    axes.set_ylim(stresses.min() - 0.1 * np.ptp(stresses), stresses.max() + 0.12 * np.ptp(stresses))
    return drawn


def _labelled(drawn: list[tuple[LawFit, tuple]], fit: StressFit) -> list[tuple[LawFit, tuple]]:
    """The laws to label, on their line of the first curve: the best, comparable ones, and of a single curve those that
    differ visibly."""
    first = drawn[: len(fit.laws)]
    clear = 2.0 * max(fit.misfit, 0.005)
    return [
        (law, line)
        for law, line in first
        if law is fit.best or law.weight >= MIN_WEIGHT or (len(fit.curves) == 1 and law.misfit > clear)
    ]


def _style(law: LawFit, fit: StressFit) -> dict:
    """The line of a law: the best one strong, those that fit comparably in a second colour, the others grey."""
    if law is fit.best:
        return {"color": MODEL, "lw": THICK, "zorder": 4}
    if law.weight >= MIN_WEIGHT:
        return {"color": SECOND, "lw": 1.1, "ls": (0, (5, 2)), "zorder": 3.5}
    faint = 1.0 if len(fit.curves) == 1 else 0.4
    return {
        "color": QUIET if not law.excluded else MEASURED,
        "lw": THIN,
        "ls": (0, (2, 2)),
        "alpha": faint,
        "zorder": 2,
    }


def _draw_residuals(axes: Axes, fit: StressFit) -> None:
    """Residuals of the laws that fit comparably, in per cent of the largest stress."""
    peak = max(float(np.abs(curve.stress).max()) for curve in fit.curves)
    axes.axhline(0.0, color=QUIET, lw=0.6)
    ends = np.cumsum([len(curve.stretch) for curve in fit.curves])[:-1]
    for law in reversed([law for law in fit.laws if law is fit.best or law.weight >= MIN_WEIGHT]):
        for k, (curve, part) in enumerate(zip(fit.curves, np.split(100.0 * law.residual / peak, ends))):
            mark = _MARKS[k % len(_MARKS)] if len(part) <= MAX_MARKS else ""
            axes.plot(curve.stretch, part, marker=mark, ms=2.5, **_style(law, fit) | {"lw": 0.8})


def save_figure(fit: StressFit, path: str | Path) -> None:
    """Write the figure as SVG, PNG or PDF, by the ending. Raises InputError for another one."""
    save_drawing(Path(path), partial(stress_figure, fit=fit), HEIGHTS[0])


def stress_page(fit: StressFit, assumptions: Sequence[str] = (), mode_assumed: bool = False) -> str:
    """The page as HTML text: result, figure, laws, assumptions and limits."""
    names = ", ".join(curve.name for curve in fit.curves if curve.name)
    alt = "Nominal stress over stretch, measured and of each law; residuals below. The values are in the table."
    image = drawing("stress", partial(stress_figure, fit=fit), HEIGHTS, alt)
    caption = element(
        "figcaption",
        "Marks or dark line: readings. Thick: the best law. Blue, dashed: laws that fit comparably. Grey: the others. "
        "Below: measured minus fitted.",
    )
    others = modulus_by_mode(fit) if len(fit.curves) == 1 else {}
    modes = listing(f"{mode}: {plain(value, 'Pa')}" for mode, value in others.items())
    sections = [
        section(
            "Stress and stretch", element("figure", element("div", image, class_="drawing"), caption), name="curve"
        ),
        section("Laws", table(LAW_HEAD, law_rows(fit), class_="cards numbers dense"), _weights(), name="laws"),
        section("Assumptions and limits", listing([*assumptions, *fit.notes]), name="limits")
        if assumptions or fit.notes
        else None,
        section("The same slope in another loading mode", modes, name="modes") if others else None,
    ]
    kicker = f"needleforce {__version__} · tension and compression"
    title = f"Young's modulus: {names or 'stress-stretch curve'}"
    return framed(title, kicker, join([outcome(fit, mode_assumed), "."]), sections, links=False)


def _weights() -> Markup:
    return element(
        "p",
        "Weights are Akaike's, from the effective number of readings. The interval of the result is of the mixture "
        "of all laws by these weights; that of a law in the table is without the choice.",
        class_="note",
    )
