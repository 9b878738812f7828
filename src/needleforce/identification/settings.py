# SPDX-License-Identifier: Apache-2.0
"""How an identification was run, and what was compared to choose its model."""

import math
from dataclasses import dataclass
from typing import NamedTuple


@dataclass(frozen=True, kw_only=True)
class FitSettings:
    """How an identification was run.

    ``answering`` of the ``repeats`` were identified. ``lateral_over_axial_force`` is the median ratio over the
    recordings, None without lateral axes; ``noise`` is the noise model of the intervals in words.
    """

    stiffness_law: str
    needle: str | None
    repeats: int
    answering: int
    lateral_over_axial_force: float | None
    noise: str


class Choice(NamedTuple):
    """One of the models compared: a stiffness law, or a number of layers, with its BIC, and for a law the median of the
    modelled over the measured force at the puncture."""

    name: str
    bic: float
    puncture_ratio: float = math.nan


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """One choice of layers and mechanisms that was tried.

    ``parameters`` is the number of fitted ones, ``residual`` the rms over the peak, ``left_out`` the error over the
    peak on held-out repeats, None with fewer than three repeats; ``ties`` is True if these recordings do not
    distinguish it from the ``chosen`` one.
    """

    choice: str
    parameters: int
    residual: float
    bic: float
    left_out: float | None
    ties: bool
    chosen: bool


@dataclass(frozen=True, kw_only=True)
class LayeredSettings(FitSettings):
    """How a layered fit was run: the number of shared ``parameters``, the speed [m/s] to which they refer, and how the
    number of ``layers`` was chosen."""

    parameters: int
    speed_m_s: float
    layers: int
    chosen_by: str
    evidence: tuple[Evidence, ...]
