# SPDX-License-Identifier: Apache-2.0
"""The complete fit compared with scipy's curve_fit: speed, share of correct fits, and coverage of the intervals.

    python benchmarks/fit.py [--full]

Without ``--full`` the tables use few recordings (about a minute); with it 100 for the speed and 4000 for the intervals.
Ratios are of medians over the same recordings, in turn in one run.
"""

import argparse
import sys
import time
import warnings
from collections.abc import Callable

import numpy as np

from needleforce import core
from needleforce.identification.one_layer.cycle_fit import fit_cycle
from needleforce.identification.one_layer.cycle_values import CycleFit, CycleOptions
from needleforce.identification.statistics.noise import TWO_SIDED

STIFFNESS = (2 / np.pi) * 117546.0 * np.tan(np.radians(15.0))  # [N/m²], 0.2101 N at 3.237 mm
INDENTATION, FRICTION, CUTTING, DEPTH = 3.237e-3, 18.6, 0.0776, 20e-3
SAMPLES = 15_000  # of each stroke
PARAMETERS = ("stiffness_coefficient", "contact_depth", "friction_per_length", "cutting_force")
QUANTITIES = (*PARAMETERS, "puncture_indentation", "puncture_force", "puncture_depth")


def simulate(seed: int, noise: float, filter_length: int = 1, samples: int = SAMPLES):
    """One cycle with the paper's parameters: the four arrays for ``fit_cycle``, and the truth.

    ``noise`` [N] is the standard deviation before the filter, a causal average over the recorded force. The depth is
    averaged in the same way: that is the shift by (filter_length - 1) / 2 samples that a user makes first.
    """
    random = np.random.default_rng(seed)
    contact, n = random.uniform(2e-3, 6e-3), samples + filter_length
    depth = np.linspace(0.0, DEPTH, n)
    h = np.maximum(depth - contact, 0.0)
    pushed = np.where(depth - contact <= INDENTATION, STIFFNESS * h**2, FRICTION * h + CUTTING)
    depth, force = np.concatenate([depth, depth[::-1]]), np.concatenate([pushed, -FRICTION * h[::-1]])
    force += noise * random.standard_normal(2 * n)
    turn = n - filter_length // 2
    depth, force = moving_average(depth, filter_length), moving_average(force, filter_length)
    truth = dict(zip(PARAMETERS, (STIFFNESS, contact, FRICTION, CUTTING)))
    truth |= {"puncture_indentation": INDENTATION, "puncture_force": STIFFNESS * INDENTATION**2}
    truth["puncture_depth"] = contact + INDENTATION
    return (depth[:turn], force[:turn], depth[turn:], force[turn:]), truth


def moving_average(values: np.ndarray, length: int) -> np.ndarray:
    return values if length == 1 else np.convolve(values, np.full(length, 1.0 / length), "valid")


def correct(fit: CycleFit, truth: dict) -> bool:
    """Puncture within 0.05 mm, the other parameters within 4 standard errors."""
    error = {name: (fit.high[name] - fit.low[name]) / (2 * TWO_SIDED) for name in PARAMETERS}
    near = all(abs(fit.values[name] - truth[name]) <= 4 * error[name] for name in PARAMETERS)
    return near and abs(fit.values["puncture_depth"] - truth["puncture_depth"]) <= 0.05e-3


def covered(fit: CycleFit, truth: dict) -> list[bool]:
    """Whether the interval of each quantity contains its true value."""
    return [fit.low[name] <= truth[name] <= fit.high[name] for name in QUANTITIES]


def study(count: int, noise: float, filter_length: int, first_seed: int = 0, report: Callable = lambda done: None):
    """Share of correct fits, and coverage of the intervals by quantity, over ``count`` recordings."""
    corrects, coverage = 0, np.zeros(len(QUANTITIES))
    for k in range(count):
        arrays, truth = simulate(first_seed + k, noise, filter_length)
        fit = fit_cycle(*arrays, CycleOptions(filter_length=filter_length))
        corrects += correct(fit, truth)
        coverage += covered(fit, truth)
        report(k + 1)
    return corrects / count, dict(zip(QUANTITIES, coverage / count))


def nested(n: int) -> Callable:
    """The model in its obvious form, with nested np.where."""
    inwards = np.arange(2 * n) < n

    def model(z, c, z0, z1, slope, cutting):
        pushed = np.where(z < z0, 0.0, np.where(z <= z1, c * (z - z0) ** 2, slope * (z - z0) + cutting))
        return np.where(inwards, pushed, np.where(z > z0, -slope * (z - z0), 0.0))

    return model


def sliced(n: int) -> Callable:
    """The same, by strokes and with fewer temporaries."""

    def model(z, c, z0, z1, slope, cutting):
        h = z - z0
        up, force = h[:n], np.empty_like(z)
        force[:n] = np.where(up <= 0.0, 0.0, np.where(z[:n] <= z1, c * up * up, slope * up + cutting))
        force[n:] = -slope * np.maximum(h[n:], 0.0)
        return force

    return model


LABELS = {
    "fit_cycle": "fit_cycle, with intervals",
    "kernel": "  its compiled part only",
    "nested": "curve_fit, nested np.where",
    "sliced": "curve_fit, stroke by stroke",
}


def kernel(*arrays: np.ndarray) -> dict:
    return core.fit_cycle(*arrays, np.inf, False, 0, -np.inf, np.inf, 60.0)


def ours(fit: Callable) -> Callable:
    """The time of a fit [s], and whether the puncture is correct."""

    def timed(arrays, truth: dict, seed: int) -> tuple[float, bool]:
        began = time.perf_counter()
        found = fit(*arrays)
        taken = time.perf_counter() - began
        depth, row = arrays[0], found["puncture"] if isinstance(found, dict) else found.puncture.before
        return taken, abs(0.5 * (depth[row - 1] + depth[row]) - truth["puncture_depth"]) <= 0.05e-3

    return timed


def peer(write_model: Callable) -> Callable:
    """The same for curve_fit (Levenberg-Marquardt) from a start within 10 % of the truth."""
    from scipy.optimize import curve_fit

    names = ("stiffness_coefficient", "contact_depth", "puncture_depth", "friction_per_length", "cutting_force")

    def timed(arrays, truth: dict, seed: int) -> tuple[float, bool]:
        depth, force, model = np.concatenate(arrays[0::2]), np.concatenate(arrays[1::2]), write_model(len(arrays[0]))
        start = np.array([truth[name] for name in names]) * np.random.default_rng(seed).uniform(0.9, 1.1, 5)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            began = time.perf_counter()
            found = curve_fit(model, depth, force, start)[0]
        return time.perf_counter() - began, abs(found[2] - truth["puncture_depth"]) <= 0.05e-3

    return timed


def speed(count: int) -> None:
    """Medians and ratios over the same recordings: each method goes through all of them, in turn, three times."""
    recordings = [simulate(seed, 5e-3) for seed in range(count)]
    methods = {"fit_cycle": ours(fit_cycle), "kernel": ours(kernel), "nested": peer(nested), "sliced": peer(sliced)}
    seconds, corrects = {name: [] for name in methods}, dict.fromkeys(methods, 0)
    for turn in range(3):
        for k, (name, method) in enumerate(methods.items()):
            for seed, recording in enumerate(recordings):
                taken, is_correct = method(*recording, seed)
                seconds[name].append(taken)
                corrects[name] += is_correct
            progress("speed", 4 * turn + k + 1, 12)
    middle = {name: 1e3 * float(np.median(values)) for name, values in seconds.items()}
    print(
        f"\n{2 * SAMPLES} samples, 5 mN, {count} recordings           median ms  puncture correct %  nested ÷  sliced ÷"
    )
    for name, label in LABELS.items():
        ratios = [middle[other] / middle[name] for other in ("nested", "sliced") if name in ("fit_cycle", "kernel")]
        share = 100 * corrects[name] / (3 * count)
        print(f"{label:42s} {middle[name]:11.3f} {share:19.1f}" + "".join(f"{ratio:10.1f}" for ratio in ratios))


def progress(what: str, done: int, count: int) -> None:
    if sys.stderr.isatty() and (count < 100 or done % 20 == 0 or done == count):
        print(f"\r{what}: {done}/{count} ", end="\n" if done == count else "", file=sys.stderr, flush=True)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--full", action="store_true", help="100 recordings for the speed, 4000 for the intervals")
    full = options.parse_args().full
    speed(100 if full else 30)
    count = 4000 if full else 300
    short = "c z0 f' f_c z1-z0 F1 z1".split()
    print(f"\n{count} recordings per row; correct: z1 within 0.05 mm and c, z0, f', f_c within 4 standard errors")
    print("noise mN  filter  correct %  coverage of 95 % intervals, %:     " + "".join(f"{name:>8s}" for name in short))
    for noise in (5e-3, 20e-3, 50e-3):
        for length in (1, 10, 50):
            name = f"{1e3 * noise:.0f} mN, filter {length}"
            seed = 10_000 * (length + round(1e5 * noise))  # no two rows share their noise
            correct_share, shares = study(count, noise, length, seed, lambda done: progress(name, done, count))  # noqa: B023
            cells = "".join(f"{100 * shares[name]:8.1f}" for name in QUANTITIES)
            print(f"{1e3 * noise:8.0f} {length:7d} {100 * correct_share:9.2f}   {'':34s}{cells}", flush=True)


if __name__ == "__main__":
    main()
