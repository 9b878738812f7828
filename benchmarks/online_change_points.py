# SPDX-License-Identifier: Apache-2.0
"""Falls found by two libraries for change points, in forces off a line in standard deviations: ruptures on a window
that moves along, and FOCuS of changepoint-online. That one is GPL and no requirement:
``pip install changepoint-online==1.2.1``."""

from importlib.util import find_spec

import numpy as np

WINDOW, EVERY = 0.3, 5e-3  # [s] what ruptures sees, and how often it looks


def installed(module: str) -> bool:
    """Whether a library is there."""
    return find_spec(module) is not None


def window(time: np.ndarray, off: np.ndarray) -> np.ndarray:
    """Fall between the two parts of the last 300 ms, as ruptures parts them, in standard deviations of it. Faster
    readings are taken together, for its work grows with the square of their number."""
    from ruptures import KernelCPD

    statistic, search = np.zeros(len(off)), KernelCPD(kernel="linear", min_size=2)
    blocks, first, due = [], 0, time[0]
    for i, now in enumerate(time):
        statistic[i] = statistic[i - 1]
        if now < due:
            continue
        blocks.append((now, off[first : i + 1].sum() / np.sqrt(i + 1 - first)))  # of unit variance, too
        first, due = i + 1, now + EVERY - 1e-6
        blocks = [block for block in blocks if block[0] > now - WINDOW]
        if len(blocks) > 6:
            seen = np.array([value for _, value in blocks])
            part, n = search.fit(seen).predict(n_bkps=1)
            statistic[i] = (seen[:part].mean() - seen[part:].mean()) * np.sqrt(part * (n - part) / n)
    return statistic


def focus(off: np.ndarray, least: float) -> list[int]:
    """Samples at which FOCuS finds that the mean is below zero; after each it begins anew."""
    from changepoint_online import Focus, Gaussian

    found, search = [], Focus(Gaussian(loc=0.0), side="left")
    for i, each in enumerate(off):
        search.update(each)
        if np.ravel(search.statistic())[0] >= least:
            found.append(i)
            search = Focus(Gaussian(loc=0.0), side="left")
    return found
