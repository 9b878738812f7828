# SPDX-License-Identifier: Apache-2.0
"""Error on real insertions: the engine gets their motion at 1 kHz and returns the force of an identified model.

    python benchmarks/replay.py [--conditions 2] [--full] [--write docs/evidence/replay.md]

Of every condition with three repeats or more (a file's name without repeat and date) the last repeat is held out, with
--full each in turn. The model is identified from the others only, without a warm start, and run in ``nf.Insertion``
along the motion of the held-out repeat: a prediction; with that repeat's own punctures, a replay. Positions are logged
at about 100 Hz and interpolated by a cubic that is monotone in each interval (PCHIP), so that a needle at rest stays at
rest and no position exceeds the logged range.
"""

import argparse
import dataclasses
import os
import runpy
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator

import needleforce as nf
from needleforce.identification.cross_validation import MeasuredCycle, measured_cycle
from needleforce.identification.one_layer.segmented_recording import segmented

ROOT = Path(__file__).resolve().parents[1]
CROSS_VALIDATION = runpy.run_path(str(ROOT / "benchmarks" / "cross_validation.py"))
MODELS = ("layered_as_fitted", "layered_yielding", "layered", "paper")
MODES = ("prediction", "replay")
JUMPS = ("at a rupture", "during withdrawal", "elsewhere")
TICK = 1e-3  # [s]
FALL = 0.1  # [s] after a rupture's peak in which its force falls


@dataclass(frozen=True, eq=False)
class Trace:
    """A force (n,) [N] over time (n,) [s], and the times of ruptures [s]."""

    time: np.ndarray
    force: np.ndarray
    ruptures: np.ndarray

    def jumps(self, cycle: MeasuredCycle) -> tuple[float, float, float]:
        """Largest change in a millisecond [N]: at a rupture, during withdrawal, elsewhere in the cycle. Averaged over
        the interval between two samples if that is longer."""
        start, stop = self.time[:-1], self.time[1:]
        change = np.abs(np.diff(self.force)) * TICK / (stop - start)
        breaks = np.zeros(len(change), bool)
        for time in self.ruptures:
            breaks |= (stop >= time) & (start <= time + FALL)
        inside = (start >= cycle.time[0]) & (stop <= cycle.time[-1])
        leaves = stop > cycle.time[cycle.stroke == 2].min(initial=np.inf)
        parts = breaks, ~breaks & leaves, ~breaks & ~leaves
        return tuple(float(change[inside & part].max(initial=0.0)) for part in parts)


@dataclass(frozen=True, eq=False)
class Outcome:
    """One held-out repeat: the measured force, and the engine's force by model and mode."""

    source: str
    cycle: MeasuredCycle
    measured: Trace
    traces: dict[tuple[str, str], Trace]

    def error(self, key: tuple[str, str]) -> np.ndarray:
        """Error (n,) [N] at the samples of the cycle."""
        trace = self.traces[key]
        return np.interp(self.cycle.time, trace.time, trace.force) - self.cycle.force


def engine_force(model: nf.Model, recording: nf.Recording, surface: float) -> Trace:
    """The engine along the motion of a recording whose surface is at ``surface`` [m], 1000 steps a second."""
    time = np.arange(recording.time[0], recording.time[-1], TICK)
    depths = PchipInterpolator(recording.time, recording.depth)(time) - surface
    insertion = nf.Insertion(model)
    samples = [insertion.step(depth, None, TICK) for depth in depths]
    refused = {str(sample.status) for sample in samples} - {"ok"}
    if refused:
        print(f"{recording.card.source}, {model.name}: status {', '.join(refused)}", file=sys.stderr)
    force, broke = np.array([[sample.force, sample.punctured] for sample in samples]).T
    return Trace(time, force, time[broke > 0])


def left_out(files: list[Path], k: int, models: tuple[str, ...] = MODELS, layers: int | None = None) -> Outcome:
    """The k-th of a condition's files through models of the others."""
    recordings = [nf.read(file, columns=CROSS_VALIDATION["COLUMNS"], units=CROSS_VALIDATION["UNITS"]) for file in files]
    own = recordings.pop(k)
    single = segmented(own)
    # its punctures are given, and nothing else: neither its contact nor its exit
    given = {"prediction": None, "replay": dataclasses.replace(single.events, contact=None, exit=None)}
    traces = {}
    for name in models:
        fit = nf.identify(recordings, model=name, layers=layers if name.startswith("layered") else None)
        for mode, events in given.items():
            model, surface = fit.placed(own, events)
            traces[name, mode] = engine_force(model, own, surface)
    measured_ruptures = np.array([puncture.time for puncture in single.events.punctures])
    return Outcome(files[k].stem, measured_cycle(single), Trace(own.time, own.force, measured_ruptures), traces)


def numbers(outcome: Outcome, key: tuple[str, str]) -> list[float]:
    """Rms, 95th percentile and maximum of the error [N], rms over the peak, largest jumps [N]."""
    error = np.abs(outcome.error(key))
    rms = float(np.sqrt(np.mean(error**2)))
    jumps = outcome.traces[key].jumps(outcome.cycle)
    return [rms, float(np.percentile(error, 95)), float(error.max()), rms / outcome.cycle.peak, *jumps]


def row(cells: list[str]) -> str:
    return f"| {' | '.join(cells)} |"


def tables(outcomes: list[Outcome]) -> list[str]:
    """Markdown: medians over the held-out repeats, with the worst; then each of them."""
    heads = ["rms, N", "95th percentile, N", "largest, N", "rms / peak", *(f"jump {where}, N" for where in JUMPS)]
    lines = [row(["model", "mode", *heads]), "|---" * (2 + len(heads)) + "|"]
    for key in ((name, mode) for name in MODELS for mode in MODES):
        found = np.array([numbers(outcome, key) for outcome in outcomes])
        lines.append(row([f"`{key[0]}`", key[1], *map(spread, found.T)]))
    own = np.array([outcome.measured.jumps(outcome.cycle) for outcome in outcomes])
    lines += [row(["measured", "", *[""] * 4, *map(spread, own.T)]), ""]
    return [*lines, *each(outcomes)]


def spread(values: np.ndarray) -> str:
    return f"{np.median(values):.3f} ({values.max():.3f})"


def each(outcomes: list[Outcome]) -> list[str]:
    """Markdown: every held-out repeat."""
    heads = ["held-out repeat", "peak, N", *(f"`{name}`" for name in MODELS), "jumps of `layered`", "measured"]
    lines = [row(heads), "|---" * len(heads) + "|"]
    for outcome in sorted(outcomes, key=lambda outcome: outcome.source):
        name = outcome.source.rsplit("_", 1)[0].replace("__", " ")
        rms = [", ".join(f"{numbers(outcome, (model, mode))[0]:.3f}" for mode in MODES) for model in MODELS]
        traces = outcome.traces["layered", "replay"], outcome.measured
        jumps = [", ".join(f"{jump:.2f}" for jump in trace.jumps(outcome.cycle)) for trace in traces]
        lines.append(row([name, f"{outcome.cycle.peak:.2f}", *rms, *jumps]))
    legend = (
        f"Rms errors [N]: prediction, replay. Jumps [N in 1 ms]: {', '.join(JUMPS)}; of the replay and as measured."
    )
    return [*lines, "", legend]


def measured(count: int, full: bool) -> list[Outcome]:
    """The requested held-out repeats; empty without recordings."""
    folder = runpy.run_path(str(ROOT / "tests" / "recorded_data.py"))["RECORDINGS"] / "needle-insertion-rig"
    if not folder.is_dir():
        print(f"no recordings in {folder}: nothing is replayed")
        return []
    found = list(CROSS_VALIDATION["conditions"](folder).values())[: None if full else count]
    outcomes = []
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        work = [pool.submit(left_out, files, k) for files in found for k in (range(len(files)) if full else [-1])]
        for future in work:
            outcomes.append(future.result())
            shown = ", ".join(f"{name} {numbers(outcomes[-1], (name, 'replay'))[3]:.3f}" for name in MODELS)
            print(f"{outcomes[-1].source}: replay, rms / peak: {shown}", flush=True)
    return outcomes


def main(count: int, full: bool, write: Path | None) -> None:
    outcomes = measured(count, full)
    if not outcomes:
        return
    print("\n".join(tables(outcomes)))
    if write is not None:
        page = runpy.run_path(str(ROOT / "benchmarks" / "replay_page.py"))
        page["write"](write, outcomes, tables(outcomes), FALL)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--conditions", type=int, default=2, help="how many, without --full")
    parser.add_argument("--full", action="store_true", help="each repeat of every condition")
    parser.add_argument("--write", type=Path)
    options = parser.parse_args()
    main(options.conditions, options.full, options.write)
