# SPDX-License-Identifier: Apache-2.0
"""Published devices held by an arm, with every shipped preset in their loops: the stretch that is proved to rest, the
chatter and the creep that are left, and MuJoCo's friction in the same scene. Prints the tables of
docs/evidence/rest.md; with ``--write`` it replaces them there."""

import argparse
import contextlib
import importlib.util
import io
import math
import re
import sys
import time
from pathlib import Path

import numpy as np

import needleforce as nf
from needleforce.control import Device, RestResult, rest_in_loop, simulated_hold

PAGE = Path(__file__).resolve().parents[1] / "docs" / "evidence" / "rest.md"
DEPTH, BELOW_PUNCTURE = 20e-3, 5e-3  # m
SECONDS = 30.0  # of each hold; the last third counts
KICKS = (0.0, 0.05, -0.05)  # m/s
LOADS = (0.3, 0.9)  # over the force of sliding
LARGEST_CHATTER = 1e-3  # N
# van Beek, Bergmann Tiest, Gabrielse, Lagerberg, Verhoogt, Wolfs & Kappers 2015, Sci. Rep. 5, 18004, fig. 3: an arm
ARM = {"mass": 0.554, "damping": 6.45, "stiffness": 135.0}
# apparent mass [kg] and damping [N s/m] of the device alone, and where they are published
PUBLISHED = {
    "Phantom Omni (Touch), Phantom Desktop (Touch X)": (0.045, 0.0, "data sheet, unconfirmed"),
    "Phantom Premium 1.5": (0.075, 0.0, "data sheet, unconfirmed"),
    "Phantom Premium 3.0": (0.159, 0.0, "data sheet, unconfirmed"),
    "LHIfAM": (5.4, 3.5, "Gil, Avello, Rubio & Flórez 2004, unconfirmed"),
}
LAG, DELAY = 1e-3, 1  # s, cycles; assumed: no data sheet gives them
HANDPIECE = Device(mass=0.1, damping=2.0, stiffness=50.0, lag=2e-3, name="handpiece of 100 g")


def devices() -> list[Device]:
    """The published devices in the arm, and the light handpiece."""
    held = [
        Device(
            mass=mass + ARM["mass"],
            damping=damping + ARM["damping"],
            stiffness=ARM["stiffness"],
            lag=LAG,
            delay=DELAY,
            name=name,
        )
        for name, (mass, damping, _) in PUBLISHED.items()
    ]
    return [*held, HANDPIECE]


def depth_for(model: nf.Model) -> float:
    """Depth of the hold [m]: 20 mm, deeper where a layer is punctured later."""
    punctures = [layer.top + layer.laws.puncture_depth for layer in model.layers]
    return max(DEPTH, max(each for each in punctures if math.isfinite(each)) + BELOW_PUNCTURE)


def chosen(result: RestResult) -> tuple[nf.Model, Device, str]:
    """The model and the device that are proved to rest, and what was changed."""
    if math.isfinite(result.stretch_factor):
        return result.with_stretch(), result.device, f"× {result.stretch_factor:.3g}"
    if math.isfinite(result.controller_damping):
        damped = result.device.replace(controller_damping=result.controller_damping)
        return result.model, damped, f"{result.controller_damping:.3g} N s/m"
    return result.model, result.device, "not proved"


def travel_of(model: nf.Model) -> float:
    """Travel [m] of a reversal until friction and cutting have half of their change: what a longer stretch costs."""
    depth = depth_for(model)
    inwards = np.linspace(-1e-3, depth, 4000)
    back = depth - np.geomspace(1e-7, 15e-3, 600)
    engine = nf.Insertion(model, max_speed=math.inf)
    force = engine.run(inwards, None, np.full(len(inwards), 1e-3))["force"][-1]
    after = engine.run(back, None, np.full(len(back), 1e-3))["force"]
    return float(depth - back[np.argmax(after < 0.5 * (force + after.min()))])


def row(name: str, device: Device) -> dict:
    """One preset in one device."""
    model = nf.preset(name)
    depth = depth_for(model)
    start = time.perf_counter()
    result = rest_in_loop(model, device, depth=depth)
    took = time.perf_counter() - start
    rested, with_device, change = chosen(result)
    holds = [simulated_hold(rested, with_device, depth, kick=kick, seconds=SECONDS) for kick in KICKS]
    loaded = [simulated_hold(rested, with_device, depth, load_share=load, seconds=SECONDS) for load in LOADS]
    return {
        "preset": name,
        "device": device.name,
        "verdict": result.verdict,
        "found": result.counterexample.force if result.counterexample else math.nan,
        "change": change,
        "before": travel_of(model),
        "after": travel_of(rested),
        "chatter": max(hold.force for hold in [*holds, *loaded]),
        "creep": [abs(hold.creep) for hold in loaded],
        "proved": change != "not proved",
        "seconds": took,
    }


def small(value: float, below: float) -> str:
    """Two digits, or 0 with what it is below."""
    return f"{value:.2g}" if value >= below else f"< {below:g}"


def print_rows(rows: list[dict]) -> None:
    """Presets with the same values share a row."""
    print("| preset | as it is | stretch | half of a reversal [mm] | chatter [mN] | creep at 30, 90 % [µm/s] |")
    print("|---|---|---|--:|--:|--:|")
    shared: dict[tuple, list[str]] = {}
    for each in rows:
        as_is = each["verdict"] + ("" if math.isnan(each["found"]) else f", {1e3 * each['found']:.3g} mN")
        half = f"{1e3 * each['before']:.2g} → {1e3 * each['after']:.2g}"
        creep = ", ".join(small(1e6 * value, 0.001) for value in each["creep"])
        cells = (as_is, each["change"], half, small(1e3 * each["chatter"], 0.001), creep)
        shared.setdefault(cells, []).append(f"`{each['preset']}`")
    for cells, names in shared.items():
        print("| " + " | ".join([", ".join(names), *cells]) + " |")


SCENE = """<mujoco><option timestep="0.001" integrator="implicitfast" gravity="0 0 0" noslip_iterations="{noslip}"/>
  <worldbody><body><joint name="slide" type="slide" axis="0 0 -1" frictionloss="{loss}" {solver}/>
  <geom size="0.005" mass="0.05"/></body></worldbody><actuator><motor joint="slide"/></actuator></mujoco>"""
STIFFER = 'solreffriction="0.002 1" solimpfriction="0.99 0.999 0.001"'
SETTINGS = {"frictionloss": ("", 0), "stiffer": (STIFFER, 0), "no-slip solver": ("", 20)}


def mujoco_creep(load_share: float, solver: str, noslip: int) -> float:
    """Speed [m/s] of 50 g under a share of the friction's limit at 15 mm in the tissue of the paper."""
    import mujoco

    limit = nf.preset("paper").friction.per_length * 15e-3
    model = mujoco.MjModel.from_xml_string(SCENE.format(noslip=noslip, loss=limit, solver=solver))
    data = mujoco.MjData(model)
    data.ctrl[0] = load_share * limit
    mujoco.mj_step(model, data, nstep=3000)
    start = data.qpos[0]
    mujoco.mj_step(model, data, nstep=3000)
    return (data.qpos[0] - start) / 3.0


def engine_creep(load_share: float) -> float:
    """The same with the engine attached to the joint."""
    import mujoco

    from needleforce.mujoco import attach, step

    tissue = nf.preset("paper")
    model = mujoco.MjModel.from_xml_string(SCENE.format(noslip=0, loss=0.0, solver=""))
    data = mujoco.MjData(model)
    needle = attach(tissue, model, joint="slide")
    data.qpos[0], limit = -1e-3, tissue.friction.per_length * 15e-3
    while data.qpos[0] < 15e-3:  # driven in, then let go
        data.qvel[0] = 20e-3
        step(model, data, needle)
    data.qvel[0], data.ctrl[0] = 0.0, load_share * limit
    for _ in range(3000):
        step(model, data, needle)
    start = data.qpos[0]
    for _ in range(3000):
        step(model, data, needle)
    return (data.qpos[0] - start) / 3.0


def print_mujoco() -> None:
    if not importlib.util.find_spec("mujoco"):
        print("MuJoCo is not installed")
        return
    print("| friction of 50 g at 15 mm | creep at 30 % [µm/s] | creep at 90 % [µm/s] |\n|---|--:|--:|")
    for name, (solver, noslip) in SETTINGS.items():
        print(
            f"| MuJoCo, {name} | "
            + " | ".join(f"{small(1e6 * mujoco_creep(x, solver, noslip), 0.001)}" for x in LOADS)
            + " |"
        )
    print("| engine, `attach` | " + " | ".join(f"{small(1e6 * abs(engine_creep(x)), 0.001)}" for x in LOADS) + " |")


def print_devices(presets: list[str]) -> float:
    """Prints the table of each device; the largest chatter [N] of what is proved to rest."""
    every = []
    for device in devices():
        rows = []
        for name in presets:
            rows.append(row(name, device))
            print(f"{device.name}: {name}, {rows[-1]['seconds']:.2f} s", file=sys.stderr)
        loop = f"lag {1e3 * device.lag:g} ms, delay {device.delay}"
        print(f"**{device.name}**: {device.mass:g} kg, {device.damping:g} N s/m, {device.stiffness:g} N/m, {loop}\n")
        print_rows(rows)
        print()
        every += rows
    proved = [each for each in every if each["proved"]]
    largest = max(each["chatter"] for each in proved)
    slowest = max(each["seconds"] for each in every)
    print(
        f"Largest chatter of the {len(proved)} of {len(every)} loops that are proved to rest: {1e3 * largest:.2g} mN. "
    )
    print(f"Slowest answer: {slowest:.1f} s.")
    return largest


def printed(work, *arguments) -> tuple[str, float | None]:
    """What a function prints, and what it returns."""
    with contextlib.redirect_stdout(io.StringIO()) as out:
        result = work(*arguments)
    print(out.getvalue())
    return out.getvalue(), result


def main(presets: list[str], write: bool) -> None:
    text, largest = printed(print_devices, presets)
    tables = {"table": text, "mujoco": printed(print_mujoco)[0]}
    if write:
        page = PAGE.read_text(encoding="utf-8")
        for name, text in tables.items():
            marked = re.compile(rf"(<!-- {name}: .*? -->\n).*?(<!-- end of {name} -->)", re.S)
            page = marked.sub(lambda found, text=text: f"{found[1]}{text.rstrip()}\n{found[2]}", page)
        PAGE.write_text(page, encoding="utf-8")
    if largest > LARGEST_CHATTER:
        sys.exit("NOT MET: chatter above 1 mN")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("presets", nargs="*", default=list(nf.presets()))
    parser.add_argument("--write", action="store_true", help="replace the tables of docs/evidence/rest.md")
    options = parser.parse_args()
    main(options.presets, options.write)
