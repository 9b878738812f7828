# SPDX-License-Identifier: Apache-2.0
"""The models whose headers are compiled, the way they go, and the programs that run them."""

import numpy as np

import needleforce as nf

BEVELS = ("paper_half_angle", "equal_length", "equal_volume", "wedge_bisector")
TIPS = {
    "cone": nf.tips.Cone(0.3),
    "paraboloid": nf.tips.Paraboloid(radius=1e-4),
    "sphere": nf.tips.Sphere(radius=5e-4),
    "flat": nf.tips.Flat(radius=2e-4),
    "power_profile": nf.tips.PowerProfile(exponent=3.0, reference_radius=3e-4, reference_height=1e-3),
    "truncated_cone": nf.tips.TruncatedCone(half_angle=0.3, flat_radius=5e-5),
    "blunted_cone": nf.tips.BluntedCone(half_angle=0.3, tip_radius=2e-5),
    "tangent_ogive": nf.tips.TangentOgive(radius=3.5e-4, length=2e-3),
    "profile": nf.tips.Profile(radii=[0.0, 1e-4, 2e-4, 3.5e-4], heights=[0.0, 1e-4, 4e-4, 1.3e-3]),
    **{word: nf.tips.LancetBevel(0.2617993877991494, equivalence=word) for word in BEVELS},
}


def models() -> dict:
    """Every shipped preset, and one of each tip, by the name of its constant."""
    found = {f"preset_{name}": nf.preset(name) for name in nf.presets()}
    for name, tip in TIPS.items():
        contact = nf.laws.TipContact(116e3, 0.35e-3, tip=tip)
        found[f"tip_{name}"] = nf.preset("paper").replace(stiffness=contact)
    return found


def way() -> np.ndarray:
    """In, a rest with noise, a bit back, deeper, out and in again [m]."""
    noise = 1e-7 * np.random.default_rng(0).standard_normal(60)
    strokes = [np.linspace(-1e-3, 6e-3, 350), 6e-3 + noise, np.linspace(6e-3, 5.8e-3, 30)]
    strokes += [np.linspace(5.8e-3, 14e-3, 400), np.linspace(14e-3, -1e-3, 300), np.linspace(-1e-3, 9e-3, 300)]
    return np.concatenate(strokes)


def cpp_program(names) -> str:
    """Reads depths and prints the force of each model along them, a model a line."""
    runs = "\n".join(f"  run({name}, depths);" for name in names)
    return f"""#include <cstdio>
#include <span>
#include <vector>
{"".join(f'#include "{name}.hpp"' + chr(10) for name in names)}
static void run(std::span<const needleforce::Layer> layers, const std::vector<double>& depths) {{
  needleforce::Insertion insertion(layers);
  for (double depth : depths)
    std::printf("%.17g ", insertion.step(depth, needleforce::no_velocity, 1e-3).force);
  std::printf("\\n");
}}
int main() {{
  std::vector<double> depths;
  for (double depth; std::scanf("%lf", &depth) == 1;) depths.push_back(depth);
{runs}
}}
"""


def c_program(names) -> str:
    """The same in C."""
    runs = "\n".join(f"  run({name}, {name}_layers, depths, count);" for name in names)
    return f"""#include <stdio.h>
#include <stdlib.h>
{"".join(f'#include "{name}.h"' + chr(10) for name in names)}
static void run(const nf_layer* layers, size_t layer_count, const double* depths, size_t count) {{
  nf_fault why;
  void* memory = malloc(nf_size());
  nf_insertion* insertion = nf_init(memory, nf_size(), layers, layer_count, NULL, &why);
  if (!insertion) {{ fprintf(stderr, "%s %s %s\\n", why.law, why.quantity, why.reason); exit(1); }}
  for (size_t i = 0; i < count; ++i) {{
    nf_sample sample;
    nf_step(insertion, depths[i], NF_NO_VELOCITY, 1e-3, &sample);
    printf("%.17g ", sample.force);
  }}
  printf("\\n");
  free(memory);
}}
int main(void) {{
  static double depths[10000];
  size_t count = 0;
  while (count < 10000 && scanf("%lf", &depths[count]) == 1) ++count;
{runs}
}}
"""
