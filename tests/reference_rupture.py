# SPDX-License-Identifier: Apache-2.0
"""A layer that yields, step by step from the text of its specification; no code is shared with the core."""

import math


class YieldingLayer:
    """Contact c h^2 up to the puncture at ``z1``; then damage, and tissue dragged along by a spring.

    Without relaxation; depths [m] from the layer's undeformed top, forces [N].
    """

    def __init__(self, c, z1, grip, spring, delta, z_r, q=0.0):
        self.c, self.z1, self.grip, self.spring, self.delta, self.z_r, self.q = c, z1, grip, spring, delta, z_r, q
        self.pierced, self.deepest, self.last, self.shaft = False, -math.inf, None, 0.0
        peak, energy = c * z1**2, c * z1**3 / 3.0
        slides = grip * max(0.0, z1 - z_r) / (1.0 + grip / spring)
        self.taken = min(slides, peak, 2.0 * spring * energy / peak)
        self.w = 1.0 - self.taken / peak

    def intact(self):
        """1 - d, of Kachanov's equation (1 - d)^q = 1 - q s / delta."""
        s = (self.deepest - self.z1) / self.delta
        if self.q == 0.0:
            return math.exp(-s)
        return max(0.0, 1.0 - self.q * s) ** (1.0 / self.q)

    def step(self, z):
        """The force at a depth."""
        travel, self.last = (0.0 if self.last is None else z - self.last), z
        self.deepest = max(self.deepest, z)
        if not self.pierced:
            if z <= self.z1:
                return self.c * max(0.0, z) ** 2
            self.pierced, self.shaft, travel = True, self.taken, z - self.z1
        length = z - self.z_r - self.shaft / self.spring
        limit = self.grip * max(0.0, length)
        if length <= 0.0 and z < self.deepest:
            self.shaft = 0.0
        else:
            self.shaft = min(max(self.shaft + self.spring * travel, -limit), limit)
        left = max(0.0, self.z1 - (self.deepest - z))
        return self.intact() * self.w * self.c * left**2 + self.shaft
