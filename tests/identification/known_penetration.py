# SPDX-License-Identifier: Apache-2.0
"""A penetration test with known peaks, drag and work."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import erf

STEP = 1e-5  # [m] of travel between two samples


@dataclass(frozen=True)
class Needle:
    """A needle through a film: power law up to the tip entry, a linear fall, a parabola up to the heel, and a Gaussian
    decline to the drag."""

    contact: float = 0.6e-3
    entry_at: float = 1.5e-3
    entry: float = 0.8
    exponent: float = 1.5
    fall_over: float = 5e-5
    valley: float = 0.4
    heel_at: float = 3.2e-3
    heel: float = 1.1
    decline: float = 0.8e-3
    drag: float = 0.25
    end: float = 12e-3

    def force(self, z):
        z = np.asarray(z, dtype=float)
        rise = self.entry * np.clip((z - self.contact) / (self.entry_at - self.contact), 0, 1) ** self.exponent
        x = z - self.entry_at
        fall = self.entry + (self.valley - self.entry) * x / self.fall_over
        u = (x - self.fall_over) / (self.heel_at - self.entry_at - self.fall_over)
        hump = self.valley + (self.heel - self.valley) * (2 * u - u * u)
        tail = self.drag + (self.heel - self.drag) * np.exp(-(((z - self.heel_at) / self.decline) ** 2))
        parts = [z < self.entry_at, x < self.fall_over, z < self.heel_at]
        return np.select(parts, [rise, fall, hump], tail)

    def work(self, to):
        """The integral of the force from the contact to a travel after the heel."""
        hump = self.heel_at - self.entry_at - self.fall_over
        tail = 0.5 * math.sqrt(math.pi) * self.decline * erf((to - self.heel_at) / self.decline)
        return (
            self.entry * (self.entry_at - self.contact) / (self.exponent + 1)
            + 0.5 * (self.entry + self.valley) * self.fall_over
            + hump * (self.valley + 2 / 3 * (self.heel - self.valley))
            + self.drag * (to - self.heel_at)
            + (self.heel - self.drag) * tail
        )

    def true(self):
        return {
            "contact_travel": self.contact,
            "entry_force": self.entry,
            "entry_travel": self.entry_at - self.contact,
            "entry_fall": self.entry - self.valley,
            "heel_force": self.heel,
            "heel_travel": self.heel_at - self.contact,
            "drag": self.drag,
            "max_force": max(self.entry, self.heel),
        }


def drawn(rng):
    entry, contact = rng.uniform(0.3, 1.5), rng.uniform(0.3e-3, 1.5e-3)
    entry_at = contact + rng.uniform(0.6e-3, 1.5e-3)
    heel_at = entry_at + rng.uniform(1e-3, 2.5e-3)
    return Needle(
        contact=contact,
        entry_at=entry_at,
        entry=entry,
        exponent=rng.uniform(1.0, 2.0),
        fall_over=rng.uniform(1e-6, 1e-4),
        valley=entry * rng.uniform(0.2, 0.7),
        heel_at=heel_at,
        heel=entry * rng.uniform(1.0, 2.0),
        decline=rng.uniform(0.4e-3, 1e-3),
        drag=entry * rng.uniform(0.15, 0.4),
        end=heel_at + rng.uniform(6e-3, 12e-3),
    )


def curve(needle, rng, *, step=STEP, noise=5e-3, quantum=0.0, travel_quantum=0.0):
    z = np.arange(0.0, needle.end, step)
    force = needle.force(z) + noise * rng.standard_normal(len(z))
    if quantum:
        force = np.round(force / quantum) * quantum
    return (np.round(z / travel_quantum) * travel_quantum if travel_quantum else z), force
