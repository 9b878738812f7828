# SPDX-License-Identifier: Apache-2.0
"""How reference values of layers, and of friction, cutting and stiffness laws by other authors, are computed."""

import math
import re

import numpy as np
from reference_rules import computes

import needleforce as nf


def layered(given):
    """Layers of constant friction and cutting without resistance, the first punctured at its surface."""
    laws = [
        nf.Layer(each["top"], nf.laws.Cone(1e5, math.radians(15.0)), nf.laws.PunctureDepth(0.0),
                 nf.laws.Coulomb(each["f_density"], dimple_ratio=float(given.get("origin") == "deformed")),
                 nf.laws.ConstantCutting(each["f_cut"]))
        for each in given["layers"]
    ]  # fmt: skip
    first = laws[0]
    return nf.Model(first.stiffness, first.puncture, first.friction, first.cutting, deeper=tuple(laws[1:]))


@computes("layers", r"sum_i f'_i l_i", "layers", "z")
def force_in_layers(given):
    insertion, model, forces = None, layered(given), []
    for depth in np.atleast_1d(given["z"]):
        insertion = nf.Insertion(model)
        forces.append(insertion.run(np.linspace(-1e-3, depth, 2001), None, np.full(2001, 1e-2))["force"][-1])
    return forces


CRACKS = {"D": 1.0, "pi D/2": math.pi / 2.0, "pi D": math.pi}  # lengths of the crack over the diameter


@computes("fracture", r"J=\(F1-F2\)/a_c", "F1_minus_F2")
def toughness(given):
    told = given.get("crack_length", "D")
    length = CRACKS[told] * given["D"] if isinstance(told, str) else told
    unit = nf.laws.Fracture(toughness=1.0, crack_length=length)
    force = nf.Model(nf.laws.Cone(1e5, 0.3), nf.laws.PunctureDepth(0.0), nf.laws.Coulomb(0.0), unit).force([1e-2])[0]
    return given["F1_minus_F2"] / force


@computes("fracture", r"pi/4\) E' R\^2", "E", "nu", "R")
def spreading(given):
    modulus = nf.Tissue(given["E"], given["nu"]).plane_strain_modulus
    return nf.laws.Fracture(0.0, 1e-3, plane_strain_modulus=modulus, radius=given["R"]).spreading


@computes("empirical", r"^b=F/\(exp", "a", "z", "F")
def maurin_scale(given):
    return given["F"] / nf.laws.Exponential(rate=given["a"], scale=1.0).force(given["z"])


@computes("empirical", r"b\(exp\(a z\)-1\)", "a", "b", "z")
def maurin_force(given):
    return nf.laws.Exponential(rate=given["a"], scale=given["b"]).force(given["z"])


@computes("empirical", r"a1 ?\*? ?[zx].*a2|a_1.*a_2", "a1", "a2", "z")
def polynomial_force(given):
    return given.get("a0", 0.0) + nf.laws.Polynomial(given["a1"], given["a2"]).force(given["z"])


@computes("empirical", r"^-?\(?C_[pn] ?\+ ?b_[pn] v\)? ?l", "v", "length")
def karnopp_sliding(given):
    coulomb, out = given.get("C_p", 0.0), -abs(given.get("C_n", 0.0))
    law = nf.laws.Karnopp(coulomb, out, given.get("b_p", 0.0), abs(given.get("b_n", 0.0)), coulomb, out)
    return law.sliding(given["length"], given["v"])


def lugre(given, stiffness, damping, viscous):
    return nf.laws.Lugre(stiffness, damping, viscous, given["Fc"], given["Fs"], given.get("vs", 1e-3),
                         given.get("gamma", 2.0))  # fmt: skip


@computes("lugre", r"^g\(v\)", "s0", "s1", "s2", "Fc", "Fs", "vs", "v")
def lugre_steady(given):
    return lugre(given, given["s0"], given["s1"], given["s2"]).sliding(1.0, given["v"])


@computes("lugre", r"passive", "s1", "Fc", "Fs")
def lugre_passive(given):
    return lugre(given, 1e3, given["s1"], 0.0).min_passive_viscous


@computes("lugre", r"exact-exponential predict, h\(x\)", "x", "v", "dt", "Fc", "Fs", "vs")
def lugre_predicted(given):
    deflection, stiffness, damping, viscous = given["x"]
    law = lugre(given, stiffness, damping, viscous)
    return law.traction(law.deflected(deflection, given["v"], given["dt"]), given["v"])


def stick_slip(given):
    damping = (given["F_at_3mm_s"] - given["F_arrest"]) / (3e-3 - given["v_arrest"])
    return nf.laws.StickSlip(given["F_break"], given["F_arrest"], given["v_arrest"], damping, given["k"])


@computes("stick_slip", r"^F_arrest - c v_arrest", "k", "F_break", "F_arrest", "v_arrest", "F_at_3mm_s")
def force_of_a_still_crack(given):
    return stick_slip(given).still_force


@computes("stick_slip", r"ln\[", "V", "k", "F_break", "F_arrest", "v_arrest", "F_at_3mm_s")
def slip_time(given):
    return stick_slip(given).slip_time(given["V"])


@computes("stick_slip", r"^\(F_b-F_a\)/\(k ?V\)", "V", "k", "F_break", "F_arrest", "v_arrest", "F_at_3mm_s")
def stick_time(given):
    return stick_slip(given).stick_time(given["V"])


@computes("stick_slip", r"^(V ?\*? ?\()?T_stick ?\+ ?T_slip", "V", "k", "F_break", "F_arrest", "v_arrest", "F_at_3mm_s")
def period(given):
    law, speed = stick_slip(given), given["V"]
    return (law.stick_time(speed) + law.slip_time(speed)) * (speed if given["formula"].startswith("V") else 1.0)


@computes("stick_slip", r"time average|^steady", "V", "k", "F_break", "F_arrest", "v_arrest", "F_at_3mm_s")
def stick_slip_mean(given):
    return stick_slip(given).mean_force(given["V"])


def stribeck(given):
    return nf.laws.StribeckCutting(given["F_s"], given["F_k"], given["v_s"], given["c"])


@computes("stick_slip", r"v_s ln", "F_s", "F_k", "v_s", "c")
def critical_speed(given):
    return stribeck(given).critical_speed


@computes("stick_slip", r"^F_ss\(", "F_s", "F_k", "v_s", "c")
def stribeck_force(given):
    return stribeck(given).steady_force(speed_of_stribeck_force(given))


def speed_of_stribeck_force(given):
    """The speed [m/s] between the brackets of F_ss(…): a number in mm/s, the critical speed, or the input V."""
    argument = re.match(r"F_ss\(([^)]*)\)", given["formula"])[1]
    if argument in ("Vc", "V_c", "V_crit"):
        return stribeck(given).critical_speed
    stated = re.fullmatch(r"([\d.]+) mm/s", argument)
    return 1e-3 * float(stated[1]) if stated else given.get("V", given.get("v", math.nan))


@computes("rupture", r"^\(1 - q s/delta\)\^\(1/q\)|^exp\(-s/delta\)", "E_r", "alpha_deg", "h", "s", "delta")
def yielding_contact(given):
    """The contact alone, without friction, an advance s past its puncture at h and a recession r back."""
    law = nf.laws.YieldingTissue(0.0, 1e3, given["delta"], brittleness=given.get("q", 0.0))
    cone = nf.laws.Cone(given["E_r"], math.radians(given["alpha_deg"]))
    model = nf.Model(cone, nf.laws.PunctureDepth(given["h"]), law, nf.laws.NoCutting())
    deepest = given["h"] + given["s"]
    depth = np.array([0.0, 0.5 * given["h"], deepest, deepest - given.get("r", 0.0)])
    return nf.Insertion(model, max_speed=np.inf).run(depth, None, np.full(4, 1.0))["force"][-1]


@computes("beam", r"^F cot\(alpha\+atan mu\)", "F_axial", "alpha_deg")
def bevel_lateral(given):
    bevel = nf.tips.LancetBevel(math.radians(given["alpha_deg"]))
    return bevel.lateral_force(given["F_axial"], given.get("mu", 0.0), given.get("eta", 1.0))
