# SPDX-License-Identifier: Apache-2.0
"""A robot inserts a needle under force control and stops at the puncture of the second layer. Twin of admittance.cpp.

Admittance control: a rising reference force minus the measured force moves a virtual damped mass, and the axis follows
it with a lag. Three runs: stop at a drop of the measured force; stop at the model's puncture; stop at a drop, but move
slowly when the model has a puncture ahead. `python examples/admittance.py a.svg` also draws the three.
"""

import sys

import needleforce as nf

DT, LAG, FILTER = 1e-3, 20e-3, 10e-3  # [s] cycle; lag of the axis; low-pass filter of the sensor
MASS, DAMPING = 0.5, 12.0  # [kg], [N s/m] of the virtual mass
RISE, SPEED, CREEP = 0.2, 20e-3, 1e-3  # [N/s] of the reference; [m/s] limit of the command; [m/s] near a puncture
AHEAD, DROP, NOISE = 0.5e-3, 0.02, 0.005  # [m] counts as near; [N] counts as a drop; [N] sensor noise
TRUE, MODEL, PUNCTURE = 6e-3, 5.8e-3, 2e-3  # [m] top of the second layer, true and modelled; its puncture below the top


def tissue(top):
    """The paper's layer, and below ``top`` [m] a layer with a stiffer surface."""
    contact, shaft, cut = nf.laws.Cone(3e5, 0.2618), nf.laws.Coulomb(30.0), nf.laws.ConstantCutting(0.06)
    lower = nf.Layer(top, contact, nf.laws.PunctureDepth(PUNCTURE), shaft, cut)
    return nf.Insertion(nf.preset("paper").replace(deeper=(lower,)))


def insert(by_drop, by_model):
    """Depths [m] and forces [N] of a run."""
    true, model, ahead = tissue(TRUE), tissue(MODEL), tissue(MODEL)
    depth = command = velocity = reference = measured = extreme = 0.0
    drops, seed, falling, stopped, depths, forces = 0, 1, False, False, [], []
    for _ in range(3000):
        forces.append(true.step(depth, None, DT).force)
        seed = (1664525 * seed + 1013904223) % 2**32
        measured += DT / FILTER * (forces[-1] + NOISE * (seed / 2**31 - 1.0) - measured)
        extreme = min(extreme, measured) if falling else max(extreme, measured)
        if abs(measured - extreme) > DROP:
            falling, extreme = not falling, measured
            drops += falling
        model.step(depth, None, DT), ahead.step(depth + AHEAD, None, DT)
        stopped = stopped or (drops if by_drop else model.pierced_layers) == 2
        limit = CREEP if by_model and ahead.pierced_layers == 2 else SPEED
        reference += RISE * DT
        velocity += DT / MASS * (reference - measured - DAMPING * velocity)
        velocity = 0.0 if stopped else min(max(velocity, -limit), limit)
        command += velocity * DT
        depth += (command - depth) * DT / LAG
        depths.append(depth)
    return depths, forces


def draw(runs, path):
    """Force over time of each run, and over depth."""
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3), sharey=True, layout="constrained")
    for (name, (depths, forces)), line in zip(runs.items(), ("-", "--", ":")):
        left.plot([DT * k for k in range(len(forces))], forces, line, label=f"stops by {name}")
        right.plot([1e3 * depth for depth in depths], forces, line)
    left.set(xlabel="time [s]", ylabel="force [N]"), right.set(xlabel="depth [mm]"), left.legend()
    figure.savefig(path), print(f"wrote {path}")


runs = {"drop": insert(True, False), "model": insert(False, True), "both": insert(True, True)}
for name, (depths, forces) in runs.items():
    overshoot, peak = 1e3 * (depths[-1] - TRUE - PUNCTURE), forces.index(max(forces))
    excess = forces[-1] - min(forces[peak:])
    print(f"{name:5s}: peak {forces[peak]:.4f} N, at rest {overshoot:+.3f} mm and {excess:+.4f} N beyond the puncture")
if sys.argv[1:]:
    draw(runs, sys.argv[1])
