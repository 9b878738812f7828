# SPDX-License-Identifier: Apache-2.0
"""Contact of a rigid axisymmetric tip with an elastic half-space, over arrays; also of a profile that a function
gives by its slope."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .. import core
from ..errors import InputError

NODES, WEIGHTS = np.polynomial.legendre.leggauss(16)
NODES, WEIGHTS = 0.5 * (1 + NODES), 0.5 * WEIGHTS  # on [0, 1]
WIDEST = 1e3  # [m]; a contact that has to be wider is out of the profile's reach
LOOKS = 400  # radii at which a slope is looked at before it is believed


@dataclass(frozen=True)
class Contact:
    """Depth [m], contact radius [m], force [N] and slope dF/dh [N/m]; shaped like the input.

    ``energy`` [J] is the elastic energy stored, integrated when it is first asked for.
    """

    depth: np.ndarray
    contact_radius: np.ndarray
    force: np.ndarray
    slope: np.ndarray
    tip: Any = field(repr=False, compare=False)
    reduced_modulus: float = field(repr=False, compare=False)

    @property
    def energy(self):
        """Elastic energy stored [J], shaped like the input."""
        depth, radius = np.atleast_1d(self.depth).ravel(), np.atleast_1d(self.contact_radius).ravel()
        energy = _mechanics(self.tip).contact_energy(self.tip, depth, radius, self.reduced_modulus)
        return _shaped(energy, self._shape)

    def pressure(self, radius) -> np.ndarray:
        """Contact pressure [Pa] at radii [m] from the axis, any shape; shaped like the contact, then like ``radius``.

        Zero outside the contact, infinite at an edge that the shank or a flat face fixes and under a sharp apex. To
        1e-8, for pictures. Raises InputError for radii that are negative or not finite.
        """
        given = np.asarray(radius, dtype=float)
        if not (np.isfinite(given).all() and (given >= 0).all()):
            raise InputError("radius", "negative or not finite", next_step="Give distances from the axis in m.")
        flat = np.ascontiguousarray(given.ravel())
        states = zip(np.ravel(self.depth), np.ravel(self.contact_radius))
        pressure = _mechanics(self.tip).contact_pressure
        rows = [
            pressure(self.tip, h, a, self.reduced_modulus, flat) if a > 0 else np.zeros(flat.shape) for h, a in states
        ]
        return np.array(rows).reshape((*self._shape, *given.shape))[()]

    @property
    def _shape(self) -> tuple[int, ...]:
        return np.shape(self.depth)


def contact(
    tip,
    *,
    reduced_modulus: float,
    depth=None,
    contact_radius=None,
    shank_radius: float | None = None,
    slope_breaks=(),
) -> Contact:
    """Sneddon's contact of ``tip`` at a depth or at a contact radius [m], any shape; give exactly one of the two.

    ``tip`` is one of ``nf.tips``, of which ``Profile`` takes arrays, or a function that gives the slope df/dr of a
    profile at an array of radii [m], integrated at Gauss nodes between the radii ``slope_breaks`` [m] where it breaks.
    ``reduced_modulus`` [Pa] > 0. ``shank_radius`` [m]: the tip sits on a cylinder of that radius, where the contact
    stops growing (Galin's form with a fixed edge), as it does at the tip's own end; None is a tip that goes on for
    ever, as the paper's eq. (6) has it.
    Raises InputError for a modulus or radius that is not positive, for values that are not finite or negative radii,
    for a radius that does not tell the depth, and for a slope that falls, is vertical or makes the contact jump.
    """
    if (depth is None) == (contact_radius is None):
        raise InputError("contact", next_step="Give exactly one of depth and contact_radius.")
    _positive("reduced_modulus", reduced_modulus, "Pa")
    given = np.asarray(depth if contact_radius is None else contact_radius, dtype=float)
    if not np.isfinite(given).all():
        raise InputError("contact", "not finite", "at least one depth or radius is NaN or infinite")
    values = np.ascontiguousarray(given.ravel())
    shank = np.inf if shank_radius is None else _positive("shank_radius", shank_radius, "m")
    tip = _checked(tip, slope_breaks, shank, values)
    if contact_radius is None:
        columns = _mechanics(tip).contact_at_depth(tip, values, reduced_modulus, shank)
    else:
        _within(values, tip, shank)
        columns = _mechanics(tip).contact_at_radius(tip, values, reduced_modulus)
    depth_, radius, force = (_shaped(column, given.shape) for column in columns)
    return Contact(depth_, radius, force, 2.0 * reduced_modulus * radius, tip, float(reduced_modulus))


def _checked(tip, slope_breaks, shank: float, values: np.ndarray):
    """A tip of the core as it is; a function as a tip of its own, checked as far as the values reach."""
    if type(tip) in vars(core.tips).values():
        return tip
    if not callable(tip):
        raise InputError(
            "tip", repr(tip), "neither one of nf.tips nor a function", next_step="Arrays make a tips.Profile."
        )
    return SlopeContact(tip, slope_breaks, shank, values)


def _mechanics(tip):
    """Where the contact of a tip is computed: the core, or a slope's own quadrature."""
    return tip if isinstance(tip, SlopeContact) else core


def _positive(quantity: str, value: float, unit: str) -> float:
    if not (np.isfinite(value) and value > 0):
        raise InputError(quantity, value, f"must be above 0 {unit}")
    return float(value)


def _within(radius: np.ndarray, tip, shank_radius: float) -> None:
    limit = min(shank_radius, tip.end)
    if radius.size and (radius.min() < 0 or radius.max() > limit or (radius.max() == tip.end > tip.flat)):
        next_step = "Give the depth instead: beyond the shank or the end of the tip the radius no longer tells it."
        raise InputError(
            "contact_radius",
            f"{radius.min():.4g} to {radius.max():.4g} m",
            f"outside 0 to {limit:.4g} m",
            next_step=next_step,
        )
    if radius.size and radius.max() > 0 and radius[radius > 0].min() <= tip.flat:
        raise InputError(
            "contact_radius",
            f"{radius[radius > 0].min():.4g} m",
            f"not beyond the flat face, {tip.flat:.4g} m, which touches at once",
            next_step="Give the depth instead.",
        )


def _shaped(column: np.ndarray, shape: tuple[int, ...]):
    return column.reshape(shape) if shape else float(column[0])


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
