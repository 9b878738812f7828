# SPDX-License-Identifier: Apache-2.0
"""How reference values of needles that bend are computed: beam on a foundation, path, buckling, kinematics."""

import math

import closed_forms
import numpy as np
from reference_rules import computes

import needleforce as nf
from needleforce import fe
from needleforce.bench_tests.elastica import tip_of_cantilever
from needleforce.mechanics import beam_on_foundation as beam
from needleforce.mechanics.buckling import embedded_buckling_force, foundation_buckling_force


def stiffness(given):
    """E I, as a number or as the formula of a solid needle."""
    section = given.get("EI", "14.1e9*pi D^4/64")
    return 14.1e9 * math.pi * given["D"] ** 4 / 64.0 if isinstance(section, str) else section


def modulus(given):
    """K, as a number; entries that leave it out mean the paper's, after Vesic."""
    if isinstance(given.get("K"), float):
        return given["K"]
    needle = nf.Needle(given["D"], 0.0, 0.08, 14.1e9, 0.3)
    return nf.foundation_modulus(needle, nf.Tissue(given["E_s"], 0.5))


def beam_of(given):
    return stiffness(given), modulus(given), given["P"]


@computes("winkler", r"^\(K/4EI\)\^\(1/4\)$", "EI", "K")
@computes("beam", r"^\(K/\(4EI\)\)\^\(1/4\)$", "EI", "K")
def wavenumber(given):
    return beam.beam_wavenumber(stiffness(given), modulus(given))


@computes("winkler", r"^2 P beta/K$", "P")
@computes("beam", r"^y\(0\)=2 P beta/K$", "P")
def semi_infinite_tip(given):
    return beam.tip_deflection(*beam_of(given))


@computes("winkler", r"2Pb/K \(sh ch - s c\)/\(ch\^2\+c\^2\)", "P", "L")
@computes("beam", r"\(2Pb/K\)\(sinh cosh - sin cos\)/\(cosh\^2\+cos\^2\)", "P", "L")
def clamped_tip(given):
    return beam.tip_deflection(*beam_of(given), given["L"])


@computes("winkler", r"^P - int_0\^L K y dx", "P", "L")
def clamped_shear(given):
    return closed_forms.clamp_force(*beam_of(given), given["L"])


@computes("nonlinear_foundation", r"k3 y\^3=0", "k3", "L", "P")
@computes("beam", r"k3 y\^3=0", "k3", "L", "P")
def cubic_tip(given):
    scale = math.sqrt(modulus(given) / given["k3"])
    return closed_forms.cubic_deflection(*beam_of(given), given["L"], scale)


@computes("path_attached_beam", r"^Y\(s\)=2Pb/K \(1\+2 b s\+b\^2 s\^2\)", "P", "s")
def switched_on(given):
    return nf.switch_on_path(given["s"], *beam_of(given))[0]


@computes("path_attached_beam", r"^kappa=P/\(EI beta\)$", "P")
def curvature(given):
    return nf.steady_curvature(*beam_of(given))


@computes("path_attached_beam", r"P/sqrt\(K EI\)$", "P")
def lag(given):
    return closed_forms.steady_tip_lag(*beam_of(given))


@computes("path_attached_beam", r"max \|EI\(kappa\+w''\)\|", "P")
def moment(given):
    return stiffness(given) * nf.steady_curvature(*beam_of(given))


@computes("path_attached_beam", r"^P\(s\)=P0 \(s/l\)\^3", "P", "l", "s")
def cubic_ramp(given):
    ramp = lambda s: given["P"] * (s / given["l"]) ** 3  # noqa: E731
    return closed_forms.tip_path(given["s"], stiffness(given), modulus(given), ramp)


@computes("path_attached_beam", r"^P=P0\(1-exp\(-s/lb\)\)", "P", "lb", "s")
def build_up(given):
    force = lambda s: given["P"] * (1.0 - np.exp(-s / given["lb"]))  # noqa: E731
    return closed_forms.tip_path(given["s"], stiffness(given), modulus(given), force)


@computes("guided_insertion", r"Volterra|^Y\(a\)=P\(a\)phi_a", "EI", "guide", "layers", "P0", "lb", "a")
def guided_insertion(given):
    """Run, not evaluated: the engine itself."""
    diameter = 1e-3
    needle = nf.Needle(diameter, 0.0, 0.9, given["EI"] * 64.0 / (math.pi * diameter**4))
    layers = [nf.LateralLayer(top=top, modulus=k, tip_force=given["P0"]) for top, k in given["layers"]]
    insertion = nf.FlexibleInsertion(
        None, needle, lateral=layers, guide_distance=given["guide"], bevel_length=given["lb"], elements=100,
        planar=True, small_slopes=True, max_speed=math.inf,
    )  # fmt: skip
    return insertion.run(np.linspace(0.0, given["a"], 81))["tip"][-1, 0]


def column(given):
    """A needle with the entry's length and bending stiffness."""
    diameter = 1e-3
    return nf.Needle(diameter, 0.0, given["L"], given["EI"] * 64.0 / (math.pi * diameter**4))


@computes("buckling", r"^pi\^2 EI/\(4 L\^2\)$", "EI", "L")
def clamped_free(given):
    return nf.buckling_force(column(given), "clamped_free")


@computes("buckling", r"tan x = x", "EI", "L")
def clamped_pinned(given):
    return nf.buckling_force(column(given), "clamped_pinned")


@computes("buckling", r"^2 sqrt\(K EI\)$", "EI", "K")
def infinite_foundation(given):
    return foundation_buckling_force(given["EI"], given["K"], free_end=False)


@computes("buckling", r"^sqrt\(K EI\)", "EI", "K")
def free_end(given):
    return foundation_buckling_force(given["EI"], given["K"], free_end=True)


@computes("buckling", r"lowest N of EI y4\+N y2\+K y=0: clamped at -Lf", "EI", "K", "Lf", "a")
def partly_embedded(given):
    return embedded_buckling_force(given["EI"], given["K"], given["Lf"], given["a"])


@computes("elastica", r"Bisshopp-Drucker", "alpha")
def elastica(given):
    """Slope, deflection and distance of the tip; a straight shaft beyond the load shows the slope."""
    load = np.array([float(given["alpha"])])
    sag, beyond = (float(tip_of_cantilever(load, 1.0, length, 1.0, np.zeros(1))[0]) for length in (1.0, 2.0))
    return math.asin(beyond - sag), sag, math.sqrt(2.0 * (beyond - sag) / load[0])


def arc(curvature, length):
    """Distance along the first direction and across it, of the end of a path in one step."""
    model = nf.steering.Unicycle(curvature)
    model.step(0.0)
    x, _, z = model.step(length).tip
    return [z, x]


@computes("kinematics", r"sin\(kL\)/k,\(1-cos kL\)/k", "kappa", "L")
def unicycle(given):
    return arc(given["kappa"], given["L"])


@computes("kinematics", r"^x=sin\(kL\)/k", "kappa", "length")
def unicycle_named(given):
    return arc(given["kappa"], given["length"])


@computes("kinematics", r"kappa=tan\(phi\)/l1", "phi_deg", "l1_cm")
def bicycle(given):
    # the entry is in cm
    return nf.steering.Bicycle(math.radians(given["phi_deg"]), 0.01 * given["l1_cm"], 0.0).curvature * 0.01


@computes("finite_elements", r"ln\(r2/r1\)", "E", "nu", "Q", "r1", "r2")
def kelvin(given):
    return closed_forms.line_force_displacement(elastic(given), given["Q"], given["r1"], given["r2"])


@computes("finite_elements", r"^u\(a\)=", "E", "nu", "p", "a", "b")
def lame(given):
    return closed_forms.ring_displacement(elastic(given), given["p"], given["a"], given["b"])


@computes("finite_elements", r"2 atan\(Omega/2\)", "Omega")
def newmark_phase(given):
    rule = fe.Newmark(fe.DynamicSystem(1.0, 0.0, given["Omega"] ** 2), 1.0)
    after = rule.step(rule.start(1.0), 0.0)
    return math.atan2(-after.velocity[0] / given["Omega"], after.displacement[0])


def elastic(given):
    return fe.Elastic(given["E"], given["nu"])


@computes("finite_elements", r"^4 G R/\(1-nu\)$", "E", "nu", "R")
def flat_punch(given):
    modulus = nf.Tissue(given["E"], given["nu"]).plane_strain_modulus
    depth = 1e-5
    return nf.contact(nf.tips.Flat(radius=given["R"]), depth=depth, reduced_modulus=modulus).force / depth
