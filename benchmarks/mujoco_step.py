# SPDX-License-Identifier: Apache-2.0
"""The cost of a MuJoCo step with and without the plugin, in one run: JSON {bare_us, plugin_us, ratio}."""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import mujoco

import needleforce as nf
from needleforce.mujoco import plugin_xml

ROOT = Path(__file__).resolve().parents[1]
SCENE = """<mujoco><option timestep="0.001" integrator="implicitfast"/>{}
  <worldbody><body><joint name="slide" type="slide" axis="0 0 -1"/><geom size="0.005" mass="0.05"/></body></worldbody>
  <actuator><position joint="slide" kp="2000" kv="20"/></actuator></mujoco>"""
STROKE = 500  # steps of the insertion stroke, and as many of the withdrawal


def strokes(model, data, count: int) -> float:
    """Time per step [us] over ``count`` insertions to 20 mm and withdrawals, called from C."""
    start = time.perf_counter()
    for number in range(2 * count):
        data.ctrl[0] = 20e-3 if number % 2 == 0 else -2e-3
        mujoco.mj_step(model, data, nstep=STROKE)
    return 1e6 * (time.perf_counter() - start) / (2 * count * STROKE)


def loaded(extension: str):
    model = mujoco.MjModel.from_xml_string(SCENE.format(extension))
    return model, mujoco.MjData(model)


def load_plugin() -> None:
    """Builds and loads the plugin."""
    with tempfile.TemporaryDirectory() as folder:
        command = [ROOT / "integrations" / "mujoco" / "build.sh", folder]
        environment = {**os.environ, "PYTHON": sys.executable}
        built = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        mujoco.mj_loadPluginLibrary(built.stdout.strip())


def measure(nf_model=None, rounds: int = 15) -> dict[str, float]:
    """The shortest time of each scene over ``rounds``, in turn; call ``load_plugin`` once before."""
    bare = loaded("")
    tissue = plugin_xml(nf_model or nf.preset("paper"), joint="slide", max_speed=10.0)
    with_plugin = loaded(f"<extension>{tissue}</extension>")
    times = [(strokes(*bare, 10), strokes(*with_plugin, 10)) for _ in range(rounds)]
    bare_us, plugin_us = (min(each) for each in zip(*times))
    return {"bare_us": bare_us, "plugin_us": plugin_us, "ratio": plugin_us / bare_us}


if __name__ == "__main__":
    load_plugin()
    print(json.dumps(measure()))
