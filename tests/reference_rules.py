# SPDX-License-Identifier: Apache-2.0
"""How each reference value is computed through the public names.

A rule is found by the quantity an entry computes (its group, formula and inputs), never by the entry's name.
"""

import math
import re

import numpy as np

import needleforce as nf
from needleforce import bench_tests
from needleforce.identification import models
from needleforce.mechanics.foundation import READINGS

PAPER = {"D": 0.7e-3, "E_n": 14.1e9, "E_s": 116e3, "F": 0.2101, "h": 3.237e-3, "alpha_deg": 15.0, "R": 0.35e-3,
         "E2": 116e3, "E1": 14.1e9, "nu1": 0.3, "L": 0.08, "sF": 0.0105, "sh": 0.1347e-3}  # fmt: skip
RULES = []


def implied_reduced_modulus(force, depth, shape, shank_radius=None):
    """E_r [Pa] at which a tip needs a force to reach a depth: force is proportional to E_r."""
    return force / nf.contact(shape, depth=depth, reduced_modulus=1.0, shank_radius=shank_radius).force


def computes(group: str, formula: str, *inputs: str):
    """Maps entries of a group whose formula matches and which have all the named inputs."""

    def register(function):
        RULES.append((group, re.compile(formula), set(inputs), function))
        return function

    return register


class Given(dict):
    """The inputs of an entry; what it leaves out are the paper's numbers."""

    def __missing__(self, key):
        return PAPER[key]


def tip(given):
    return nf.tips.Cone(half_angle=math.radians(given["alpha_deg"]))


def needle(given, modulus="E_n"):
    inner = given.get("d", 0.0)
    return nf.Needle(given["D"], inner, given["L"], given.get("E", given[modulus]), given.get("nu1", 0.3))


def tissue(given):
    return nf.Tissue(given["E_s"], given["nu"])


def modulus(given):
    if "E_r" in given:
        return given["E_r"]
    if "E1" in given or "E_1" in given:
        body = nf.Needle(0.7e-3, 0.0, 0.08, given["E1"], given["nu1"])
        return nf.reduced_modulus(body, nf.Tissue(given["E2"], given["nu2"]))
    return nf.Tissue(given["E2"], given.get("nu2", 0.5)).plane_strain_modulus


def cone(given, shank=None):
    return nf.contact(tip(given), depth=given["h"], reduced_modulus=modulus(given), shank_radius=shank)


@computes("sneddon", r"2/pi\*E_r\*tan|eq\.\(4\)\+\(6\)", "h", "alpha_deg")
def cone_force(given):
    return cone(given).force


@computes("sneddon", r"^2 h tan\(alpha\)/pi", "h")
def cone_radius(given):
    return nf.contact(tip(given), depth=given["h"], reduced_modulus=1.0).contact_radius


@computes("sneddon", r"h_c = a cot", "h")
def cone_contact_depth(given):
    return tip(given).length(cone_radius(given))


@computes("sneddon", r"dF/dh = 2 E_r a", "h", "alpha_deg")
def cone_slope(given):
    return cone(given).slope


@computes("sneddon", r"^(p_m ?= ?)?E_r cot\(alpha\)/2(,|$)", "E_r")
def cone_mean_pressure(given):
    return tip(given).mean_pressure(given["E_r"])


@computes("sneddon", r"E_r cot\(alpha\)/2 ?\*? ?a(r|rc)?cosh\(a/r\)", "E_r", "a", "r", "alpha_deg")
def cone_pressure(given):
    return nf.contact(tip(given), contact_radius=given["a"], reduced_modulus=given["E_r"]).pressure(given["r"])


def at_depth(shape, given):
    return nf.contact(shape, depth=given["h"], reduced_modulus=given.get("E_r", 1.0))


def at_radius(shape, given):
    return nf.contact(shape, contact_radius=given["a"], reduced_modulus=given.get("E_r", 1.0))


@computes("sneddon", r"4/3 E_r sqrt\(R\) h\^1\.5", "E_r", "R", "h")
def paraboloid_force(given):
    return at_depth(nf.tips.Paraboloid(given["R"]), given).force


@computes("sneddon", r"root of h=a/2 ln", "R", "h")
def sphere_radius(given):
    return at_depth(nf.tips.Sphere(given["R"]), given).contact_radius


@computes("sneddon", r"^E_r\[\(a\^2\+R\^2\)/2 ln", "E_r", "R", "h")
def sphere_force(given):
    return at_depth(nf.tips.Sphere(given["R"]), given).force


@computes("sneddon", r"^2 E_r R h", "E_r", "R", "h")
def flat_force(given):
    return at_depth(nf.tips.Flat(given["R"]), given).force


@computes("sneddon", r"2n/\(n\+1\) E_r a h", "E_r", "n", "c", "a")
def power_force(given):
    profile = nf.tips.PowerProfile(given["n"], given["a"], given["c"] * given["a"] ** given["n"])
    return at_radius(profile, given).force


@computes("sneddon", r"E_r cot\(alpha\) a\^2 \[arccos", "E_r", "b", "a", "alpha_deg")
def truncated_force(given):
    return at_radius(nf.tips.TruncatedCone(math.radians(given["alpha_deg"]), given["b"]), given).force


@computes("sneddon", r"^\(a/R\)\(a-sqrt\(a\^2-b\^2\)\)\+a cot\(alpha\) arccos", "R_tip", "a", "alpha_deg")
def blunted_depth(given):
    transition = given["b"] if isinstance(given.get("b"), float) else 0.0
    tip_ = nf.tips.BluntedCone(math.radians(given["alpha_deg"]), given["R_tip"], transition)
    return at_radius(tip_, given).depth


@computes("sneddon", r"quadrature, f'=\(r\+rho-R\)/sqrt", "R", "L_tip", "a")
def ogive_depth(given):
    return at_radius(nf.tips.TangentOgive(given["R"], given["L_tip"]), given).depth


def bevel(given, equivalence):
    return nf.tips.LancetBevel(math.radians(given["alpha_deg"]), equivalence)


@computes("geometry", r"^atan\(tan\(alpha\)/2\)", "alpha_deg")
def equal_length_angle(given):
    return math.degrees(bevel(given, "equal_length").equivalent_cone().half_angle)


@computes("geometry", r"paper cone formula with tan\(alpha\)/2", "alpha_deg", "h")
def equal_length_force(given):
    return nf.contact(bevel(given, "equal_length"), depth=given["h"], reduced_modulus=modulus(given)).force


@computes("reduced_modulus", r"1/\(\(1-nu1", "E1", "nu1", "E2", "nu2")
def reduced_modulus(given):
    return modulus(given)


@computes("paper_arithmetic", r"pi F/\(2 tan", "F", "h")
def implied_modulus_cone(given):
    return implied_reduced_modulus(given["F"], given["h"], tip(given))


@computes("paper_arithmetic", r"F/\(pi/2 R\^2 cot", "F", "h", "R")
def implied_modulus_shank(given):
    return implied_reduced_modulus(given["F"], given["h"], tip(given), given["R"])


@computes("paper_arithmetic", r"sqrt\(1-E2/E_r\)", "F", "h", "E2")
def implied_ratio_rigid(given):
    found = implied_reduced_modulus(given["F"], given["h"], tip(given), given.get("R"))
    return models.implied_poisson_ratio(found, given["E2"])


@computes("paper_arithmetic", r"eq\.\(4\) solved for nu2", "F", "h", "E1")
def implied_ratio(given):
    found = implied_reduced_modulus(given["F"], given["h"], tip(given), given.get("R"))
    return models.implied_poisson_ratio(found, given["E2"], needle(given, "E1"))


@computes("paper_arithmetic", r"E_r\*sqrt\(\(sF/F\)\^2\+\(2 sh/h\)\^2\)", "sF", "sh")
def implied_modulus_sd(given):
    found = implied_modulus_cone(given)
    slope = nf.contact(tip(given), depth=given["h"], reduced_modulus=found).slope
    return found * math.hypot(given["sF"] / given["F"], slope * given["sh"] / given["F"])


@computes("paper_arithmetic", r"\(E2/0\.75-E_r\)/sd")
def half_ratio_score_cone(given):
    incompressible = nf.Tissue(given["E2"], 0.5).plane_strain_modulus
    return (incompressible - implied_modulus_cone(given)) / implied_modulus_sd(given)


@computes("paper_arithmetic", r"^2 F sh/h$", "E_r", "h", "sh")
def peak_sd_from_depth(given):
    return cone(given).slope * given["sh"]


@computes("paper_arithmetic", r"\(F_model-F_peak\)/sqrt", "sF", "sh", "E2")
def half_ratio_score_shank(given):
    contact = cone(given, given["R"])
    return (contact.force - given["F"]) / math.hypot(given["sF"], contact.slope * given["sh"])


@computes("cone_cylinder", r"^pi R cot\(alpha\)/2", "R")
def saturation_depth(given):
    return nf.contact(tip(given), contact_radius=given["R"], reduced_modulus=1.0).depth


@computes("cone_cylinder", r"pi/2 E_r R\^2 cot", "E_r", "R")
def saturation_force(given):
    return nf.contact(tip(given), contact_radius=given["R"], reduced_modulus=modulus(given)).force


@computes("cone_cylinder", r"F_s \+ 2 E_r R|F_s\+2", "R", "h")
def shank_force(given):
    return cone(given, given["R"]).force


@computes("cone_cylinder", r"F_s h_s/3|energy|U", "R", "h")
def shank_energy(given):
    return cone(given, given["R"]).energy


@computes("energy", r"^F h/3", "h")
def stored_energy(given):
    return cone(given).energy


def paper_model(given, ratio=0.0, peak=None):
    depth = given["z1"]
    found = given.get("E_r") or implied_reduced_modulus(peak or PAPER["F"], depth, tip(given))
    return nf.preset("paper").replace(
        stiffness=nf.laws.Cone(found, math.radians(given["alpha_deg"])),
        puncture=nf.laws.PunctureDepth(depth),
        friction=nf.laws.Coulomb(given.get("f_density", 18.6), dimple_ratio=ratio),
        cutting=nf.laws.ConstantCutting(given.get("f_cut", 0.0776)),
    )


@computes("energy", r"\[stiffness, cutting, friction in, friction out\]", "z1", "z2")
def cycle_terms(given):
    return list(nf.cycle_work(paper_model(given), given["z2"]).values())


@computes("energy", r"all >= 0", "z1", "z2")
def cycle_total(given):
    return sum(cycle_terms(given))


@computes("geometry", r"^R cot\(alpha\)", "D")
def tip_length(given):
    return tip(given).length(0.5 * given["D"])


@computes("validity", r"Johnson 0\.2", "alpha_deg")
def representative_strain(given):
    return tip(given).representative_strain


@computes("needle", r"^pi D\^4/64|pi \(D\^4", "D")
def second_moment(given):
    return needle(given).second_moment


@computes("needle", r"^E I$", "E", "D")
def bending_stiffness(given):
    return needle(given).bending_stiffness


@computes("needle", r"^F a\^2\(3L-a\)/\(6EI\)", "F", "a", "L", "E")
def cantilever(given):
    return bench_tests.cantilever_deflection(given["F"], given["a"], needle(given))


@computes("needle", r"pi\^2 EI/\(2L\)\^2", "E", "D", "L")
def buckling_free(given):
    return nf.buckling_force(needle(given))


@computes("needle", r"4\.4934", "E", "D", "L")
def buckling_pinned(given):
    return nf.buckling_force(needle(given), "clamped_pinned")


@computes("needle", r"\(D\^4-64 EI/\(pi E\)\)", "E_steel", "D")
def tube(given):
    solid = nf.Needle(given["D"], 0.0, 0.08, PAPER["E_n"])
    return (given["D"] ** 4 - 64.0 * solid.bending_stiffness / (math.pi * given["E_steel"])) ** 0.25


@computes("winkler", r"^\(64 pi\^3 E_s/E_n\)", "E_s", "E_n")
def twelfth_root(given):
    return nf.foundation_modulus(needle(given), nf.Tissue(given["E_s"], 0.0)) / (0.65 * given["E_s"])


@computes("winkler", r"0\.65 E_s|^hollow I$|^b=D$|^steel tube$", "E_s", "nu", "b")
def vesic(given):
    return nf.foundation_modulus(needle(given), tissue(given), width=width(given))


def width(given):
    return math.pi * given["D"] if given["b"].replace(" ", "") in ("pi*D", "piD") else given["D"]


@computes("winkler", r"Biot", "E_s", "nu", "b_half")
def biot(given):
    return nf.foundation_modulus(needle(given), tissue(given), width=2.0 * given["b_half"], formula="biot")


@computes("winkler", r"E_n\^\(-1/12\)", "E1", "E2")
def needle_scaling(given):
    soft, stiff = (
        nf.foundation_modulus(needle({"E": given[key]} | PAPER), nf.Tissue(1e5, 0.5)) for key in ("E2", "E1")
    )
    return stiff / soft


@computes("winkler", r"E_t\^\(13/12\)", "ratio")
def tissue_scaling(given):
    values = [nf.foundation_modulus(needle(given), nf.Tissue(scale * 1e5, 0.5)) for scale in (1.0, given["ratio"])]
    return values[1] / values[0]


@computes("winkler", r"^k_s=K/b")
def subgrade(given):
    return nf.foundation_modulus(needle(given), nf.Tissue(given["E_s"], 0.5)) / (math.pi * given["D"])


@computes("winkler", r"^(A|B|C|L)?:|literal|Lame hole: mu|mu pi D E", "nu")
def implied_coefficient(given):
    formula = given["formula"]
    reading = next((name for name in READINGS if formula.startswith(f"{name}:")), None)
    reading = reading or ("literal_mm" if "literal" in formula else "lame")
    per_length = given.get("f_density", 1e3 * given.get("f_density_N_per_mm", 0.0186))
    found = nf.friction_coefficient(per_length, needle(given), tissue(given), reading=reading)
    # as printed, (11) changes by 1000 with the unit of length: the finding that this entry states
    return 1e3 * found if "N-m-Pa" in formula else found


@computes("winkler", r"p=E/\(1\+nu\)", "E", "nu")
def lame_pressure(given):
    body = nf.Needle(PAPER["D"], 0.0, 0.08, PAPER["E_n"])
    force = nf.friction_per_length(body, nf.Tissue(given["E"], given["nu"]), 1.0, reading="lame")
    return given["u_over_a"] * force / (math.pi * PAPER["D"])


@computes("winkler", r"^K/\(2 pi\)", "nu")
def wall_pressure(given):
    force = nf.friction_per_length(needle(given), tissue(given), 1.0, reading="A")
    return force / (math.pi * given["D"])


@computes("winkler", r"^reading [ABC]|^lame", "mu", "length")
def friction_force(given):
    reading = given["formula"].removeprefix("reading ")[:4].strip()
    return given["length"] * nf.friction_per_length(needle(given), tissue(given), given["mu"], reading=reading)


@computes("complete", r"^f' z1 \+ f_c", "z1")
def after_puncture(given):
    return after(given, 0.0)


def after(given, ratio):
    depth = np.nextafter(given["z1"], 1.0)
    return paper_model(given, ratio).force([depth])[0]


@computes("complete", r"^F_peak - \(f' z1", "F_peak", "z1")
def drop_undeformed(given):
    return given["F_peak"] - after(given, 0.0)


@computes("complete", r"^F_peak - f_c", "F_peak")
def drop_deformed(given):
    return given["F_peak"] - after(Given(given | {"z1": PAPER["h"]}), 1.0)


@computes("complete", r"^f' z \+ f_c", "z")
def force_at(given):
    return paper_model(Given(given | {"z1": PAPER["h"]})).force([given["z"]])[0]


@computes("complete", r"two-insertion difference", "z1", "f_density")
def dimple_bias(given):
    depth = [given["z1"] + 5e-3]
    return paper_model(given).force(depth)[0] - paper_model(given, 1.0).force(depth)[0]
