# SPDX-License-Identifier: Apache-2.0
"""The speed on its own clock: 60 Hz beside the force's 1 kHz."""

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..models.motion import Motion


@dataclass(frozen=True)
class SpeedClock:
    """Velocity as a drive reports it: sampled on its own clock, with noise, in steps of ``resolution``.

    ``rate`` [Hz] is the paper's. ``jitter`` [s] is the standard deviation of the time stamps, ``noise`` [m/s] that of
    the velocity and ``resolution`` [m/s] its step: the paper gives none of them; these are assumed. Over a cycle of
    15 s the integral of the noise wanders by about 0.01 mm.
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
        """Time stamps (n,) [s] and velocity (n,) [m/s] from within the first period to the end of the motion.

        The phase against the force's clock is drawn. A stamp is off by at most a quarter of a period: time increases.
        """
        period = 1.0 / self.rate
        taken = np.arange(random.uniform(0.0, period), motion.duration, period)
        velocity = motion.at(taken)[1] + random.normal(0.0, self.noise, len(taken))
        if self.resolution:
            velocity = np.rint(velocity / self.resolution) * self.resolution
        late = np.clip(random.normal(0.0, self.jitter, len(taken)), -0.25 * period, 0.25 * period)
        return np.round(np.maximum(taken + late, 0.0), 6), np.round(velocity, 9) + 0.0
