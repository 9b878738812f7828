# SPDX-License-Identifier: Apache-2.0
"""Punctures found while they happen, by nf.EventDetector as it comes and by simple detectors, on the same streams.

    python benchmarks/online_events.py [--full]

The simple ones have thresholds, set on odd repeats of one laboratory for at most 0.1 false alarms an insertion; odd
repeats are printed only with ``--full``. ruptures and changepoint-online have rows where they are installed. Delay:
from the sample before the steepest 10 ms of the fall. A false alarm is one outside every fall of half the size of a
puncture. ``nf.segment`` sees the whole recording, so it has no delay.
"""

import argparse
from collections.abc import Callable
from functools import partial

import numpy as np
from online_change_points import focus, installed, window
from online_streams import RECORDINGS, WITHIN, Stream, rig, simulated, stalks
from rich.console import Console
from rich.table import Table

import needleforce as nf


def detector(stream: Stream, **settings) -> list[int]:
    """Samples at which nf.EventDetector finds a puncture."""
    watch = nf.EventDetector(**settings)
    steps = np.diff(stream.time, prepend=stream.time[0])
    found = [watch.step(*row) for row in zip(stream.force, stream.depth, steps, strict=True)]
    return [i for i, event in enumerate(found) if event is not None and event.kind == "puncture"]


def offline(stream: Stream) -> list[int]:
    """Samples of the punctures that nf.segment finds in the whole recording."""
    try:
        recording = nf.Recording(time=stream.time, force=stream.force, depth=stream.depth)
        events = nf.segment(recording)
    except nf.InputError:
        return []
    return [each.high for each in events.punctures]


def rate(stream: Stream) -> np.ndarray:
    """Fall of the force per time [N/s]."""
    steps = np.diff(stream.time, prepend=2 * stream.time[0] - stream.time[1])
    return -np.diff(stream.force, prepend=stream.force[0]) / np.maximum(steps, 1e-6)


def below_maximum(stream: Stream) -> np.ndarray:
    """Fall below the greatest force of the last second [N]."""
    first = np.searchsorted(stream.time, stream.time - 1.0)
    return np.array([stream.force[low : i + 1].max() - stream.force[i] for i, low in enumerate(first)])


def off_line(stream: Stream) -> np.ndarray:
    """Force off a line through the last 100 ms, in standard deviations of the free travel."""
    first, last = np.searchsorted(stream.time, stream.time - WITHIN), np.arange(len(stream.time))
    n = np.maximum(last - first, 1)

    def mean(values):
        sums = np.r_[0.0, np.cumsum(values)]
        return (sums[last] - sums[first]) / n

    t, f = mean(stream.time), mean(stream.force)
    slope = (mean(stream.time * stream.force) - t * f) / np.maximum(mean(stream.time**2) - t**2, 1e-6)
    off = np.where(last - first > 3, stream.force - f - slope * (stream.time - t), 0.0)
    noise = max(1.4826 * np.median(np.abs(off[: max(20, len(off) // 20)])), 1e-4)
    return off / noise


def cusum(stream: Stream) -> np.ndarray:
    """Sum of the falls below that line, less 1/2 a sample."""
    off = off_line(stream)
    total, sums = 0.0, np.empty(len(off))
    for i, each in enumerate(off):
        sums[i] = total = max(0.0, min(total, 1e3) - each - 0.5)
    return sums


def alarms(stream: Stream, statistic: np.ndarray, threshold: float) -> list[int]:
    """Where a statistic exceeds a threshold while the needle cuts, once in 100 ms."""
    above = statistic >= threshold
    return once(stream, np.flatnonzero(above & ~np.r_[False, above[:-1] & cutting(stream)[:-1]]))


def once(stream: Stream, alarmed) -> list[int]:
    """Those of the samples at which the needle cuts, one in 100 ms."""
    cuts, found = cutting(stream), []
    for i in alarmed:
        if cuts[i] and (not found or stream.time[i] - stream.time[found[-1]] > WITHIN):
            found.append(int(i))
    return found


def cutting(stream: Stream) -> np.ndarray:
    """Whether the needle goes deeper than ever."""
    before = np.maximum(np.searchsorted(stream.time, stream.time - WITHIN) - 1, 0)
    return (stream.depth >= np.maximum.accumulate(stream.depth) - 50e-6) & (stream.depth - stream.depth[before] > 20e-6)


def found_by(statistic: Callable) -> Callable:
    """Of a stream the function that finds samples by a threshold of a statistic."""
    return lambda stream: partial(alarms, stream, statistic(stream))


def simple_detectors() -> dict:
    """By name, of a stream the function that finds samples by a threshold."""
    chosen = {"force rate": rate, "below the maximum": below_maximum, "CUSUM": cusum}
    detectors = {name: found_by(statistic) for name, statistic in chosen.items()}
    if installed("ruptures"):
        detectors["ruptures, window"] = found_by(lambda stream: window(stream.time, stream.force))
    if installed("changepoint_online"):
        detectors["FOCuS"] = lambda stream: lambda least: once(stream, focus(off_line(stream), least))
    return detectors


def score(streams: list[Stream], found: list[list[int]]) -> dict:
    """Share of the punctures found, of the large ones, false alarms an insertion, alarms in falls between half and
    whole, and delays."""
    seen, large, late_samples, late, false, between = [], [], [], [], 0, 0
    for stream, mine in zip(streams, found, strict=True):
        used: set[int] = set()
        for fall in stream.punctures:
            hits = [i for i in mine if fall.start < i <= fall.end + margin(stream)]
            seen.append(bool(hits))
            large += [bool(hits)] if fall.share >= 0.2 else []
            if hits:
                late_samples.append(hits[0] - fall.snap)
                late.append(1e3 * (stream.time[hits[0]] - stream.time[fall.snap]))
            used.update(hits)
        inside = [any(f.start < i <= f.end + margin(stream) for f in stream.halves) for i in mine if i not in used]
        false, between = false + inside.count(False), between + inside.count(True)
    n = max(len(streams), 1)
    tail = (np.percentile(late_samples, [50, 90]), np.percentile(late, 90)) if late else ((np.nan, np.nan), np.nan)
    return {
        "punctures": len(seen),
        "found": np.mean(seen),
        "large": np.mean(large) if large else np.nan,
        "false": false / n,
        "between": between / n,
        "samples": tail[0],
        "ms": tail[1],
    }


def margin(stream: Stream) -> int:
    """Samples in 100 ms: a fall that is found behind its end was found late."""
    return max(1, round(WITHIN / float(np.median(np.diff(stream.time)))))


def threshold(streams: list[Stream], detect: Callable, most: float = 0.1) -> float:
    """The lowest threshold with at most so many false alarms an insertion, to 2 %."""
    finders = [detect(stream) for stream in streams]
    low, high = 1e-2, 1e3
    while high > 1.02 * low:
        middle = (low * high) ** 0.5
        found = [find(middle) for find in finders]
        low, high = (low, middle) if score(streams, found)["false"] <= most else (middle, high)
    return high


def main(full: bool) -> None:
    """Prints one table for each set of streams."""
    console = Console(width=120)
    if not (RECORDINGS / "needle-insertion-rig").is_dir():
        console.print(f"no real recordings in {RECORDINGS}: simulated streams alone, without the simple detectors")
    odd = rig(odd=True)
    simple = simple_detectors() if odd else {}
    limits = {name: threshold(odd, detect) for name, detect in simple.items()}
    slow, fast = simulated(300 if full else 60)
    noisy_slow, noisy_fast = simulated(300 if full else 60, noise=0.03)
    sets = {"simulated, 100 Hz": slow, "the same, 1 kHz": fast, "noise of 30 mN, 100 Hz": noisy_slow}
    sets |= {"the same, noisy, 1 kHz": noisy_fast}
    sets |= {"robot, even repeats, 100 Hz": rig(odd=False), "stalks, other laboratory, 1 kHz": stalks()} if odd else {}
    if full and odd:
        sets = {"robot, odd repeats, 100 Hz": odd} | sets
    for title, streams in sets.items():
        console.print(table(title, streams, simple, limits))


def table(title: str, streams: list[Stream], simple: dict, limits: dict) -> Table:
    """How every detector did on these streams."""
    punctures = sum(len(stream.punctures) for stream in streams)
    heading = f"{title}: {len(streams)} insertions, {punctures} punctures"
    columns = ("detector", "found", "of 20 % and more", "false an insertion", "between half and whole")
    shown = Table(*columns, "samples late, p50 / p90", "ms, p90", title=heading, title_justify="left")
    rows = {"EventDetector()": [detector(stream) for stream in streams]}
    for name, detect in simple.items():
        rows[f"{name}, {limits[name]:.2g}"] = [detect(stream)(limits[name]) for stream in streams]
    rows["nf.segment, offline"] = [offline(stream) for stream in streams]
    for name, found in rows.items():
        got = score(streams, found)
        late = ("", "") if "offline" in name else ("{:.0f} / {:.0f}".format(*got["samples"]), f"{got['ms']:.0f}")
        shown.add_row(
            name, f"{got['found']:.1%}", f"{got['large']:.1%}", f"{got['false']:.3f}", f"{got['between']:.2f}", *late
        )
    return shown


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true", help="odd repeats, too, and five times the simulated insertions")
    main(parser.parse_args().full)
