# SPDX-License-Identifier: Apache-2.0
"""A layer of tissue with laws of its own."""

from dataclasses import dataclass, field
from typing import Any

from .. import core
from ..errors import InputError
from .laws import FAMILIES


@dataclass(frozen=True)
class Layer:
    """One law for each part of the force, from the depth ``top`` [m] below the undeformed surface on.

    The puncture is counted from the layer's top; a puncture depth or force of 0 is an interface that does not resist.
    """

    top: float
    stiffness: Any
    puncture: Any
    friction: Any
    cutting: Any
    relaxation: Any = field(default_factory=core.laws.NoRelaxation)

    def __post_init__(self):
        for family, law in zip(FAMILIES, self.parts):
            if getattr(law, "family", None) != family:
                raise InputError(family, repr(law), f"not a law of {family}", next_step="Give one of nf.laws.")
        if isinstance(self.top, bool) or not isinstance(self.top, (int, float)):
            raise InputError("layer.top", repr(self.top), "not a number", next_step="Give the depth in m.")

    @property
    def parts(self) -> tuple:
        """The five laws."""
        return (self.stiffness, self.puncture, self.friction, self.cutting, self.relaxation)

    @property
    def laws(self):
        """The five laws as the core takes them."""
        return core.Laws(*self.parts)
