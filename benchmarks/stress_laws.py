# SPDX-License-Identifier: Apache-2.0
"""How often the interval of Young's modulus contains the true one: simulated tension tests with independent and
correlated noise, of laws that are in the list and of one that is not.

    python benchmarks/stress_laws.py [curves of each, 200] [law ...]
"""

import sys

import numpy as np

from needleforce.bench_tests import StressCurve, fit_stress, nominal_stress

READINGS, NOISE = 80, 0.005  # noise: of the largest stress
CORRELATIONS = (0.0, 0.5, 0.7)
# law -> E [Pa], smallest and largest stretch, stress [Pa]
LAWS = {
    "linear": (116e3, 1.0, 1.15, lambda s: nominal_stress("linear", s, [116e3])),
    "neo-Hookean": (116e3, 1.0, 1.3, lambda s: nominal_stress("neo_hookean", s, [116e3 / 3.0])),
    "Yeoh": (114e3, 0.8, 1.6, lambda s: nominal_stress("yeoh", s, [19e3, 500.0, 30.0])),
    "Ogden, 2 terms": (1.5 * 15.84e3, 0.7, 2.0, lambda s: nominal_stress("ogden_2", s, [12e3, 1.3, 30.0, 8.0])),
    "Gent": (30e3, 1.0, 3.0, lambda s: gent(s, 10e3, 8.0)),
    "Gent, compressed": (30e3, 0.5, 1.0, lambda s: gent(s, 10e3, 3.0)),
    "Fung": (6e3, 1.0, 1.5, lambda s: fung(s, 2e3, 3.0)),
}


def gent(stretch: np.ndarray, mu: float, limit: float) -> np.ndarray:
    """Uniaxial nominal stress [Pa] of W = -mu limit/2 ln(1 - (I1 - 3)/limit); E = 3 mu."""
    excess = stretch**2 + 2.0 / stretch - 3.0
    return mu * (stretch - stretch**-2.0) / (1.0 - excess / limit)


def fung(stretch: np.ndarray, mu: float, b: float) -> np.ndarray:
    """Uniaxial nominal stress [Pa] of W = mu/(2 b) (exp(b (I1 - 3)) - 1); E = 3 mu."""
    excess = stretch**2 + 2.0 / stretch - 3.0
    return mu * (stretch - stretch**-2.0) * np.exp(b * excess)


def noise_of(random: np.random.Generator, correlation: float) -> np.ndarray:
    """Noise (n,) of variance 1 whose neighbours have the correlation: AR(1)."""
    noise = random.standard_normal(READINGS)
    for k in range(1, READINGS):
        noise[k] = correlation * noise[k - 1] + np.sqrt(1.0 - correlation**2) * noise[k]
    return noise


def covered(law: str, correlation: float, curves: int) -> tuple[float, float]:
    """Share of the curves whose interval contains E, and the median half width of the interval over E."""
    modulus, low, high, stress_of = LAWS[law]
    stretch, random, inside, widths = np.linspace(low, high, READINGS), np.random.default_rng(1), 0, []
    stress = stress_of(stretch)
    for _ in range(curves):
        noise = NOISE * np.abs(stress).max() * noise_of(random, correlation)
        found = fit_stress(StressCurve(stretch, stress + noise)).young_modulus
        inside += found.low <= modulus <= found.high
        widths.append(0.5 * (found.high - found.low) / modulus)
    return inside / curves, float(np.median(widths))


def main() -> None:
    """Print the table of shares and median half widths."""
    curves = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    print(f"| {curves} curves of {READINGS} readings |", *(f"r = {r:g} |" for r in CORRELATIONS))
    print("|---|", *("---|" for _ in CORRELATIONS))
    for law in sys.argv[2:] or LAWS:
        cells = (covered(law, r, curves) for r in CORRELATIONS)
        print(f"| {law} |", *(f"{share:.3f} ± {100 * width:.1f} % |" for share, width in cells), flush=True)


if __name__ == "__main__":
    main()
