# SPDX-License-Identifier: Apache-2.0
"""A long stroke made short: means over blocks of neighbouring samples."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Blocks:
    """Means of (m,) blocks of ``size`` samples each, the first block starting at sample ``first``."""

    first: int
    size: int
    depth: np.ndarray
    force: np.ndarray

    def __len__(self) -> int:
        return len(self.depth)

    def sample(self, block: int) -> int:
        """The first sample of a block."""
        return self.first + self.size * int(block)


def blocks(depth: np.ndarray, force: np.ndarray, first: int, last: int, size: int) -> Blocks:
    """Blocks of samples ``first`` up to ``last``; what does not fill a block at the end is left out."""
    size = max(1, min(size, last - first))
    count = (last - first) // size
    mean = lambda values: values[first : first + count * size].reshape(count, size).mean(axis=1)  # noqa: E731
    return Blocks(first, size, mean(depth), mean(force))


def first_run(above: np.ndarray, length: int) -> int | None:
    """Where the first run of at least ``length`` true values in (m,) ``above`` begins."""
    if len(above) < length:
        return None
    sums = np.concatenate(([0], np.cumsum(above)))
    starts = np.flatnonzero(sums[length:] - sums[:-length] == length)
    return int(starts[0]) if len(starts) else None
