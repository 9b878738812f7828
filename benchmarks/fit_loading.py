# SPDX-License-Identifier: Apache-2.0
"""The compiled fit of loading curves compared with scipy's least_squares from several starts.

    python benchmarks/fit_loading.py [--samples N]

Both fit the same simulated curves in turn in one run: processor time of this thread, median of the ratios, and the
largest excess of either sum of squares over the other's. scipy screens 63 starts on 500 samples and follows three.
"""

import argparse
import time
from itertools import product

import numpy as np
from scipy.optimize import least_squares

from needleforce import core
from needleforce.identification.one_layer.deformation_fit import CONTACT_RANGE, CONTACT_STARTS
from needleforce.identification.one_layer.loading_curves import CURVES

CONTACT, DEPTH, NOISE, REPEATS = 4e-3, 12e-3, 5e-3, 5
PLACES = (-0.8, -0.5, -0.3, -0.1, 0.0, 0.1, 0.3, 0.5, 0.7)  # [indentations] from the contact given
SHAPES = {"cone_cylinder": (0.02, 0.1, 0.2, 0.4, 0.7, 1.0, 1.5), "power_law": (1.05, 1.3, 1.6, 2.0, 2.5, 3.5, 5.0)}
SHAPES["exponential"] = (0.03, 0.3, 1.0, 2.0, 4.0, 8.0, 16.0)


def simulate(seed: int, samples: int) -> tuple[np.ndarray, np.ndarray]:
    """Depth and force of free travel and the loading of a cone on a cylinder."""
    depth = np.linspace(0.0, DEPTH, samples)
    h = np.maximum(depth - CONTACT, 0.0)
    force = 25e3 * np.where(h < 3e-3, h**2, 6e-3 * h - 9e-6)
    return depth, force + np.random.default_rng(seed).normal(0.0, NOISE, samples)


def by_scipy(law: str, depth: np.ndarray, force: np.ndarray, start: float) -> float:
    """The smallest sum of squares; amplitudes by linear least squares, none below 0 where there is one."""
    curve, span = CURVES[law], depth.max() - start
    powers = [each.power for each in curve.shape.values()]

    def residual(x: np.ndarray, every: int = 1) -> np.ndarray:
        shape = [value * span**power for value, power in zip(x[1:], powers)]
        basis = np.stack(curve.basis(np.maximum(depth[::every] - start - x[0] * span, 0.0), *shape))
        basis, y = basis - basis.mean(axis=1)[:, None], force[::every] - force[::every].mean()
        size = np.linalg.norm(basis, axis=1, keepdims=True) + 1e-300
        found = np.linalg.lstsq((basis / size).T, y, rcond=None)[0]
        return y - (np.maximum(found, 0.0) if len(found) == 1 else found) @ (basis / size)

    every = max(len(depth) // 500, 1)
    starts = [np.array(x) for x in product(PLACES, *([SHAPES[law]] if law in SHAPES else []))]
    starts.sort(key=lambda x: float(np.sum(residual(x, every) ** 2)))
    low, high = zip((-1.0, 0.9), *((each.low, each.high) for each in curve.shape.values()))
    return min(2.0 * least_squares(residual, x, bounds=(low, high), x_scale=0.1).cost for x in starts[:3])


def compiled(law: str, depth: np.ndarray, force: np.ndarray, start: float) -> float:
    """The smallest sum of squares of the compiled fit."""
    [(starts, low, high)] = [(x.starts, x.low, x.high) for x in CURVES[law].shape.values()] or [((0.0,), 0.0, 0.0)]
    *_, sse = core.fit_loading(
        depth,
        force,
        law=law,
        contact=start,
        indentation=float(depth.max()) - start,
        places=CONTACT_STARTS,
        shapes=np.array(starts),
        place_range=CONTACT_RANGE,
        shape_range=(low, high),
    )
    return sse


def timed(fit, *given) -> tuple[float, float]:
    """Result and processor time [s]."""
    start = time.thread_time()
    return fit(*given), time.thread_time() - start


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=8000)
    samples = parser.parse_args().samples
    print(f"| {samples} samples | scipy [ms] | compiled [ms] | ratio | compiled sum over scipy's, largest |")
    print("|---|---|---|---|---|")
    for law in CURVES:
        rows = []
        for seed in range(REPEATS):
            given = (law, *simulate(seed, samples), CONTACT + 0.5e-3)
            (theirs, slow), (ours, fast) = timed(by_scipy, *given), timed(compiled, *given)
            rows.append((1e3 * slow, 1e3 * fast, slow / fast, ours / theirs - 1.0))
        slow, fast, ratio, excess = np.array(rows).T
        print(
            f"| {law} | {np.median(slow):.1f} | {np.median(fast):.2f} | {np.median(ratio):.0f} | {excess.max():+.0e} |"
        )


if __name__ == "__main__":
    main()
