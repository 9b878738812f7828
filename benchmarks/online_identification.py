# SPDX-License-Identifier: Apache-2.0
"""Parameters and force ahead by nf.OnlineIdentifier, while recorded and simulated needles move.

    python benchmarks/online_identification.py [--odd]

Every recording is read sample by sample. At 25, 50 and 75 % of the travel from the first contact to the deepest point
the force 1, 2 and 5 mm ahead is asked for, with no prior, with a preset of another tissue, and with the odd repeats of
the same condition; next to it the last force (persistence) and, with the odd repeats, the mean of their forces at that
depth below the contact. Even repeats are reported; ``--odd`` prints the odd ones, by which the settings were chosen.
"""

import argparse
import re
import time
from collections import defaultdict
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from online_streams import RECORDINGS, repeat
from rich.console import Console
from rich.table import Table

import needleforce as nf

SEEN, TRAVELS = (0.25, 0.5, 0.75), (1e-3, 2e-3, 5e-3)


class Answer(NamedTuple):
    """One question: error over the peak, whether the interval held it, its width over the peak, what the last force
    and the offline repeats would have had, whether there was a puncture in between."""

    error: float
    held: bool
    width: float
    last: float
    offline: float
    puncture: bool


def condition(name: str) -> str:
    """What the repeats of a condition share of their names."""
    return re.sub(r"_\d+((?:_same-location-repeat)?)_\d{4}(?:-\d\d){5}$", r"\1", name)


def insertions() -> dict[str, nf.Recording]:
    """Real recordings that could be read, by name."""
    found = {}
    for path in sorted((RECORDINGS / "needle-insertion-rig").glob("*.csv")):
        try:
            found[path.stem] = nf.read(path)
        except nf.InputError:
            continue
    return found


def steps(run: nf.Recording) -> list[tuple[float, float, float]]:
    """Force, depth and time step of each sample."""
    return list(zip(run.force, run.depth, np.diff(run.time, prepend=run.time[0]), strict=True))


def contact_of(run: nf.Recording) -> float | None:
    """Depth [m] at which the detector finds the contact."""
    watch = nf.EventDetector()
    for row in steps(run):
        event = watch.step(*row)
        if event is not None and event.kind == "contact":
            return event.depth
    return None


def answers(run: nf.Recording, prior, others: list[tuple[nf.Recording, float]]) -> list[tuple[float, float, Answer]]:
    """Every question along one insertion, as (share seen, travel, answer)."""
    contact = contact_of(run)
    deepest = int(np.argmax(run.depth))
    if contact is None:
        return []
    places = contact + np.array(SEEN) * (run.depth[deepest] - contact)
    at = [int(np.argmax(run.depth >= place)) for place in places]
    online, found = nf.OnlineIdentifier(prior=prior), []
    falls = [each.depth for each in nf.segment(run).punctures]
    for i, row in enumerate(steps(run)[: deepest + 1]):
        online.step(*row)
        for share, asked in zip(SEEN, at, strict=True):
            if i == asked:
                found += [(share, d, a) for d in TRAVELS if (a := answer(run, online, i, d, contact, others, falls))]
    return found


def answer(run, online, i: int, travel: float, contact: float, others, falls) -> Answer | None:
    """The force ahead of one sample; None where the insertion ends before."""
    deepest = int(np.argmax(run.depth))
    if run.depth[i] + travel > run.depth[deepest]:
        return None
    j, peak = int(np.argmax(run.depth >= run.depth[i] + travel)), run.force[: deepest + 1].max()
    ahead, came = online.ahead(float(run.depth[j] - run.depth[i])), run.force[j]
    mean = [mean_force(each, surface, run.depth[j] - contact) for each, surface in others]
    return Answer(
        (ahead.force[-1] - came) / peak,
        bool(ahead.low[-1] <= came <= ahead.high[-1]),
        (ahead.high[-1] - ahead.low[-1]) / peak,
        (run.force[i] - came) / peak,
        (np.mean(mean) - came) / peak if mean else np.nan,
        any(run.depth[i] < fall <= run.depth[j] for fall in falls),
    )


def mean_force(run: nf.Recording, contact: float, indentation: float) -> float:
    """Force [N] of an insertion at a depth below its contact."""
    deepest = int(np.argmax(run.depth))
    return float(np.interp(contact + indentation, run.depth[: deepest + 1], run.force[: deepest + 1]))


def real(console: Console, odd: bool) -> None:
    """Tables of force ahead and of parameters over real recordings."""
    runs = insertions()
    groups = defaultdict(list)
    for name in runs:
        groups[condition(name)].append(name)
    found: dict[str, list] = {"none": [], "preset of a gel": [], "odd repeats": []}
    ends = []
    for names in groups.values():
        known = [(runs[name], contact_of(runs[name])) for name in names if repeat(name) % 2]
        for name in (each for each in names if repeat(each) % 2 == odd):
            others = [(run, at) for run, at in known if run is not runs[name] and at is not None]
            found["none"] += answers(runs[name], None, others)
            found["preset of a gel"] += answers(runs[name], nf.preset("paper"), others)
            if len(others) >= 2:
                prior = [run for run, _ in others]
                found["odd repeats"] += answers(runs[name], prior, others)
            ends.append(at_the_end(runs[name]))
    for title, chosen in (("all", lambda a: True), ("no puncture in between", lambda a: not a.puncture)):
        console.print(table_ahead(title, found, chosen))
    console.print(table_end([each for each in ends if each]))


def table_ahead(title: str, found: dict, chosen) -> Table:
    """Median and mean error over the peak, coverage, width."""
    columns = ("prior", "ahead", "seen", "n", "error, median / mean", "held", "width", "last force", "repeats' mean")
    shown = Table(*columns, title=f"force ahead, {title}", title_justify="left")
    for prior, rows in found.items():
        for travel in TRAVELS:
            for share in SEEN:
                these = [a for s, d, a in rows if s == share and d == travel and chosen(a)]
                if these:
                    shown.add_row(prior, f"{1e3 * travel:.0f} mm", f"{share:.0%}", str(len(these)), *summary(these))
    return shown


def summary(these: list[Answer]) -> tuple[str, ...]:
    """Cells of a row."""
    error, last, offline = (np.abs([getattr(a, name) for a in these]) for name in ("error", "last", "offline"))
    return (
        f"{np.median(error):.1%} / {error.mean():.1%}",
        f"{np.mean([a.held for a in these]):.0%}",
        f"{np.median([a.width for a in these]):.0%}",
        f"{np.median(last):.1%} / {last.mean():.1%}",
        f"{np.nanmedian(offline):.1%} / {np.nanmean(offline):.1%}" if np.isfinite(offline).any() else "",
    )


def at_the_end(run: nf.Recording) -> tuple | None:
    """Parameters at the end of the insertion next to those that nf.identify finds in the whole cycle."""
    online, deepest = nf.OnlineIdentifier(), int(np.argmax(run.depth))
    squares = []
    for row in steps(run)[: deepest + 1]:
        online.step(*row)
        squares.append(online.innovation)
    found = online.parameters
    try:
        fit = nf.identify(run, model="paper").parameters
    except nf.InputError:
        return None
    names = ("contact_depth", "stiffness_coefficient", "puncture_depth", "puncture_force", "friction_per_length")
    both = {name: (found[name], fit[name]) for name in names if name in found and name in fit}
    return both, float(np.median(squares))


def table_end(ends: list) -> Table:
    """How far online and offline are apart."""
    shown = Table("parameter", "n", "online / offline, median", "intervals overlap", title_justify="left")
    shown.title = f"at the deepest point; innovation squared, median {np.median([each[1] for each in ends]):.2f}"
    for name in dict.fromkeys(name for both, _ in ends for name in both):
        pairs = [both[name] for both, _ in ends if name in both]
        ratio = np.median([mine.value / theirs.value for mine, theirs in pairs if theirs.value])
        overlap = np.mean([mine.low <= theirs.high and theirs.low <= mine.high for mine, theirs in pairs])
        shown.add_row(name, str(len(pairs)), f"{ratio:.2f}", f"{overlap:.0%}")
    return shown


def change_half_way(console: Console, n: int = 60) -> None:
    """A tissue that becomes three times as stiff under the needle, without a fall: what is expected around it."""
    held = {name: [0, 0] for name in ("before", "first millimetre", "later")}
    for seed in range(n):
        random = np.random.default_rng(seed)
        depth = np.arange(-2e-3, 14e-3, 1e-5)
        slope = np.where(depth < 6e-3, 100.0, 300.0) * (depth > 0)
        clean = np.cumsum(slope) * 1e-5
        rough = np.convolve(random.normal(size=len(depth) + 99), np.exp(-np.arange(100) / 20), "valid")
        force = clean * (1 + 0.01 * rough / rough.std()) + 2e-3 * random.normal(size=len(depth))
        online = nf.OnlineIdentifier()
        for i, (f, z) in enumerate(zip(force, depth, strict=True)):
            online.step(f, z, 1e-2)
            if i % 50 or z < 2e-3 or z > 13e-3 or 5e-3 < z < 6e-3:
                continue
            ahead = online.ahead(1e-3)
            where = "before" if z < 6e-3 else "first millimetre" if z < 7e-3 else "later"
            held[where][0] += bool(ahead.low[-1] <= force[i + 100] <= ahead.high[-1])
            held[where][1] += 1
    shown = Table("place", "asked", "held", title="three times as stiff from 6 mm, 1 mm ahead", title_justify="left")
    for place, (good, asked) in held.items():
        shown.add_row(place, str(asked), f"{good / asked:.0%}")
    console.print(shown)


def compared_streams() -> dict[str, tuple[nf.Model, float]]:
    """Models whose force is known, and by how much the needle sways while it goes on [m]."""
    contact, cutting = nf.laws.Cone(1.2e5, 0.26), nf.laws.ConstantCutting(0.1)
    lugre = nf.laws.Lugre(2e5, 300.0, 500.0, 18.0, 25.0)
    puncture = nf.laws.PunctureDepth(4e-3)
    below = nf.Layer(8e-3, contact, puncture, nf.laws.Coulomb(40.0), cutting)
    one = nf.Model(contact, puncture, nf.laws.Coulomb(20.0), cutting)
    return {
        "one layer": (one, 0.0),
        "two layers": (replace(one, deeper=(below,)), 0.0),
        "LuGre, swaying": (nf.Model(contact, puncture, lugre, cutting), 1.5e-3),
    }


def models(console: Console, n: int = 3) -> None:
    """Both models of the identifier on the same streams: force 0.5 mm ahead behind the first puncture."""
    shown = Table("stream", "model", "asked", "held", "error, median / mean", "width", title_justify="left")
    for name, (model, sway) in compared_streams().items():
        for kind in ("layered", "lugre"):
            rows = [row for seed in range(n) for row in followed(model, sway, kind, seed)]
            good, error, width = np.array(rows).T
            cells = f"{good.mean():.0%}", f"{np.median(error):.3f} / {error.mean():.3f} N", f"{np.median(width):.2f} N"
            shown.add_row(name, kind, str(len(rows)), *cells)
    console.print(shown)


def followed(model: nf.Model, sway: float, kind: str, seed: int) -> list[tuple[bool, float, float]]:
    """Whether each force that came was held, by how much it was missed and how wide the interval was [N]."""
    time = np.arange(0.0, 8.0, 1e-4)
    depth = -2e-3 + 2e-3 * time + sway * np.sin(np.pi * (time - 4.0)) * np.clip(time - 4.0, 0.0, 1.0)
    force = nf.Insertion(model).run(depth, np.gradient(depth, time), np.full(len(time), 1e-4))["force"]
    depth, force = depth[::20], force[::20] + 3e-3 * np.random.default_rng(seed).normal(size=len(time[::20]))
    online, rows = nf.OnlineIdentifier(model=kind), []
    for i, (f, z) in enumerate(zip(force, depth, strict=True)):
        online.step(float(f), float(z), 2e-3)
        if z < 5e-3 or i % 40 or online.regime == "rest":
            continue
        ahead = online.ahead(5e-4)
        way = np.sign(ahead.depth[-1] - ahead.depth[0])
        j = i + int(np.argmax(way * (depth[i:] - ahead.depth[-1]) >= 0.0))
        if j > i and (way * np.diff(depth[i : j + 1]) > 0.0).all():
            low, high = ahead.low[-1], ahead.high[-1]
            rows.append((low <= force[j] <= high, abs(ahead.force[-1] - force[j]), high - low))
    return rows


def main(odd: bool) -> None:
    """Prints every table."""
    console, begun = Console(width=130), time.perf_counter()
    if (RECORDINGS / "needle-insertion-rig").is_dir():
        real(console, odd)
    else:
        console.print(f"no real recordings in {RECORDINGS}: the change of tissue alone")
    change_half_way(console)
    models(console)
    console.print(f"{time.perf_counter() - begun:.0f} s")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--odd", action="store_true", help="the repeats by which settings were chosen")
    main(parser.parse_args().odd)
