# SPDX-License-Identifier: Apache-2.0
"""Streams with their punctures: real insertions, where a puncture is a fall by its definition, and simulated ones."""

import re
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np

import needleforce as nf

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from recorded_data import RECORDINGS

WITHIN = 0.1  # [s]


class Fall(NamedTuple):
    """A fall of the force: first sample, the one before its steepest 10 ms, the last, and its size over the peak."""

    start: int
    snap: int
    end: int
    share: float


class Stream(NamedTuple):
    """What comes, sample by sample, and which falls are punctures, or half as large at least."""

    name: str
    time: np.ndarray
    force: np.ndarray
    depth: np.ndarray
    punctures: list[Fall]
    halves: list[Fall]


def falls(time, force, depth, least: float = 0.15, share: float = 0.1) -> list[Fall]:
    """Every fall of ``least`` newtons and ``share`` of the running peak within 100 ms, while the needle cuts."""
    peak = np.maximum.accumulate(np.maximum(force, 0.0))
    first = np.searchsorted(time, time - WITHIN - 1e-4)
    top = np.array([low + np.argmax(force[low : i + 1]) for i, low in enumerate(first)])
    cuts = depth >= np.maximum.accumulate(depth) - 50e-6
    moves = depth - depth[np.maximum(np.searchsorted(time, time - WITHIN) - 1, 0)] > 20e-6
    falling = (force[top] - force >= np.maximum(least, share * peak)) & cuts & moves
    edges = np.flatnonzero(np.diff(np.r_[0, falling, 0]))
    found: list[Fall] = []
    for begin, stop in zip(edges[::2], edges[1::2], strict=True):
        start, end = int(top[begin]), int(stop - 1)
        size = (force[start] - force[start:stop].min()) / peak[begin]
        if found and start <= found[-1].end:
            before = found.pop()
            start, size = before.start, max(size, before.share)
        found.append(Fall(start, _snap(time, force, start, end), end, float(size)))
    return found


def _snap(time, force, start: int, end: int) -> int:
    """The sample before the steepest 10 ms."""
    later = np.minimum(np.searchsorted(time, time[start:end] + 0.0095), end)
    return start + int(np.argmax(force[start:end] - force[later]))


def stream(name: str, run: nf.Recording) -> Stream:
    """A recording as a stream, its punctures by their definition: what falls before the needle has touched, as where a
    machine starts with a jerk, is none."""
    time = run.time - run.time[0]
    contact = nf.segment(run).contact
    first = 0 if contact is None else int(np.searchsorted(run.time, contact.time))
    kinds = (falls(time, run.force, run.depth, *limits) for limits in ((0.15, 0.1), (0.075, 0.05)))
    return Stream(name, time, run.force, run.depth, *([f for f in kind if f.snap >= first] for kind in kinds))


def _read(path: Path) -> Stream | None:
    try:
        return stream(path.stem, nf.read(path))
    except nf.InputError:
        return None


def repeat(name: str) -> int:
    """Number of the repeat in the name of a recording, 1 without."""
    found = re.search(r"_(\d+)(?:_same-location-repeat)?_\d{4}(?:-\d\d){5}$", name)
    return int(found[1]) if found else 1


def rig(odd: bool) -> list[Stream]:
    """Insertions by a robot at 76 to 100 Hz: odd repeats to choose by, even ones to report."""
    paths = sorted((RECORDINGS / "needle-insertion-rig").glob("*.csv"))
    read = (_read(path) for path in paths if repeat(path.stem) % 2 == odd)
    return [each for each in read if each is not None]


def stalks() -> list[Stream]:
    """Punctures of plant stalks by a testing machine at 1 kHz, of another laboratory: to report alone."""
    paths = sorted((RECORDINGS / "other-labs" / "stalk-puncture-instron").glob("*.csv"))
    return [each for each in map(_read, paths) if each is not None]


def simulated(n: int, noise: float = 5e-3, texture: float = 8e-3, seed: int = 1) -> tuple[list[Stream], list[Stream]]:
    """Insertions through three layers as 100 Hz and 1 kHz have them: the same ones, with the same noise."""
    random = np.random.default_rng(seed)
    fast = [_insertion(random, noise, texture) for _ in range(n)]
    return [_every(each, 10) for each in fast], fast


def _every(stream: Stream, step: int) -> Stream:
    ruptures = [Fall(f.start // step, f.snap // step, -(-f.end // step), f.share) for f in stream.punctures]
    arrays = (values[::step] for values in (stream.time, stream.force, stream.depth))
    return Stream(stream.name, *arrays, ruptures, ruptures)


def _insertion(random, noise: float, texture: float) -> Stream:
    """Power laws that end in ruptures of 5 to 30 ms at 25 to 80 % of the force, then a hold that relaxes."""
    speed = random.choice([1e-3, 2e-3, 3e-3, 5e-3])
    widths, surface = random.uniform(4e-3, 8e-3, 3), random.uniform(2e-3, 5e-3)
    bottom = surface + widths.sum() + 3e-3
    time = np.arange(int(1000 * (bottom / speed + 3.0))) / 1000
    depth = np.minimum(speed * time, bottom)
    force, level, place, ruptures = np.zeros(len(time)), 0.0, surface, []
    for width in widths:
        first, last = np.searchsorted(depth, [place, place + width])
        top = level + random.uniform(0.5, 4.0)
        force[first:last] = level + (top - level) * ((depth[first:last] - place) / width) ** random.uniform(1.3, 2.2)
        share, end = random.uniform(0.25, 0.8), last + int(random.uniform(5, 30)) + 1
        level = (1 - share) * top
        force[last:end] = np.linspace(top, level, end - last)
        force[end:] = level
        ruptures.append(Fall(int(last), int(last), int(end), share))
        place = depth[end]
    rest = time - bottom / speed
    force *= np.where(rest > 0, 0.6 + 0.4 * np.exp(-np.maximum(rest, 0) / 0.8), 1.0)
    force += texture * np.sqrt(np.maximum(force, 0)) * _texture(random, depth) + noise * random.normal(size=len(time))
    return Stream("simulated", time, force, depth, ruptures, ruptures)


def _texture(random, depth, length: float = 30e-6) -> np.ndarray:
    """Roughness of unit variance along the travel, correlated over 30 um."""
    grid = np.arange(0.0, depth.max() + length, 0.1 * length)
    rough = np.convolve(random.normal(size=len(grid) + 20), np.exp(-np.arange(21) / 10), "valid")
    return np.interp(depth, grid, rough / rough.std())
