# SPDX-License-Identifier: Apache-2.0
"""Contact of a profile that a function gives by its slope: the core's quadrature, in NumPy."""

import numpy as np

from ..errors import InputError

NODES, WEIGHTS = np.polynomial.legendre.leggauss(16)
NODES, WEIGHTS = 0.5 * (1 + NODES), 0.5 * WEIGHTS  # on [0, 1]
WIDEST = 1e3  # [m]; a contact that has to be wider is out of the profile's reach
LOOKS = 400  # radii at which a slope is looked at before it is believed


class SlopeContact:
    """Depth, force, energy and pressure of a slope function; it offers what the core offers for its tips.

    Smooth between its breaks it keeps 1e-12; the function sees arrays of radii [m] and gives as many slopes.
    """

    end, flat = np.inf, 0.0

    def __init__(self, slope, breaks, shank: float, values: np.ndarray):
        self.slope = slope
        self.breaks = np.sort(np.asarray(breaks, dtype=float).ravel())
        self._check(min(shank, self._farthest(values)))

    def _farthest(self, values: np.ndarray) -> float:
        """No contact is wider than this: where the profile stands as high as the largest value."""
        largest = float(values.max(initial=0.0)) or 1e-3
        with np.errstate(all="ignore"):
            radius = largest * 2.0 ** np.arange(-10, 30)
            wide = [r for r in radius if np.isfinite(d := self.depths(np.array([r]))[0]) and d >= largest]
        return max(wide[0], largest) if wide else largest

    def _check(self, farthest: float) -> None:
        radii = farthest * (np.arange(LOOKS) + 0.5) / LOOKS
        slopes = self._slopes(radii)
        for wrong, limit, next_step in (
            (
                ~np.isfinite(slopes),
                "not finite: the profile is vertical there",
                "End the tip with shank_radius before.",
            ),
            (slopes < 0, "falling: the profile is not monotone", "Give df/dr of heights above the apex."),
        ):
            if wrong.any():
                at = int(np.argmax(wrong))
                raise InputError("slope", f"{slopes[at]:.4g}", limit, f"at radius {radii[at]:.4g} m", next_step)
        self._rising(radii)

    def _slopes(self, radii: np.ndarray) -> np.ndarray:
        """What the function gives, which may be one number for all radii, as (n,)."""
        try:
            with np.errstate(all="ignore"):
                given = np.asarray(self.slope(radii))
                if np.iscomplexobj(given):
                    raise TypeError("complex slopes")
                return np.broadcast_to(given.astype(float), radii.shape)
        except (TypeError, ValueError) as error:
            next_step = "Give a function of an array of radii that gives as many real slopes."
            raise InputError("slope", repr(self.slope), str(error), "at its radii", next_step) from None

    def _rising(self, radii: np.ndarray) -> None:
        depths = self.depths(radii)
        falling = np.diff(depths) < -1e-9 * np.abs(depths[1:])
        if falling.any():
            at = int(np.argmax(falling)) + 1
            place, next_step = f"at contact radius {radii[at]:.4g} m", "Give a profile without hollows."
            raise InputError(
                "depth", f"{depths[at]:.4g} m", "less than of a smaller contact, which would jump", place, next_step
            )
        if not depths[-1] > 0:
            raise InputError("slope", 0, "0 everywhere", next_step="A flat face is the tip Flat.")

    def _sums(self, radius: np.ndarray):
        """Depth and force over reduced modulus at contact radii (n,)."""
        ends = np.concatenate(([0.0], self.breaks[self.breaks > 0], [np.inf]))
        theta = np.arcsin(np.minimum(ends / np.where(radius > 0, radius, np.inf)[:, None], 1.0))
        theta[:, -1] = np.pi / 2
        width = np.diff(theta, axis=1)[..., None]
        sine = np.sin(theta[:, :-1, None] + width * NODES)
        slopes = self._slopes((radius[:, None, None] * sine).ravel()).reshape(sine.shape)
        depth = radius * (width * WEIGHTS * slopes).sum(axis=(1, 2))
        return depth, 2 * radius**2 * (width * WEIGHTS * sine**2 * slopes).sum(axis=(1, 2))

    def depths(self, radius: np.ndarray) -> np.ndarray:
        """Depth [m] at contact radii (n,)."""
        return self._sums(radius)[0]

    def contact_at_radius(self, _tip, radius: np.ndarray, modulus: float):
        """Depth, contact radius and force at contact radii (n,)."""
        depth, force = self._sums(radius)
        return depth, radius, modulus * force

    def contact_at_depth(self, _tip, depth: np.ndarray, modulus: float, shank: float):
        """Depth, contact radius and force at depths (n,), on a shank."""
        wanted = np.maximum(depth, 0.0)
        low, high = np.zeros_like(wanted), np.full_like(wanted, min(shank, max(wanted.max(initial=0.0), 1e-12)))
        with np.errstate(all="ignore"):
            while high.size and high[0] < min(shank, WIDEST) and (self.depths(high) < wanted).any():
                high = np.minimum(2 * high, shank)
        if high.size and high[0] >= WIDEST:
            next_step = "Give a shallower depth, or the shank_radius at which the tip ends."
            raise InputError("depth", f"{wanted.max():.4g} m", "deeper than the profile is high", next_step=next_step)
        for _ in range(60):  # bisection: two digits in seven steps, whatever the function
            middle = 0.5 * (low + high)
            deep = self.depths(middle) >= wanted
            low, high = np.where(deep, low, middle), np.where(deep, middle, high)
        reached, force = self._sums(high)
        return (
            depth,
            np.where(wanted > 0, high, 0.0),
            modulus * np.where(wanted > 0, force + 2 * high * (wanted - reached), 0.0),
        )

    def contact_energy(self, _tip, depth: np.ndarray, radius: np.ndarray, modulus: float) -> np.ndarray:
        """Stored energy (n,) [J]: E_r times the integral of (h - g)^2, where g(s) is the depth at contact radius s."""
        return np.array([modulus * self._energy(h, a) if a > 0 else 0.0 for h, a in zip(depth, radius)])

    def _energy(self, depth: float, radius: float) -> float:
        ends = np.concatenate(([0.0], self.breaks[(self.breaks > 0) & (self.breaks < radius)], [radius]))
        width = np.diff(ends)[:, None]
        at = (ends[:-1, None] + width * NODES**2).ravel()  # g rises like a root behind a break
        left = (depth - self.depths(at)) ** 2
        return float((width * WEIGHTS * 2 * NODES * left.reshape(len(width), -1)).sum())

    def contact_pressure(self, _tip, depth: float, contact_radius: float, modulus: float, radius: np.ndarray):
        """Pressure [Pa] at radii (n,): Galin's form by parts, as the core has it."""
        return np.array([modulus * self._pressure(depth, contact_radius, r) for r in radius])

    def _pressure(self, h: float, a: float, r: float) -> float:
        if r >= a:
            return 0.0
        r = max(r, 1e-9 * a)
        inner = self.breaks[(self.breaks > r) & (self.breaks < a)]
        ends = np.unique(np.concatenate([np.arccosh(np.append(inner, a) / r), np.arange(0.0, np.arccosh(a / r))]))
        width = np.diff(ends)[:, None]
        w = (ends[:-1, None] + width * NODES**2).ravel()
        here = self.depths(np.array([r]))[0]
        rise = (self.depths(r * np.cosh(w)) - here) * np.cosh(w) / (r * np.sinh(w) ** 2)
        integral = (width * WEIGHTS * 2 * NODES * rise.reshape(len(width), -1)).sum()
        return float(integral + (h - here) / np.sqrt((a - r) * (a + r))) / np.pi
