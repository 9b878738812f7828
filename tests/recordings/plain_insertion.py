# SPDX-License-Identifier: Apache-2.0
"""A small insertion in closed form, and its file in several layouts."""

import numpy as np


def insertion(rate=100.0, speed=2e-3, start=-5e-3, deep=20e-3, stiffness=40.0, noise=0.0, seed=1):
    """Time [s], depth [m], force [N] of insertion and withdrawal; the force is stiffness * depth below the surface."""
    turn = (deep - start) / speed
    time = np.arange(0.0, 2.0 * turn, 1.0 / rate)
    depth = deep - speed * np.abs(time - turn)
    sign = np.where(time < turn, 1.0, -0.3)
    force = stiffness * np.clip(depth, 0.0, None) * sign + np.random.default_rng(seed).normal(0.0, noise, len(time))
    return time, depth, force


def text(columns, delimiter=",", decimal=".", end="\n", above=""):
    """``{header: values}`` as the text of a file."""
    rows = [delimiter.join(columns)]
    for row in zip(*columns.values(), strict=True):
        rows.append(delimiter.join(repr(float(value)).replace(".", decimal) for value in row))
    return above + end.join(rows) + end
