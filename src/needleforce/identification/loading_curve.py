# SPDX-License-Identifier: Apache-2.0
"""The loading curve of a cone, bare or on a shank: F = c g(h), g = h^2 up to the saturation depth, then linear."""

import numpy as np


def shape(h: np.ndarray, saturation: float) -> np.ndarray:
    """g(h) [m^2] at indentations h [m] of any shape: h^2 up to ``saturation``, then 2 h_s h - h_s^2; 0 if h < 0."""
    h = np.maximum(h, 0.0)
    cone = np.minimum(h, saturation)
    return cone * (2.0 * h - cone)


def gradient(h: np.ndarray, coefficient: float, saturation: float) -> list[np.ndarray]:
    """The derivatives of c g(z - z0) by c, by z0 and by the saturation depth, each shaped as h."""
    h = np.maximum(h, 0.0)
    cone = np.minimum(h, saturation)
    return [cone * (2.0 * h - cone), -2.0 * coefficient * cone, 2.0 * coefficient * (h - cone)]
