# SPDX-License-Identifier: Apache-2.0
"""What a fit finds of hyperelastic materials: factors of their moduli by label, and the share of c01."""

from collections.abc import Mapping

import numpy as np

from ..errors import InputError
from .hyperelastic_materials import Hyperelastic, MooneyRivlin, NeoHookean

_STEP = 0.05  # of the logarithm of a modulus, or of the share of c01, in a derivative


class HyperelasticParameters:
    """Numbers that a fit finds: logarithms of factors of moduli, then the share of c01 in c10 + c01, if searched.

    Parameters
    ----------
    start : dict of str to NeoHookean or MooneyRivlin
        Materials of all labels.
    labels : tuple of str
        Those with a factor of their own, the others keep theirs; none for one factor of all.
    find_c01 : bool
        Whether the share of c01 is searched, one for all Mooney-Rivlin materials that are found.

    Attributes
    ----------
    found : tuple of str
        Labels whose moduli are found.
    count, scales : int
        Of all numbers, and of the factors among them.
    common : int or None
        The last factor, if all moduli have one: their derivatives of the logarithm of a force add up to 1.
    exact : bool
        Whether one factor of all is the only number: the force is proportional to it.

    Raises
    ------
    InputError
        If a label is unknown, or no material that is found is Mooney-Rivlin where c01 is searched.
    """

    def __init__(self, start: Mapping[str, Hyperelastic], labels: tuple[str, ...], find_c01: bool):
        self.start, self.labels, self.find_c01 = start, labels, find_c01
        unknown = [label for label in labels if label not in self.start]
        if unknown or len(set(labels)) < len(labels):
            limit = f"must be one of {list(self.start)}, each once"
            raise InputError("label", unknown[0] if unknown else list(labels), limit)
        self.found = labels or tuple(self.start)
        found = [self.start[label] for label in self.found]
        self.shares = [_share(each) for each in found if isinstance(each, MooneyRivlin)]
        if find_c01 and not self.shares:
            step = "Give nf.fe.MooneyRivlin(c10, c01) to the tissue."
            raise InputError("find_c01", True, "no material that is found is Mooney-Rivlin", next_step=step)
        self.scales = max(len(labels), 1)
        self.count = self.scales + find_c01
        together = set(self.found) == set(self.start)
        self.common = self.scales - 1 if together else None
        self.exact = together and self.count == 1

    def beginning(self, factor: float) -> np.ndarray:
        """All moduli by one factor, and the share that is given."""
        share = [np.mean(self.shares)] if self.find_c01 else []
        return self.stable(np.append(np.full(self.scales, np.log(factor)), share))

    def stable(self, numbers: np.ndarray) -> np.ndarray:
        """The share of c01 within 0 to 1, where a material is stable at any stretch."""
        return np.append(numbers[: self.scales], np.clip(numbers[self.scales :], 0.0, 1.0))

    def step(self, numbers: np.ndarray, k: int) -> np.ndarray:
        """Change for a derivative by one number; of a share, inwards."""
        inwards = -1.0 if k >= self.scales and numbers[k] > 0.5 else 1.0
        return inwards * _STEP * (np.arange(self.count) == k)

    def index(self, label: str) -> int:
        """Number of the factor of a label that is found."""
        return self.labels.index(label) if self.labels else 0

    def materials(self, numbers: np.ndarray) -> dict[str, Hyperelastic]:
        """Of all labels."""
        share = float(numbers[self.scales]) if self.find_c01 else None
        return {
            label: _changed(each, float(np.exp(numbers[self.index(label)])), share) if label in self.found else each
            for label, each in self.start.items()
        }


def _share(material: MooneyRivlin) -> float:
    return material.c01 / (material.c10 + material.c01)


def _changed(material: Hyperelastic, factor: float, share: float | None) -> Hyperelastic:
    bulk = factor * material.bulk_modulus
    if isinstance(material, NeoHookean):
        return NeoHookean(factor * material.shear_modulus, bulk)
    total = factor * (material.c10 + material.c01)
    share = _share(material) if share is None else share
    return MooneyRivlin((1.0 - share) * total, share * total, bulk)


def young_modulus(material: Hyperelastic) -> float:
    """At small strain [Pa]."""
    shear, bulk = material.shear_modulus, material.bulk_modulus
    return 9.0 * bulk * shear / (3.0 * bulk + shear)
