# SPDX-License-Identifier: Apache-2.0
"""One run of the rig as recorded: velocity at 60 Hz and force at 1 kHz, on two clocks."""

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..models.simulation import Motion
from ..recording import Card, Recording, write_columns
from ..recording.force_signal import bias
from ..recording.joining import integral, overlap
from .sensor import Sensor
from .specimen import PhantomSite

FORCE_RATE_HZ = 1000.0  # source paper sec. 1
NEEDLE = "diameter 0.7 mm, length 80 mm, bevel 15 degrees"
_LEVER_M = 80e-3  # from the sensor to the lateral force at the tip
_REST_S = 0.5  # before and after the insertion


@dataclass(frozen=True, eq=False, kw_only=True)
class RigRun:
    """One insertion: ``axes`` (n,) [N, N m] on ``time`` [s], and ``velocity`` (m,) [m/s] on ``motion_time`` [s].

    ``axes`` has force (axial, + opposes insertion), fx, fy, tx, ty, tz. ``start_depth`` [m] is the depth of the tip at
    the start, in the rig's zero, which is near the surface. Depth is not recorded: it is the integral of the velocity.
    """

    speed: float
    site: int
    second: bool
    time: np.ndarray
    axes: dict[str, np.ndarray]
    motion_time: np.ndarray
    velocity: np.ndarray
    start_depth: float
    card: Card

    @property
    def name(self) -> str:
        """Speed, site and pass, as in the file names: ``3mm_s_site1_pass1``."""
        return f"{self.speed * 1e3:g}mm_s_site{self.site}_pass{2 if self.second else 1}"

    def recording(self) -> Recording:
        """Both streams joined as by ``read``: depth is the integral of the velocity, on the force's clock."""
        within = overlap(self.time, self.motion_time, self.name)
        time = self.time[within]
        axes = {axis: values[within] for axis, values in self.axes.items()}
        depth = integral(self.motion_time, self.velocity, self.start_depth, time)
        force = axes.pop("force")
        force = force - bias(depth, force)[0]
        velocity = np.interp(time, self.motion_time, self.velocity)
        return Recording(time=time, depth=depth, velocity=velocity, force=force, axes=axes, card=self.card)

    def write(self, folder: str | os.PathLike) -> tuple[Path, Path]:
        """Write ``<name>_force.csv`` and ``<name>_motion.csv``; ``read`` of the first finds the second."""
        force, motion = (Path(folder) / f"{self.name}_{stream}.csv" for stream in ("force", "motion"))
        streams = {"time": self.motion_time, "velocity": self.velocity}
        write_columns(streams, motion, Card(rig=self.card.rig), start_depth=self.start_depth)
        write_columns({"time": self.time} | self.axes, force, self.card, motion=motion.name)
        return force, motion


def path_of_run(start: float, speed: float, depth: float, hold: float) -> Motion:
    """Rest, insertion stroke, hold [s], withdrawal stroke, rest, with the trapezoidal velocity of ``Motion``."""
    return Motion(start, ((start, _REST_S), (depth, speed), (depth, hold), (start, speed), (start, _REST_S)))


def wrench_of(site: PhantomSite, force: float | np.ndarray) -> dict:
    """The wrench [N, N m] about the sensor, by axis, for an axial force [N], a number or (n,), at the site."""
    fx, fy = (share * force for share in site.lateral)
    return {"force": force, "fx": fx, "fy": fy, "tx": -_LEVER_M * fy, "ty": _LEVER_M * fx}


@dataclass(frozen=True)
class SpeedClock:
    """Velocity as a drive reports it: sampled on its own clock, with noise and quantisation.

    The rate is the source paper's; the other values are assumed. Over a cycle of 15 s the integral of the noise drifts
    by about 0.01 mm.

    Parameters
    ----------
    rate : float
        Sampling rate [Hz], at least 1.
    jitter : float
        Standard deviation of the time stamps [s], at least 0.
    noise : float
        Standard deviation of the velocity [m/s], at least 0.
    resolution : float
        Step of the velocity [m/s], at least 0.

    Raises
    ------
    InputError
        If a value is below its limit or not finite.
    """

    rate: float = 60.0
    jitter: float = 0.2e-3
    noise: float = 0.02e-3
    resolution: float = 0.01e-3

    def __post_init__(self):
        for quantity, low in (("rate", 1.0), ("jitter", 0.0), ("noise", 0.0), ("resolution", 0.0)):
            value = getattr(self, quantity)
            if not (np.isfinite(value) and value >= low):
                raise InputError(f"clock.{quantity}", value, f"must be at least {low:g}")

    def record(self, motion: Motion, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Time stamps (n,) [s] and velocity (n,) [m/s] from the first period to the end of the motion.

        The phase relative to the force's clock is drawn. The error of a time stamp is at most a quarter of a period, so
        that time increases.
        """
        period = 1.0 / self.rate
        taken = np.arange(random.uniform(0.0, period), motion.duration, period)
        velocity = motion.at(taken)[1] + random.normal(0.0, self.noise, len(taken))
        if self.resolution:
            velocity = np.rint(velocity / self.resolution) * self.resolution
        late = np.clip(random.normal(0.0, self.jitter, len(taken)), -0.25 * period, 0.25 * period)
        return np.round(np.maximum(taken + late, 0.0), 6), np.round(velocity, 9) + 0.0


def perform(
    site: PhantomSite,
    motion: Motion,
    sensor: Sensor,
    clock: SpeedClock,
    random: np.random.Generator,
    *,
    hole: float | None = None,
) -> RigRun:
    """Insert along ``motion`` and record; ``hole`` [m] is the depth of an earlier pass in the rig's zero."""
    time = np.arange(int(motion.duration * FORCE_RATE_HZ) + 1) / FORCE_RATE_HZ
    depth = motion.at(time)[0] - site.surface
    hole_depth = 0.0 if hole is None else hole - site.surface
    force = site.specimen.force(depth, hole=hole_depth, dt=1.0 / FORCE_RATE_HZ)
    wrench = wrench_of(site, force)
    stamps, velocity = clock.record(motion, random)  # first, so that the sensor's settings do not change its draws
    axes = sensor.record(wrench, random)
    card = Card(
        source="virtual rig", needle=NEEDLE, tissue=f"simulated phantom, site {site.number}",
        rig=f"virtual rig: {site.speed * 1e3:g} mm/s, force at {FORCE_RATE_HZ:g} Hz, velocity at {clock.rate:g} Hz",
        filter_length=sensor.filter_length,
    )  # fmt: skip
    return RigRun(
        speed=site.speed,
        site=site.number,
        second=hole is not None,
        time=time,
        axes=axes,
        motion_time=stamps,
        velocity=velocity,
        start_depth=motion.start,
        card=card,
    )
