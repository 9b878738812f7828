# SPDX-License-Identifier: Apache-2.0
"""Loading curves up to the first puncture, ranked over real recordings made by others.

    python benchmarks/loading_curves.py [--figure FILE.svg]

Every law is fitted to the same samples with its own contact depth. Files are repeats of one condition if their names
differ only in the number of the repeat and the date. Prints tables in Markdown.
"""

import argparse
import re
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.progress import track

import needleforce as nf
from needleforce.identification.compare import correlated
from needleforce.identification.one_layer.deformation_fit import fit_deformation
from needleforce.identification.one_layer.fit_recording import loading_samples
from needleforce.identification.one_layer.loading_curves import CURVES
from needleforce.identification.statistics.noise import noise_of
from needleforce.identification.statistics.regression import independent_samples
from needleforce.identification.strokes import strokes_of

LAWS, REFERENCE = tuple(CURVES), "cone_cylinder"
PERCENTILES, SHARES = (10, 50, 90), (1.0, 0.9, 0.8)
CONTACT_MARGIN_M, MIN_FREE_SAMPLES = 0.3e-3, 50  # kept clear before the contact; least free travel for its noise
CLOSE_BIC = 6  # odds of 20 to 1, "strong" in Kass & Raftery (1995)


@dataclass(frozen=True)
class Loading:
    """One recording: its condition; BIC, BIC of correlated samples and residual / peak by law; exponent; n_eff / n.

    ``noise`` is the sd of the free travel over the residual rms of ``REFERENCE``, ``correlation_length`` is in samples;
    NaN with less than ``MIN_FREE_SAMPLES`` of free travel.
    """

    condition: str
    bic: dict[str, float]
    correlated: dict[str, float]
    residual: dict[str, float]
    exponent: float
    independent: float
    noise: float
    correlation_length: float


def insertions(folder: Path) -> tuple[list[tuple], Counter]:
    """Condition, depth, force and contact depth of every loading curve in a folder, and file counts by status."""
    found, outcomes = [], Counter()
    for path in sorted(folder.glob("*.csv")):
        try:
            recording = nf.read(path)
        except nf.InputError:
            outcomes["unreadable"] += 1
            continue
        events = nf.segment(recording)
        outcomes[str(events.status)] += 1
        if events.punctures:
            strokes = strokes_of(recording, events)
            before = loading_samples(recording, strokes, events)
            place = events.contact.depth
            found.append((condition(path.stem), strokes.depth_in[before], strokes.force_in[before], place))
    return found, outcomes


def loadings(curves: list[tuple], share: float) -> list[Loading]:
    """Every curve fitted with every law, up to a share of its indentation."""
    found = []
    for name, depth, force, contact in track(curves, f"{share:.0%}", disable=not sys.stderr.isatty()):
        end = int(np.argmax(depth >= contact + share * (depth[-1] - contact))) + 1
        try:
            fits = {law: fit_deformation(depth[:end], force[:end], contact, law) for law in LAWS}
        except nf.InputError as error:
            print(f"{name}: {error}")
            continue
        found.append(loading(name, fits, force[:end][depth[:end] < contact - CONTACT_MARGIN_M]))
    return found


def condition(stem: str) -> str:
    """The name without the repeat's number and the date."""
    return re.sub(r"(_\d+)?_\d{4}-\d\d-\d\d.*$", "", stem)


def loading(name: str, fits: dict, free: np.ndarray) -> Loading:
    quiet = noise_of(free - free.mean(), len(free), 1, 1.0) if len(free) >= MIN_FREE_SAMPLES else None
    rms = fits[REFERENCE].nrmse * fits[REFERENCE].peak
    samples = independent_samples([fit.noise for fit in fits.values()])
    return Loading(
        name,
        {law: fit.bic for law, fit in fits.items()},
        correlated(fits),
        {law: fit.nrmse for law, fit in fits.items()},
        fits["power_law"].values["exponent"],
        samples / fits[REFERENCE].noise.count,
        quiet.variance**0.5 / rms if quiet else np.nan,
        quiet.long_run / quiet.variance if quiet else np.nan,
    )


def by_condition(curves: list[Loading], which: str) -> list[dict[str, float]]:
    """BIC by law, the mean over the repeats of each condition."""
    groups: dict[str, list] = {}
    for each in curves:
        groups.setdefault(each.condition, []).append(getattr(each, which))
    return [{law: float(np.mean([bic[law] for bic in group])) for law in LAWS} for group in groups.values()]


def wins(rows: list[dict[str, float]]) -> dict[str, int]:
    """How often each law has the lowest BIC."""
    return {law: sum(min(row, key=row.get) == law for row in rows) for law in LAWS}


def differences(rows: list[dict[str, float]]) -> dict[str, np.ndarray]:
    """BIC minus that of the cone on a cylinder, by law."""
    return {law: np.array([row[law] - row[REFERENCE] for row in rows]) for law in LAWS}


def table(title: str, curves: list[Loading]) -> None:
    """Ranks over recordings and over conditions, with all samples counted and with independent samples only."""
    views = [[each.bic for each in curves], [each.correlated for each in curves]]
    views += [by_condition(curves, "bic"), by_condition(curves, "correlated")]
    won, apart = [wins(rows) for rows in views], [differences(rows) for rows in views]
    print(f"\n{title}: {len(curves)} recordings, {len(views[2])} conditions\n")
    print(
        "| law | wins | median dBIC (10 % to 90 %) | wins, correlated | median dBIC, correlated "
        "| conditions won | median dBIC | conditions won, correlated | residual / peak, median |"
    )
    print("|---|" + 8 * "---:|")
    for law in sorted(LAWS, key=lambda law: float(np.median(apart[0][law]))):
        low, middle, high = np.percentile(apart[0][law], PERCENTILES)
        residual = 100 * np.median([each.residual[law] for each in curves])
        print(
            f"| `{law}` | {won[0][law]} | {middle:.0f} ({low:.0f} to {high:.0f}) | {won[1][law]} "
            f"| {np.median(apart[1][law]):.1f} | {won[2][law]} | {np.median(apart[2][law]):.0f} | {won[3][law]} "
            f"| {residual:.2f} % |"
        )
    exponents = ", ".join(f"{value:.2f}" for value in np.percentile([each.exponent for each in curves], PERCENTILES))
    shares = ", ".join(f"{value:.3f}" for value in np.percentile([each.independent for each in curves], PERCENTILES))
    which = "percentiles 10, 50, 90"
    print(f"\nfree exponent, {which}: {exponents}; independent samples / samples, {which}: {shares}  ")
    noise, length = (np.nanmedian([getattr(each, name) for each in curves]) for name in ("noise", "correlation_length"))
    print(f"noise of the free travel: {noise:.2f} of the residual, correlated over {length:.2f} samples (medians)  ")
    close = [sum(lead(row) < CLOSE_BIC for row in rows) for rows in views[:2]]
    print(
        f"BIC lead of the winner below {CLOSE_BIC}: {close[0]} of {len(curves)} recordings, "
        f"{close[1]} with correlated samples counted as one"
    )


def lead(bic: dict[str, float]) -> float:
    """How much lower the best BIC is than the second."""
    best, second = sorted(bic.values())[:2]
    return second - best


def table_of_shares(shared: dict[float, list[Loading]]) -> None:
    """How the ranking depends on the end of the curve."""
    print("\n| up to | " + " | ".join(f"`{law}`" for law in LAWS) + " | free exponent, median |")
    print("|---|" + (len(LAWS) + 1) * "---:|")
    for share, curves in shared.items():
        rows = [each.bic for each in curves]
        won, apart = wins(rows), differences(rows)
        cells = " | ".join(f"{won[law]} ({np.median(apart[law]):.0f})" for law in LAWS)
        print(f"| {share:.0%} | {cells} | {np.median([each.exponent for each in curves]):.2f} |")
    print("\nrecordings won (median dBIC), by the share of the indentation up to which the curve is fitted")


def draw(curves: list[Loading], path: Path) -> None:
    """Bars of wins, and the middle 80 % of the differences. No measured curve is drawn."""
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams |= {"svg.hashsalt": "needleforce", "svg.fonttype": "none", "font.size": 9}
    from matplotlib import pyplot

    one_by_one, independent = [each.bic for each in curves], [each.correlated for each in curves]
    apart = differences(one_by_one)
    order = sorted(LAWS, key=lambda law: float(np.median(apart[law])))[::-1]
    place = np.arange(len(order))
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(8, 3.0), sharey=True, layout="constrained")
    views = (one_by_one, "every sample counts"), (independent, "correlated samples count as one")
    for k, (rows, label) in enumerate(views):
        won = wins(rows)
        bars = left.barh(place + 0.19 - 0.38 * k, [won[law] for law in order], 0.36, color=("C0", "C9")[k], label=label)
        left.bar_label(bars, padding=2, fontsize=8)
    left.set(xlabel=f"recordings won, of {len(curves)}", yticks=place, yticklabels=order)
    left.legend(frameon=False, fontsize=8, loc="lower right")
    left.margins(x=0.12)
    for k, law in enumerate(order):
        low, quarter, middle, three, high = np.percentile(apart[law], (10, 25, 50, 75, 90))
        right.plot((low, high), (k, k), color="0.6", lw=1.5)
        right.plot((quarter, three), (k, k), color="C0", lw=7, solid_capstyle="butt")
        right.plot(middle, k, "o", color="white", mec="C0", ms=5)
    right.axvline(0.0, color="0.3", lw=0.8)
    right.set(xlabel=f"BIC minus that of {REFERENCE},\nmedian, middle half and middle 80 % of recordings")
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, metadata={"Date": None})
    print(f"\n{path}")


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--figure", type=Path, help="SVG file for the figure of the ranking")
    arguments = options.parse_args()
    sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
    from recorded_data import RECORDINGS

    curves, outcomes = insertions(RECORDINGS / "needle-insertion-rig")
    if not curves:
        print(f"loading curves: no real recordings at {RECORDINGS}; set NEEDLEFORCE_RECORDINGS")
        return
    print("loading curves:", ", ".join(f"{count} {status}" for status, count in outcomes.items()))
    shared = {share: loadings(curves, share) for share in SHARES}
    whole = shared[1.0]
    table("All", whole)
    incised = "incision"  # skin cut before: the first puncture is in a deeper layer
    table("Without incised specimens", [each for each in whole if incised not in each.condition])
    table("Incised specimens", [each for each in whole if incised in each.condition])
    table_of_shares(shared)
    if arguments.figure:
        draw(whole, arguments.figure)


if __name__ == "__main__":
    main()
