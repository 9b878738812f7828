# SPDX-License-Identifier: Apache-2.0
"""Share of the 95 % intervals of bench tests that contain the truth, where material or machine does not do what the
model assumes: it yields, breaks, is slack, saturates the sensor, begins in contact.

    python benchmarks/bench_tests.py [curves of each, 200] [tension bending penetration indentation]

The curves are those of ``tests/identification/bench_situations.py``."""

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "identification"))
from bench_situations import BENDING, BENT, INDENTATION, PENETRATION, SPAN, TENSION  # noqa: E402

from needleforce import tips  # noqa: E402
from needleforce.bench_tests import StressCurve, fit_stress, penetration_test, three_point_modulus  # noqa: E402
from needleforce.errors import InputError  # noqa: E402
from needleforce.identification import fit_unloading  # noqa: E402

Found = tuple[float, float, float]
BERKOVICH = tips.Cone(float(np.arctan((24.5 / np.pi) ** 0.5)))


def tension(name: str, seed: int) -> tuple[Found, float]:
    """Young's modulus with its interval, and the truth [Pa]."""
    strain, stress = TENSION[name].curve(seed)
    found = fit_stress(StressCurve(1.0 + strain, stress), fit_zero=True).young_modulus
    return (found.value, found.low, found.high), TENSION[name].truth


def bending(name: str, seed: int) -> tuple[Found, float]:
    """E I with its interval, and the truth [N m^2]."""
    deflection, force = BENDING[name].curve(seed)
    found = three_point_modulus(force, deflection, SPAN)
    return (found.bending_stiffness, found.stiffness_low, found.stiffness_high), BENT


def penetration(name: str, seed: int) -> tuple[Found, float]:
    """The force at tip entry with its interval, and the truth [N]."""
    found = penetration_test(*PENETRATION[name].curve(seed))["entry_force"]
    return (found.value, found.low, found.high), PENETRATION[name].truth


def indentation(name: str, seed: int) -> tuple[Found, float]:
    """The reduced modulus of the unloading with its interval, and the truth [Pa]."""
    depth, force, start = INDENTATION[name].curve(seed)
    found = fit_unloading(depth[start:], force[start:], BERKOVICH).parameters["reduced_modulus"]
    return (found.value, found.low, found.high), INDENTATION[name].modulus


KINDS: dict[str, tuple[dict, Callable]] = {
    "tension": (TENSION, tension),
    "bending": (BENDING, bending),
    "penetration": (PENETRATION, penetration),
    "indentation": (INDENTATION, indentation),
}


def rows(kind: str, curves: int) -> Iterator[str]:
    """A row of the table for each situation of a kind."""
    table, measure = KINDS[kind]
    for name in table:
        inside, values, halves, none = 0, [], [], 0
        for seed in range(curves):
            try:
                (value, low, high), truth = measure(name, seed)
            except InputError:
                none += 1
                continue
            inside += low <= truth <= high
            values.append(value / truth)
            halves.append(0.5 * (high - low) / truth)
        middle = f"{np.median(values):.3f} | ± {100.0 * np.median(halves):.2g} %" if values else "– | –"
        yield f"| {kind}: {name} | {inside / curves:.3f} | {middle} | {none or ''} |"


def main() -> None:
    """Print the table of shares, median values over the truth, and median half widths."""
    curves = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    print(f"| {curves} curves of each | truth in the interval | median value / truth | half width | no result |")
    print("|---|---|---|---|---|")
    for kind in sys.argv[2:] or KINDS:
        for row in rows(kind, curves):
            print(row, flush=True)


if __name__ == "__main__":
    main()
