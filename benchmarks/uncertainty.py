# SPDX-License-Identifier: Apache-2.0
"""Coverage of intervals and draws under white, filtered and autocorrelated (AR(1)) noise, compared with a block
bootstrap; draws per second compared with emcee.

    python benchmarks/uncertainty.py [--full]

With ``--full`` 4000 recordings per row (some ten minutes), otherwise 200; the block bootstrap uses a tenth of them, at
least 200.
"""

import argparse
import time
from types import SimpleNamespace

import numpy as np
from fit import PARAMETERS, QUANTITIES, progress, simulate
from scipy.signal import lfilter

from needleforce import core
from needleforce.identification.one_layer.cycle_fit import fit_cycle
from needleforce.identification.one_layer.cycle_values import CycleOptions
from needleforce.identification.statistics.draws import draw_cycle
from needleforce.identification.statistics.noise import noise_of

ROWS = (  # noise [N], filter, AR(1) coefficient per sample, samples per stroke
    *((20e-3, length, 0.0, 15_000) for length in (1, 10, 50)),
    *((5e-3, 1, factor, samples) for factor in (0.9, 0.99) for samples in (15_000, 3000)),
)


def recorded(seed: int, noise: float, length: int, ar1: float, samples: int):
    """One cycle with white, filtered or AR(1) noise, and the truth; ``noise`` is the sd of AR(1) noise at a sample."""
    arrays, truth = simulate(seed, 0.0 if ar1 else noise, length, samples)
    if not ar1:
        return arrays, truth
    turn, settled = len(arrays[1]), 5000
    white = np.random.default_rng(seed).standard_normal(settled + turn + len(arrays[3]))
    drift = noise * np.sqrt(1.0 - ar1**2) * lfilter([1.0], [1.0, -ar1], white)[settled:]
    return (arrays[0], arrays[1] + drift[:turn], arrays[2], arrays[3] + drift[turn:]), truth


def drawn(arrays, fit, count: int, seed: int) -> dict:
    strokes = SimpleNamespace(**dict(zip(("depth_in", "force_in", "depth_out", "force_out"), arrays)))
    return draw_cycle(fit, strokes, count, np.random.default_rng(seed))[0]


def share_held(count: int, row: tuple, label: str = "", first_seed: int = 0) -> tuple[dict, dict]:
    """Share of 95 % intervals, and of the central 95 % of 2000 draws, that contain the truth, by quantity."""
    intervals, draws = np.zeros((2, len(QUANTITIES)))
    for seed in range(first_seed, first_seed + count):
        arrays, truth = recorded(seed, *row)
        fit = fit_cycle(*arrays, CycleOptions(filter_length=row[1]))
        found = drawn(arrays, fit, 2000, seed)
        ends = {name: np.quantile(found[name], (0.025, 0.975)) for name in QUANTITIES}
        intervals += [fit.low[name] <= truth[name] <= fit.high[name] for name in QUANTITIES]
        draws += [ends[name][0] <= truth[name] <= ends[name][1] for name in QUANTITIES]
        if label:
            progress(label, seed + 1 - first_seed, count)
    return dict(zip(QUANTITIES, intervals / count)), dict(zip(QUANTITIES, draws / count))


def jacobians(arrays, fit) -> list[np.ndarray]:
    """Derivatives (4, n) of the force of each stroke by c, z0, f' and f_c."""
    c, contact, friction, _ = (fit.values[name] for name in PARAMETERS)
    h, out = arrays[0] - contact, np.maximum(arrays[2] - contact, 0.0)
    before = np.arange(len(h)) < fit.puncture.before
    pushed, zero = np.where(before, np.maximum(h, 0.0), 0.0), np.zeros_like(out)
    return [
        np.array([pushed**2, np.where(before, -2.0 * c * pushed, -friction), np.where(before, 0.0, h), ~before]),
        np.array([zero, np.where(out > 0.0, friction, 0.0), -out, zero]),
    ]


def block_length(residual: np.ndarray) -> int:
    """Politis & White (2004), moving blocks as corrected by Patton et al. (2009); at most a third of the stroke."""
    n, reach = len(residual), max(noise_of(residual, len(residual)).reach, 1)
    lags = np.arange(1, 2 * reach + 1)
    covariance = core.lagged_products(residual, 2 * reach) / n
    weighted = np.clip(2.0 - lags / reach, 0.0, 1.0) * covariance[1:]
    long_run, spread = covariance[0] + 2.0 * weighted.sum(), 2.0 * float(weighted @ lags)
    return int(np.clip((1.5 * n * spread**2 / long_run**2) ** (1 / 3), 1, n // 3))


def by_blocks(arrays, fit, seed: int, count: int = 300) -> np.ndarray:
    """95 % limits (2, 4) by a moving-block bootstrap of the residuals through the linearised fit (percentiles)."""
    random, gram, moved = np.random.default_rng(seed), 0.0, 0.0
    for jacobian, residual in zip(jacobians(arrays, fit), (fit.residuals.insertion, fit.residuals.withdrawal)):
        n, length = len(residual), block_length(residual)
        blocks = -(-n // length)
        padded = np.zeros((4, blocks * length))
        padded[:, :n] = jacobian
        first = random.integers(0, n - length + 1, (count, blocks))
        picked = (residual - residual.mean())[first[:, :, None] + np.arange(length)]
        moved = moved + picked.reshape(count, -1) @ padded.T
        gram = gram + jacobian @ jacobian.T
    scale = np.sqrt(np.diagonal(gram))
    estimates = np.linalg.solve(gram / np.outer(scale, scale), (moved / scale).T).T / scale
    return np.array([fit.values[name] for name in PARAMETERS]) + np.quantile(estimates, (0.025, 0.975), axis=0)


def blocks_share_held(count: int, row: tuple) -> np.ndarray:
    """Share of the block bootstrap's intervals that contain the truth, (4,)."""
    covered = np.zeros(4)
    for seed in range(count):
        arrays, truth = recorded(seed, *row)
        low, high = by_blocks(arrays, fit_cycle(*arrays), seed)
        true = np.array([truth[name] for name in PARAMETERS])
        covered += (low <= true) & (true <= high)
    return covered / count


def draws_per_second() -> float:
    """Draws per second of one recording of 30 000 samples, including its grid."""
    arrays, _ = recorded(0, *ROWS[0])
    fit = fit_cycle(*arrays)
    times = []
    for seed in range(5):
        began = time.perf_counter()
        drawn(arrays, fit, 1_000_000, seed)
        times.append(time.perf_counter() - began)
    return 1e6 / min(times)


def emcee_per_second(steps: int = 400) -> float:
    """Effective samples per second of emcee on the same likelihood, started at the optimum."""
    import emcee

    arrays, _ = recorded(0, *ROWS[0])
    fit = fit_cycle(*arrays)
    names, depth, out = (*PARAMETERS, "puncture_depth"), arrays[0], arrays[2]

    def log(x):
        c, contact, friction, cutting, puncture = x
        h = depth - contact
        pushed = np.where(depth <= puncture, c * np.maximum(h, 0.0) ** 2, friction * h + cutting)
        left = arrays[1] - pushed, arrays[3] + friction * np.maximum(out - contact, 0.0)
        return -0.5 * sum(r @ r for r in left) / fit.residuals.noises[0].long_run

    centre = np.array([fit.values[name] for name in names])
    error = np.array([(fit.high[name] - fit.low[name]) / 4 for name in names])
    sampler = emcee.EnsembleSampler(24, 5, log)
    began = time.perf_counter()
    sampler.run_mcmc(centre + 0.5 * error * np.random.default_rng(0).standard_normal((24, 5)), steps)
    taken = time.perf_counter() - began
    return 24 * steps / float(np.max(sampler.get_autocorr_time(tol=0))) / taken


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--full", action="store_true", help="4000 recordings per row")
    count = 4000 if options.parse_args().full else 200
    short = "".join(f"{name:>7s}" for name in "c z0 f' f_c z1-z0 F1 z1".split())
    print(f"\n{count} recordings per row; coverage at 95 %, in %\nnoise, filter, AR(1), samples   {'':10s}{short}")
    for k, row in enumerate(ROWS):
        label = f"{1e3 * row[0]:.0f} mN {row[1]:3d} {row[2]:5.2f} {row[3]:6d}"
        for what, shares in zip(("intervals", "draws"), share_held(count, row, label, 10_000 * k)):
            print(f"{label:30s} {what:10s}" + "".join(f"{100 * shares[name]:7.1f}" for name in QUANTITIES), flush=True)
        if row[2]:
            shares = blocks_share_held(max(count // 10, 200), row)
            print(f"{label:30s} {'blocks':10s}" + "".join(f"{100 * share:7.1f}" for share in shares), flush=True)
    ours = draws_per_second()
    print(f"\ndraws per second: {ours:.2g}")
    try:
        theirs = emcee_per_second()
        print(f"emcee, effective samples per second: {theirs:.0f}; ratio {ours / theirs:.0f}")
    except ImportError:
        print("emcee is not installed")


if __name__ == "__main__":
    main()
