# SPDX-License-Identifier: Apache-2.0
"""Falls found by two libraries for change points: ruptures on a window of the force that moves along, and FOCuS of
changepoint-online on the force off a line, in standard deviations. That one is GPL and no requirement:
``pip install changepoint-online==1.2.1``."""

from importlib.util import find_spec

import numpy as np

WINDOW, EVERY = 0.3, 5e-3  # [s] what ruptures sees, and how often it looks


def installed(module: str) -> bool:
    """Whether a library is there."""
    return find_spec(module) is not None


def window(time: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Fall of the mean force between the two parts of the last 300 ms, as ruptures parts them, by the root of their
    lengths. Faster readings are taken together, for its work grows with the square of their number."""
    from ruptures import KernelCPD

    statistic, search = np.zeros(len(force)), KernelCPD(kernel="linear", min_size=2)
    blocks, first, due = [], 0, time[0]
    for i, now in enumerate(time):
        statistic[i] = statistic[i - 1]
        if now < due:
            continue
        blocks.append((now, force[first : i + 1].mean()))
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
