# SPDX-License-Identifier: Apache-2.0
"""What a loading curve is to a fit: F(h) = sum of a_k phi_k(h; s), zero without contact.

The amplitudes a are linear and projected out; the shape numbers s are sought. A curve is one value in ``curves.py``;
nothing else asks for its name.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class ShapeNumber:
    """A number that is sought: unit, and where to start, least and most, all times indentation ** ``power``."""

    unit: str
    power: int
    starts: tuple[float, ...]
    low: float
    high: float


@dataclass(frozen=True)
class LoadingCurve:
    """A stiffness law as a fit sees it. Functions take h (n,) [m], none below 0, and the shape numbers, SI.

    ``amplitudes`` maps names to units; none is negative, so that the curve rises. ``basis`` gives phi, one (n,) an
    amplitude, ``by_depth`` its derivatives by h, ``by_shape`` a list of its derivatives for each shape number.
    ``stiffness(values, half_angle)`` makes the law, with the tip's half angle [rad] for one that has a tip.
    ``complete`` names the law of the complete fit that finds the puncture: its own, or one that follows most curves.
    ``tells_modulus``: the reduced modulus follows from the numbers and the tip. ``not_told_apart(values)`` names the
    numbers of which these values, with ``puncture_indentation``, tell a product only.
    """

    law: type
    amplitudes: Mapping[str, str]
    basis: Callable[..., Sequence]
    by_depth: Callable[..., Sequence]
    stiffness: Callable
    shape: Mapping[str, ShapeNumber] = field(default_factory=dict)
    by_shape: Callable[..., Sequence] = lambda h, *shape: ()
    complete: str = "cone_cylinder"
    tells_modulus: bool = False
    not_told_apart: Callable[[Mapping[str, float]], tuple[str, ...]] = lambda values: ()

    @property
    def units(self) -> dict[str, str]:
        """Name to unit of all numbers."""
        return {**self.amplitudes, **{name: number.unit for name, number in self.shape.items()}}

    def force(self, h: np.ndarray, values: Mapping[str, float]) -> np.ndarray:
        """F [N], shaped as h [m]; 0 below 0."""
        return self._sum(values, self.basis(np.maximum(h, 0.0), *self._shape(values)))

    def gradient(self, h: np.ndarray, values: Mapping[str, float]) -> dict[str, np.ndarray]:
        """The derivatives of F(z - z0) by each number and by ``contact_depth`` z0, each shaped as h; 0 below 0."""
        h, shape = np.maximum(h, 0.0), self._shape(values)
        found = dict(zip(self.amplitudes, self.basis(h, *shape)))
        found["contact_depth"] = -self._sum(values, self.by_depth(h, *shape))
        return found | {name: self._sum(values, each) for name, each in zip(self.shape, self.by_shape(h, *shape))}

    def _shape(self, values: Mapping[str, float]) -> list[float]:
        return [values[name] for name in self.shape]

    def _sum(self, values: Mapping[str, float], parts: Sequence) -> np.ndarray:
        return sum(values[name] * part for name, part in zip(self.amplitudes, parts))
