# SPDX-License-Identifier: Apache-2.0
"""The paper's campaign recorded over the loopback network in real time, compared with an offline simulation.

Takes ten minutes. ``python benchmarks/rig_campaign.py [FOLDER]`` resumes a folder that holds a part of the campaign.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from rig_process import rig

import needleforce as nf
from needleforce.rig import Sensor, SpeedClock, paper_experiment
from needleforce.rig.experiment import streams
from needleforce.rig.live.simulated import phantom_site
from needleforce.rig.run import path_of_run, perform

SEED = 1
SPEEDS = {3e-3: range(1, 6), 1e-3: range(6, 11)}
ENDS = (16e-3, 15.7e-3)  # depth of each pass [m]


def recorded(folder: Path) -> dict[float, list]:
    """The recordings of the campaign by speed, first and second pass of each site in turn."""
    with rig(seed=SEED) as made:
        command = [str(Path(sys.executable).with_name("needleforce")), "record", "--protocol", "paper"]
        subprocess.run([*command, "--folder", str(folder), *made.arguments(), "--plain"], check=True)
    names = "{:g}mm_s_site{}_pass{}.mcap"
    return {
        speed: [nf.read(folder / names.format(1e3 * speed, site, k)) for site in sites for k in (1, 2)]
        for speed, sites in SPEEDS.items()
    }


def simulated() -> dict[float, list]:
    """The same sites and motions simulated offline: two streams, joined."""
    runs: dict[float, list] = {}
    for speed, sites in SPEEDS.items():
        for site in sites:
            place, noises = phantom_site(SEED, site), streams(SEED, (7, site), 2)
            hole = None
            for end, noise in zip(ENDS, noises):
                run = perform(place, path_of_run(-4e-3, speed, end, 1.0), Sensor(), SpeedClock(), noise, hole=hole)
                runs.setdefault(speed, []).append(run.recording())
                hole = end
    return runs


def fitted(passes: list, folder: Path):
    """The fit by the paper's procedure on first and second passes."""
    bench = {"bending": folder / "needle_bending.csv", "tension": folder / "tissue_tension.csv"}
    needle = nf.preset("paper").needle
    return nf.identify(passes[::2], second_pass=passes[1::2], model="paper", needle=needle, **bench)


def main() -> None:
    """Prints for each speed and quantity: simulated offline, recorded, their difference in half intervals."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
    folder.mkdir(exist_ok=True)
    tests = paper_experiment(SEED, sites=1, speeds=(3e-3,))
    tests.bending.write(folder), tests.tension.write(folder)
    offline, over_network = simulated(), recorded(folder / "campaign")
    for speed in SPEEDS:
        direct, live = fitted(offline[speed], folder), fitted(over_network[speed], folder)
        for name, first in direct.parameters.items():
            second = live.parameters.get(name)
            if second is None:
                print(f"{1e3 * speed:g} mm/s {name}: not identified from the recordings")
                continue
            half = 0.5 * np.hypot(first.high - first.low, second.high - second.low)
            print(
                f"{1e3 * speed:g} mm/s {name:28s} {first.value:10.5g} ({first.low:.5g} to {first.high:.5g}) | "
                f"{second.value:10.5g} ({second.low:.5g} to {second.high:.5g}) {first.unit}; "
                f"{(second.value - first.value) / half:+.2f}"
            )


if __name__ == "__main__":
    main()
