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
    """Fall between the two parts of the last 300 ms, as ruptures parts them, in standard deviations of it."""
    from ruptures import KernelCPD

    statistic, due = np.zeros(len(off)), -np.inf
    search = KernelCPD(kernel="linear", min_size=2)
    for i, low in enumerate(np.searchsorted(time, time - WINDOW)):
        if time[i] < due or i - low < 6:
            statistic[i] = statistic[i - 1]
            continue
        due = time[i] + EVERY - 1e-6
        seen = off[low : i + 1]
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
