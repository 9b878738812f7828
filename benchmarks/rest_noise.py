# SPDX-License-Identifier: Apache-2.0
"""Force of every preset in an hour of hold under noise of the depth.

``--write`` puts the table into docs/evidence/depth_noise.md.
"""

import argparse
import re
from pathlib import Path

import numpy as np

import needleforce as nf
from needleforce import core
from needleforce.control import depth_noise

PAGE = Path(__file__).resolve().parents[1] / "docs" / "evidence" / "depth_noise.md"
TABLE = re.compile(r"<!-- hour: .*? -->\n.*?<!-- end -->", re.DOTALL)
DEPTH, SPEED, RATE, NOISE = 15e-3, 3e-3, 1000, 5e-6  # m, m/s, Hz, m as standard deviation
HEAD = (
    "| preset | sliding | after an hour: no noise | noise, size unknown | size known | known less no noise |\n"
    "|---|---|---|---|---|---|"
)


def held(model, noise: np.ndarray, known: float) -> tuple[float, np.ndarray]:
    """The force at the end of the insertion and during the hold [N]."""
    ramp = np.arange(-1e-3, DEPTH, SPEED / RATE)
    depth = np.r_[ramp, DEPTH + noise]
    engine = core.Insertion(model.stack, core.Limits(depth_noise=known))
    force = engine.run(depth, None, np.full(len(depth), 1.0 / RATE))["force"]
    return force[len(ramp) - 1], force[len(ramp) :]


def cells(name: str, noise: np.ndarray, known: float) -> str:
    """A row of the table, without the name."""
    model = nf.preset(name)
    sliding, quiet = held(model, np.zeros_like(noise), 0.0)
    unknown, held_by_known = held(model, noise, 0.0)[1], held(model, noise, known)[1]
    difference = held_by_known - quiet
    values = (sliding, quiet[-1], unknown[-1000:].mean(), held_by_known[-1000:].mean())
    spread = f"{difference.min():+.4f} to {difference.max():+.4f}"
    return " | ".join(f"{value:.3f}" for value in values) + f" | {spread} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=int, default=3600, help="length of the hold")
    parser.add_argument("--write", action="store_true", help="put the table into the page")
    options = parser.parse_args()
    noise = np.random.default_rng(1).normal(0.0, NOISE, options.seconds * RATE)
    known = depth_noise(noise[: 10 * RATE], samples=len(noise))
    names: dict[str, list[str]] = {}  # presets with the same values share a row
    for name in sorted(nf.presets()):
        if all(law.is_passive for layer in nf.preset(name).layers for law in (layer.friction, layer.relaxation)):
            values = cells(name, noise, known)
            names.setdefault(values, []).append(f"`{name}`")
            print(f"| `{name}` | {values}", flush=True)
    lines = [HEAD, *(f"| {', '.join(shared)} | {values}" for values, shared in names.items())]
    if options.write:
        block = "\n".join(["<!-- hour: python benchmarks/rest_noise.py --write -->", *lines, "<!-- end -->"])
        PAGE.write_text(TABLE.sub(lambda _: block, PAGE.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
