# SPDX-License-Identifier: Apache-2.0
"""Materials of a solid: linear elastic, neo-Hookean, Mooney-Rivlin."""

from collections.abc import Sequence
from dataclasses import dataclass

from ..errors import InputError

_MAX_RATIO = 0.49999


def check_positive(quantity: str, value: float, unit: str) -> None:
    """Raise InputError for a value that is not above 0 and finite."""
    if not (value > 0.0 and value < float("inf")):
        raise InputError(quantity, f"{value} {unit}", "must be above 0", next_step=f"Give it in {unit}.")


def _ratio(value: float) -> None:
    if 0.0 <= value <= _MAX_RATIO:
        return
    step = "Use 0.4999: displacements differ by less than 0.1 %."
    if value != value or value > 0.5 or value < 0.0:
        step = "Soft tissue is at 0.45 to 0.4999."
    raise InputError("poisson_ratio", value, f"must be 0 to {_MAX_RATIO}", next_step=step)


@dataclass(frozen=True)
class Elastic:
    """Linear elastic, isotropic.

    Parameters
    ----------
    young_modulus : float
        [Pa], above 0.
    poisson_ratio : float
        0 to 0.49999; elements do not lock there.
    density : float, optional
        [kg/m^3], for dynamics.

    Raises
    ------
    InputError
        If a value is out of its range.
    """

    young_modulus: float
    poisson_ratio: float = 0.49
    density: float = 1000.0

    def __post_init__(self) -> None:
        check_positive("young_modulus", self.young_modulus, "Pa")
        check_positive("density", self.density, "kg/m^3")
        _ratio(self.poisson_ratio)

    @property
    def shear_modulus(self) -> float:
        """[Pa]"""
        return self.young_modulus / (2.0 * (1.0 + self.poisson_ratio))

    @property
    def lame_modulus(self) -> float:
        """Lamé's first constant [Pa]."""
        nu = self.poisson_ratio
        return self.young_modulus * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))


def check_labels(labels: object) -> None:
    """Raise InputError for what are no names of layers, each once."""
    if isinstance(labels, str) or not isinstance(labels, Sequence) or len(set(labels)) < len(labels):
        step = 'Give labels=("skin", "fat").'
        raise InputError("labels", repr(labels)[:60], "must be names, each once", next_step=step)
