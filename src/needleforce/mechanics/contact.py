# SPDX-License-Identifier: Apache-2.0
"""Contact of a rigid axisymmetric tip with an elastic half-space, over arrays; the tip may be a function that gives
the slope of its profile."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import core
from ..checks import above_zero
from ..errors import InputError

NODES, WEIGHTS = np.polynomial.legendre.leggauss(16)
NODES, WEIGHTS = 0.5 * (1 + NODES), 0.5 * WEIGHTS  # on [0, 1]
MAX_CONTACT_RADIUS_M = 1e3  # the search for a contact radius ends here
N_SLOPE_CHECKS = 400  # radii at which the values of a slope function are checked


@dataclass(frozen=True, kw_only=True)
class Contact:
    """State of a contact; each array has the shape of the input of ``contact``, a float for a number.

    Attributes
    ----------
    depth : ndarray or float
        Depth of the apex below the undeformed surface [m].
    contact_radius : ndarray or float
        Radius of the contact [m].
    force : ndarray or float
        Axial force [N].
    slope : ndarray or float
        Stiffness dF/dh [N/m].
    tip : object
        The tip.
    reduced_modulus : float
        Reduced modulus E_r [Pa].
    """

    depth: np.ndarray
    contact_radius: np.ndarray
    force: np.ndarray
    slope: np.ndarray
    tip: Any = field(repr=False, compare=False)
    reduced_modulus: float = field(repr=False, compare=False)

    @property
    def energy(self) -> np.ndarray | float:
        """Elastic energy stored [J], shaped like the input; integrated at each call."""
        depth, radius = np.atleast_1d(self.depth).ravel(), np.atleast_1d(self.contact_radius).ravel()
        energy = _mechanics(self.tip).contact_energy(self.tip, depth, radius, self.reduced_modulus)
        return _shaped(energy, self._shape)

    def pressure(self, radius: ArrayLike) -> np.ndarray:
        """Contact pressure at distances from the axis.

        Parameters
        ----------
        radius : array_like
            Distances from the axis [m], at least 0, any shape.

        Returns
        -------
        ndarray
            Pressure [Pa] to a relative 1e-8; its shape is that of the contact followed by that of ``radius``. It is 0
            outside the contact, and infinite under a sharp apex and at an edge that the shank or a flat face fixes.

        Raises
        ------
        InputError
            If a radius is negative or not finite.
        """
        radii = np.asarray(radius, dtype=float)
        if not (np.isfinite(radii).all() and (radii >= 0).all()):
            raise InputError("radius", "negative or not finite", next_step="Give distances from the axis in m.")
        flat = np.ascontiguousarray(radii.ravel())
        states = zip(np.ravel(self.depth), np.ravel(self.contact_radius))
        pressure = _mechanics(self.tip).contact_pressure
        rows = [
            pressure(self.tip, h, a, self.reduced_modulus, flat) if a > 0 else np.zeros(flat.shape) for h, a in states
        ]
        return np.array(rows).reshape((*self._shape, *radii.shape))[()]

    @property
    def _shape(self) -> tuple[int, ...]:
        return np.shape(self.depth)


def contact(
    tip: Any,
    *,
    reduced_modulus: float,
    depth: ArrayLike | None = None,
    contact_radius: ArrayLike | None = None,
    shank_radius: float | None = None,
    slope_breaks: ArrayLike = (),
) -> Contact:
    """Contact of a rigid axisymmetric tip with an elastic half-space, at a depth or at a contact radius.

    Exactly one of ``depth`` and ``contact_radius`` is given.

    Parameters
    ----------
    tip : object
        One of ``nf.tips``, or a function that returns the slope df/dr of a profile for an array of radii [m].
    reduced_modulus : float
        Reduced modulus E_r [Pa], above 0.
    depth : array_like, optional
        Depth of the apex below the undeformed surface [m], any shape; the force is 0 above the surface.
    contact_radius : array_like, optional
        Radius of the contact [m], at least 0, any shape.
    shank_radius : float, optional
        Radius of the cylinder behind the tip [m], above 0, at which the contact stops growing. Without it the tip is
        unbounded, as in the source paper's eq. (6). The contact also stops at the tip's own end.
    slope_breaks : array_like
        For a function: radii [m] at which the slope is not smooth.

    Returns
    -------
    Contact
        Depth, contact radius, force and stiffness, with the shape of the input.

    Raises
    ------
    InputError
        If not exactly one of depth and contact radius is given; if a modulus or shank radius is not above 0; if a value
        is not finite or a radius is negative; if a contact radius does not determine the depth; if a slope function is
        negative or vertical, or makes the contact radius jump.

    Notes
    -----
    Sneddon 1965, eqs. (2) and (3), with the contact edge fixed at the shank (Galin 1953). The slope of a function is
    integrated at Gauss nodes between its breaks.
    """
    if (depth is None) == (contact_radius is None):
        found = "neither" if depth is None else "both"
        raise InputError("depth or contact_radius", found, "exactly one is needed", next_step="Give one of the two.")
    above_zero("reduced_modulus", reduced_modulus, "Pa")
    quantity = "depth" if contact_radius is None else "contact_radius"
    given = np.asarray(depth if contact_radius is None else contact_radius, dtype=float)
    if not np.isfinite(given).all():
        limit = f"{np.count_nonzero(~np.isfinite(given))} of {given.size} values are NaN or infinite"
        raise InputError(quantity, "not finite", limit, next_step="Remove these values.")
    values = np.ascontiguousarray(given.ravel())
    shank = np.inf if shank_radius is None else float(above_zero("shank_radius", shank_radius, "m"))
    tip = _checked(tip, slope_breaks, shank, values)
    if contact_radius is None:
        columns = _mechanics(tip).contact_at_depth(tip, values, reduced_modulus, shank)
    else:
        _within(values, tip, shank)
        columns = _mechanics(tip).contact_at_radius(tip, values, reduced_modulus)
    reached, radius, force = (_shaped(column, given.shape) for column in columns)
    return Contact(
        depth=reached,
        contact_radius=radius,
        force=force,
        slope=2.0 * reduced_modulus * radius,
        tip=tip,
        reduced_modulus=float(reduced_modulus),
    )


def _checked(tip: Any, slope_breaks: ArrayLike, shank: float, values: np.ndarray) -> Any:
    """A tip of the core unchanged, or a function as a ``SlopeContact``, checked up to the largest of ``values``."""
    if type(tip) in vars(core.tips).values():
        return tip
    if not callable(tip):
        raise InputError(
            "tip", repr(tip), "neither one of nf.tips nor a function", next_step="For arrays give nf.tips.Profile."
        )
    return SlopeContact(tip, slope_breaks, shank, values)


def _mechanics(tip: Any) -> Any:
    """What computes the contact of a tip: the core, or the quadrature of a slope function."""
    return tip if isinstance(tip, SlopeContact) else core


def _within(radius: np.ndarray, tip: Any, shank_radius: float) -> None:
    """Raise InputError for contact radii beyond the shank or the end of the tip, or within its flat face."""
    limit = min(shank_radius, tip.end)
    if radius.size and (radius.min() < 0 or radius.max() > limit or (radius.max() == tip.end > tip.flat)):
        value, bounds = f"{radius.min():.4g} to {radius.max():.4g} m", f"outside 0 to {limit:.4g} m"
        next_step = "Give the depth instead: from the shank or the end of the tip on, the radius is constant."
        raise InputError("contact_radius", value, bounds, next_step=next_step)
    if radius.size and radius.max() > 0 and radius[radius > 0].min() <= tip.flat:
        value = f"{radius[radius > 0].min():.4g} m"
        face = f"within the flat face of radius {tip.flat:.4g} m, all of which touches at first contact"
        raise InputError("contact_radius", value, face, next_step="Give the depth instead.")


def _shaped(column: np.ndarray, shape: tuple[int, ...]) -> np.ndarray | float:
    return column.reshape(shape) if shape else float(column[0])


class SlopeContact:
    """Depth, force, energy and pressure for a slope function, with the functions that the core has for its tips.

    The relative error is 1e-12 if the slope is smooth between its breaks. The function is called with an array of radii
    [m] and returns as many slopes.
    """

    end, flat = np.inf, 0.0

    def __init__(self, slope: Callable, breaks: ArrayLike, shank: float, values: np.ndarray):
        self.slope = slope
        self.breaks = np.sort(np.asarray(breaks, dtype=float).ravel())
        self._check(min(shank, self._max_radius(values)))

    def _max_radius(self, values: np.ndarray) -> float:
        """Upper bound of the contact radius [m]: where the depth reaches the largest value."""
        largest = float(values.max(initial=0.0)) or 1e-3
        with np.errstate(all="ignore"):
            radius = largest * 2.0 ** np.arange(-10, 30)
            wide = [r for r in radius if np.isfinite(d := self.depths(np.array([r]))[0]) and d >= largest]
        return max(wide[0], largest) if wide else largest

    def _check(self, max_radius: float) -> None:
        radii = max_radius * (np.arange(N_SLOPE_CHECKS) + 0.5) / N_SLOPE_CHECKS
        slopes = self._slopes(radii)
        for wrong, limit, next_step in (
            (
                ~np.isfinite(slopes),
                "not finite: the profile is vertical there",
                "Give a shank_radius below this radius.",
            ),
            (slopes < 0, "negative: the profile is not monotone", "Give df/dr of heights above the apex."),
        ):
            if wrong.any():
                at = int(np.argmax(wrong))
                raise InputError("slope", f"{slopes[at]:.4g}", limit, f"at radius {radii[at]:.4g} m", next_step)
        self._check_depths(radii)

    def _slopes(self, radii: np.ndarray) -> np.ndarray:
        """Values of the function (n,); it may return one number for all radii."""
        try:
            with np.errstate(all="ignore"):
                slopes = np.asarray(self.slope(radii))
                if np.iscomplexobj(slopes):
                    raise TypeError("complex slopes")
                return np.broadcast_to(slopes.astype(float), radii.shape)
        except (TypeError, ValueError) as error:
            next_step = "Give a function that returns a real slope for each of an array of radii."
            raise InputError("slope", repr(self.slope), str(error), "at its radii", next_step) from None

    def _check_depths(self, radii: np.ndarray) -> None:
        """Raise InputError where the depth does not increase with the contact radius."""
        depths = self.depths(radii)
        falling = np.diff(depths) < -1e-9 * np.abs(depths[1:])
        if falling.any():
            at = int(np.argmax(falling)) + 1
            place, next_step = f"at contact radius {radii[at]:.4g} m", "Give a profile without hollows."
            limit = "less than at a smaller contact radius: the contact would jump"
            raise InputError("depth", f"{depths[at]:.4g} m", limit, place, next_step)
        if not depths[-1] > 0:
            raise InputError("slope", 0, "0 everywhere", next_step="For a flat face give nf.tips.Flat.")

    def _sums(self, radius: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Depth [m] and force over reduced modulus [m^2] at contact radii (n,)."""
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

    def contact_at_radius(self, _tip: Any, radius: np.ndarray, modulus: float) -> tuple[np.ndarray, ...]:
        """Depth [m], contact radius [m] and force [N] at contact radii (n,)."""
        depth, force = self._sums(radius)
        return depth, radius, modulus * force

    def contact_at_depth(
        self, _tip: Any, depth: np.ndarray, modulus: float, shank: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Depth [m], contact radius [m] and force [N] at depths (n,), on a shank."""
        wanted = np.maximum(depth, 0.0)
        low, high = np.zeros_like(wanted), np.full_like(wanted, min(shank, max(wanted.max(initial=0.0), 1e-12)))
        with np.errstate(all="ignore"):
            while high.size and high[0] < min(shank, MAX_CONTACT_RADIUS_M) and (self.depths(high) < wanted).any():
                high = np.minimum(2 * high, shank)
        if high.size and high[0] >= MAX_CONTACT_RADIUS_M:
            next_step = "Give a shallower depth, or the shank_radius at which the tip ends."
            raise InputError("depth", f"{wanted.max():.4g} m", "deeper than the profile is high", next_step=next_step)
        for _ in range(60):  # bisection gains two digits in seven steps for any function
            middle = 0.5 * (low + high)
            deep = self.depths(middle) >= wanted
            low, high = np.where(deep, low, middle), np.where(deep, middle, high)
        reached, force = self._sums(high)
        return (
            depth,
            np.where(wanted > 0, high, 0.0),
            modulus * np.where(wanted > 0, force + 2 * high * (wanted - reached), 0.0),
        )

    def contact_energy(self, _tip: Any, depth: np.ndarray, radius: np.ndarray, modulus: float) -> np.ndarray:
        """Stored energy (n,) [J]: E_r times the integral of (h - g)^2, where g(s) is the depth at contact radius s."""
        return np.array([modulus * self._energy(h, a) if a > 0 else 0.0 for h, a in zip(depth, radius)])

    def _energy(self, depth: float, radius: float) -> float:
        ends = np.concatenate(([0.0], self.breaks[(self.breaks > 0) & (self.breaks < radius)], [radius]))
        width = np.diff(ends)[:, None]
        at = (ends[:-1, None] + width * NODES**2).ravel()  # g grows as a square root behind a break
        left = (depth - self.depths(at)) ** 2
        return float((width * WEIGHTS * 2 * NODES * left.reshape(len(width), -1)).sum())

    def contact_pressure(
        self, _tip: Any, depth: float, contact_radius: float, modulus: float, radius: np.ndarray
    ) -> np.ndarray:
        """Pressure [Pa] at radii (n,): Galin's form, integrated by parts as in the core."""
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
