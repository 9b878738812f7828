# SPDX-License-Identifier: Apache-2.0
"""The source paper's experiment: five sites per speed, two insertions at each, two bench tests, and the true values."""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..checks import random_seed, within
from ..errors import InputError
from ..recording import Card, Recording
from .bench_tests import NEEDLE_MODULUS, TISSUE_MODULUS, BendingTest, TensionTest, bend_needle, pull_tissue
from .run import RigRun, SpeedClock, path_of_run, perform
from .sensor import Sensor
from .specimen import HOLD, PAPER, PhantomSite, Scatter, Specimen, Unmodelled, draw_site, stick_slip

_EXAMPLE_STEP = 10  # samples: no two share a reading in the average filter, so that the noise is white
START = -4e-3  # [m] in the rig's zero
_SECOND_PASS_MARGIN_M = 0.3e-3  # the second pass ends above the first: at the end of the hole it would cut again
_BENCH_KEY = (1 << 16,)  # spawn key of the bench tests, distinct from those of the sites
_UNMODELLED, _SCATTER, _SENSOR, _CLOCK = Unmodelled(), Scatter(), Sensor(), SpeedClock()
_OF_A_SITE = {
    "puncture_force": ("puncture_force", "N"),
    "puncture_indentation": ("puncture_depth", "m"),
    "friction_per_length": ("friction_per_length", "N/m"),
    "cutting_force": ("cutting_force", "N"),
}


@dataclass(frozen=True)
class Truth:
    """A true quantity [SI]: ``nominal`` value, mean ``drawn`` for sites or tests, and ``sd`` between them."""

    nominal: float
    drawn: float
    sd: float
    unit: str


@dataclass(frozen=True, eq=False, kw_only=True)
class Experiment:
    """A simulated experiment.

    Attributes
    ----------
    runs : tuple of RigRun
        The insertions by speed, site and pass.
    sites : tuple of PhantomSite
        The sites, drawn around ``nominal``.
    nominal : Specimen
        Mean values over sites.
    bending, tension : BendingTest, TensionTest
        The bench tests.
    needle_moduli : ndarray
        True Young's moduli of the needle in the bending tests [Pa].
    """

    runs: tuple[RigRun, ...]
    sites: tuple[PhantomSite, ...]
    nominal: Specimen
    bending: BendingTest
    needle_moduli: np.ndarray
    tension: TensionTest

    @property
    def truth(self) -> dict[str, Truth]:
        """The true value of each quantity in the paper's table, over all sites."""
        return truth(self.nominal, self.sites, self.needle_moduli)

    def at(self, speed: float) -> "Experiment":
        """The part of the experiment at one speed [m/s]: runs, sites and truth."""
        sites = tuple(site for site in self.sites if site.speed == speed)
        if not sites:
            known = ", ".join(f"{each:g}" for each in sorted({site.speed for site in self.sites}))
            raise InputError(
                "speed", f"{speed:g} m/s", f"the experiment has {known} m/s", next_step="Give one of these."
            )
        return replace(self, runs=tuple(run for run in self.runs if run.speed == speed), sites=sites)

    def pairs(self) -> list[tuple[RigRun, RigRun]]:
        """First and second pass of each site."""
        return list(zip(self.runs[::2], self.runs[1::2], strict=True))

    def write(self, folder: str | os.PathLike, progress: Callable | None = None) -> list[Path]:
        """Write the two tables and two files per run; returns their paths.

        ``folder`` is created if it does not exist; ``progress(runs, text)`` wraps the iteration over the runs. Raises
        InputError if a file cannot be written.
        """
        folder = Path(folder)
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError("folder", "not created", error.strerror or "", str(folder), "Give another one.") from None
        written = [self.bending.write(folder), self.tension.write(folder)]
        for run in progress(self.runs, "recording") if progress else self.runs:
            written += run.write(folder)
        return written


def paper_experiment(
    seed: int,
    *,
    cutting_force: float = PAPER["cutting_force"][0],
    friction_per_length: float = PAPER["friction_per_length"][0],
    sites: int = 5,
    speeds: Sequence[float] = (1e-3, 3e-3),
    depth: float = 16e-3,
    unmodelled: Unmodelled = _UNMODELLED,
    scatter: Scatter = _SCATTER,
    sensor: Sensor = _SENSOR,
    clock: SpeedClock = _CLOCK,
    cutting: Callable = stick_slip,
) -> Experiment:
    """Simulate the source paper's experiment (sec. 1) on a phantom; the same seed gives the same bytes.

    Sites, noise of each run and bench tests have independent random streams: changing a mean changes no draw.

    Parameters
    ----------
    seed : int
        Seed of all random numbers, at least 0.
    cutting_force : float
        Mean cutting force over sites [N].
    friction_per_length : float
        Mean friction per length over sites [N/m].
    sites : int
        Number of sites for each speed, 1 to 65535.
    speeds : sequence of float
        Speeds [m/s], each different, above 0 and at most 0.1.
    depth : float
        Depth of the first pass in the rig's zero [m], 6e-3 to 60e-3; the default is deeper than the paper's 12 mm, so
        that the growth of friction is included.
    unmodelled : Unmodelled
        Effects that the paper's model omits.
    scatter : Scatter
        Standard deviations between sites.
    sensor : Sensor
        The force sensor.
    clock : SpeedClock
        The velocity signal.
    cutting : callable
        ``cutting(force=…)`` returns the cutting law; the default has a stick–slip oscillation at 1 mm/s.

    Returns
    -------
    Experiment

    Raises
    ------
    InputError
        If a value is outside its range.
    """
    _check(seed, sites, speeds, depth)
    nominal = Specimen(
        cutting_force=cutting_force, friction_per_length=friction_per_length, unmodelled=unmodelled, cutting=cutting
    )
    drawn, runs = [], []
    for key in [(k, number) for k in range(len(speeds)) for number in range(1, sites + 1)]:
        draws, *noises = streams(seed, key, 3)
        site = draw_site(nominal, scatter, float(speeds[key[0]]), key[1], draws)
        drawn.append(site)
        runs += _two_passes(site, depth, sensor, clock, noises)
    draws, noise = streams(seed, _BENCH_KEY, 2)
    bending, moduli = bend_needle(draws)
    return Experiment(
        runs=tuple(runs),
        sites=tuple(drawn),
        nominal=nominal,
        bending=bending,
        needle_moduli=moduli,
        tension=pull_tissue(noise),
    )


def _two_passes(site: PhantomSite, depth: float, sensor: Sensor, clock: SpeedClock, noises: list) -> list[RigRun]:
    first = path_of_run(START, site.speed, depth, HOLD)
    second = path_of_run(START, site.speed, depth - _SECOND_PASS_MARGIN_M, HOLD)
    return [
        perform(site, first, sensor, clock, noises[0]),
        perform(site, second, sensor, clock, noises[1], hole=depth),
    ]


def streams(seed: int, key: tuple[int, ...], count: int) -> list[np.random.Generator]:
    """``count`` independent random streams for a seed and a key; streams of other keys do not affect them."""
    children = np.random.SeedSequence(random_seed(seed), spawn_key=key).spawn(count)
    return [np.random.Generator(np.random.PCG64(child)) for child in children]


def _check(seed: int, sites: int, speeds: Sequence[float], depth: float) -> None:
    random_seed(seed)
    if not 1 <= sites < 1 << 16 or int(sites) != sites:
        raise InputError("sites", sites, "must be an integer from 1 to 65535")
    if not len(speeds) or not all(np.isfinite(speed) and 0.0 < speed <= 0.1 for speed in speeds):
        raise InputError("speeds", list(speeds), "must each be above 0 and at most 0.1 m/s")
    if len(set(speeds)) != len(speeds):
        raise InputError("speeds", list(speeds), "each speed must occur once", next_step="Give more sites instead.")
    within("depth", depth, 6e-3, 60e-3, "m")


def truth(nominal: Specimen, sites: Sequence[PhantomSite], needle_moduli: np.ndarray) -> dict[str, Truth]:
    """The true values of the paper's six quantities, by name."""
    table = {
        "needle_young_modulus": _summary(NEEDLE_MODULUS, needle_moduli, "Pa"),
        "tissue_young_modulus": Truth(TISSUE_MODULUS, TISSUE_MODULUS, 0.0, "Pa"),
    }
    for quantity, (name, unit) in _OF_A_SITE.items():
        table[quantity] = _summary(getattr(nominal, name), [getattr(site.specimen, name) for site in sites], unit)
    return table


def _summary(nominal: float, drawn: Sequence[float], unit: str) -> Truth:
    sd = float(np.std(drawn, ddof=1)) if len(drawn) > 1 else 0.0
    return Truth(float(nominal), float(np.mean(drawn)), sd, unit)


def example_recording(seed: int = 1) -> Recording:
    """One insertion at 3 mm/s, sampled at 100 Hz and rounded to make a small file.

    Every sample is the average of ten readings by the rig's filter. No two samples share a reading, so
    ``filter_length`` is 1.

    Parameters
    ----------
    seed : int
        Seed of the simulated experiment, at least 0.

    Returns
    -------
    Recording
        Time, depth, velocity, force, and the lateral forces fx and fy.
    """
    full = paper_experiment(seed, sites=1, speeds=(3e-3,)).runs[0].recording()
    first = -round(full.time[0] * full.rate) % _EXAMPLE_STEP
    rig = f"{full.card.rig}; every {_EXAMPLE_STEP}th sample"
    card = Card(source=full.card.source, needle=full.card.needle, tissue=full.card.tissue, rig=rig)
    keep = slice(first, None, _EXAMPLE_STEP)
    time, depth, velocity, force = (
        np.round(getattr(full, name)[keep], digits)
        for name, digits in (("time", 6), ("depth", 8), ("velocity", 7), ("force", 5))
    )
    axes = {name: np.round(full.axes[name][keep], 5) for name in ("fx", "fy")}
    return Recording(time=time, depth=depth, velocity=velocity, force=force, axes=axes, card=card)
