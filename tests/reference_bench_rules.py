# SPDX-License-Identifier: Apache-2.0
"""How reference values of the bench tests, tension of the tissue and bending of the needle, are computed."""

import numpy as np
from reference_rules import computes, needle

from needleforce import bench_tests
from needleforce.identification.statistics.regression import least_squares


@computes("hyperelastic", r"^mu\(l-l\^-2\)", "mu", "stretch")
def neo_hookean(given):
    return bench_tests.nominal_stress("neo_hookean", given["stretch"], [given["mu"]])


@computes("hyperelastic", r"2\(l-l\^-2\)\(C10\+C01/l\)", "C10", "C01")
def mooney(given):
    return bench_tests.nominal_stress("mooney_rivlin", given["stretch"], [given["C10"], given["C01"]])


@computes("hyperelastic", r"i C_?i0|C10.*I1-3|[Yy]eoh", "C10", "C20", "C30")
def yeoh(given):
    return bench_tests.nominal_stress("yeoh", given["stretch"], [given["C10"], given["C20"], given["C30"]])


@computes("hyperelastic", r"mu\(l\^\(a-1\)", "mu", "alpha")
def ogden(given):
    return bench_tests.nominal_stress("ogden", given["stretch"], [given["mu"], given["alpha"]])


@computes("identification", r"F a\^2\(3L-a\)/\(6 I delta\)", "F", "a", "delta")
def cantilever_modulus(given):
    return bench_tests.cantilever_modulus(given["F"], given["a"], given["delta"], needle(given))


@computes("identification", r"d ln E/d ln x", "a", "L")
def cantilever_sensitivities(given):
    return list(bench_tests.cantilever_sensitivities(given["a"], needle(given)).values())


@computes("identification", r"^sum zF/sum z\^2", "z_mm", "F")
def slope_through_origin(given):
    return least_squares(np.array(given["z_mm"])[:, None], np.array(given["F"]))[0][0]
