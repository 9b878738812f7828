# SPDX-License-Identifier: Apache-2.0
"""What the fit of one cycle gives."""

from dataclasses import dataclass

import numpy as np

from ..statistics.noise import Noise


@dataclass(frozen=True, eq=False)
class CycleFit:
    """What a cycle tells of the one-layer model, SI: ``values`` and, by the same keys, 95 % limits ``low``, ``high``.

    ``stiffness_coefficient`` c [N/m²], ``contact_depth`` z0 [m], ``saturation_depth`` h_s [m] (inf: bare cone),
    ``friction_per_length`` f' [N/m], ``cutting_force`` f_c [N], ``puncture_depth`` z1 [m],
    ``puncture_indentation`` z1 - z0 [m], ``puncture_force`` c g(z1 - z0) [N]. Depths are in the recording's own zero.
    """

    law: str
    values: dict[str, float]
    low: dict[str, float]
    high: dict[str, float]
    covariance: np.ndarray
    """(p, p) of the continuous parameters, in the order of ``covariance_order``."""
    covariance_order: tuple[str, ...]
    puncture_low: int
    """The puncture lies between samples ``puncture_low`` and ``puncture_high`` of the insertion, at 95 % or more."""
    puncture_high: int
    samples_before_puncture: int
    residual_in: np.ndarray
    """Measured minus modelled force of the insertion, (n_in,) [N], of every sample, left out or not."""
    residual_out: np.ndarray
    left_out: int
    """Samples left out on each side of the puncture, at the insertion's end and at the withdrawal's start."""
    sse: float
    n: int
    """Samples used, and the sum of their squared residuals [N²]."""
    bic: float
    rmse: float
    noise_correlation_length: float
    """Samples that count as one: long-run over plain variance of the residuals. 1 is white noise."""
    warnings: tuple[str, ...]
    noises: tuple[Noise, Noise]
    """Noise of insertion and withdrawal, as the residuals show it."""
    saturation_sought: bool = False
    by_stages: bool = False
    """The loading curve was fitted first, then friction and cutting; False: all at once."""
