# SPDX-License-Identifier: Apache-2.0
"""Many recordings at once: a folder of simulated specimens, identified on all cores, stopped and continued.

python examples/many_files.py    # writes recordings/, state/, many_files.csv and many_files.svg
"""

from pathlib import Path

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt
import numpy as np

import needleforce as nf
from needleforce.campaign import campaign

SPECIMENS, REPEATS, FRICTION, DAMAGED = 12, 4, np.linspace(12.0, 28.0, 12), 5
PATTERN = "{specimen}_{repeat}"

folder, random = Path("recordings"), np.random.default_rng(1)
folder.mkdir(exist_ok=True)
for specimen in range(SPECIMENS):
    model = nf.preset("paper").replace(friction=nf.laws.Coulomb(FRICTION[specimen]))
    one = nf.simulate(model, nf.Motion.insert(-4e-3, 3e-3, 12e-3), 100.0)
    for repeat in range(REPEATS):
        force = one.force + random.normal(0.0, 2e-3, len(one))
        nf.write(nf.Recording(one.time, one.depth, one.velocity, force), folder / f"gel{specimen:02d}_{repeat}.csv")
(folder / f"gel{DAMAGED:02d}_0.csv").write_bytes(b"time_s,depth_mm\n0,")  # its disk was full


def stopped(work, text):
    """A progress that ends the first campaign in the middle, as Ctrl-C does."""
    for number, each in enumerate(work):
        if text == "identifying" and number == SPECIMENS // 2:
            raise KeyboardInterrupt
        yield each


try:
    campaign(folder, pattern=PATTERN, state="state", progress=stopped)
except KeyboardInterrupt:
    print(campaign(None, state="state").all_notes[-1])
done = campaign(folder, pattern=PATTERN, state="state")
done.save_table("many_files.csv")

unreadable = [one.file for one in done.recordings if not one.pooled]
found = [condition.parameters["friction_per_length"] for condition in done.conditions]
held = sum(each.low <= truth <= each.high for each, truth in zip(found, FRICTION))
print(f"{len(done.recordings)} files, {len(done.conditions)} specimens, not used: {', '.join(unreadable)}")
print(f"friction within its interval: {held} of {SPECIMENS}")

figure, axes = plt.subplots(figsize=(7.2, 3.2), layout="constrained")
values, ends = np.array([each.value for each in found]), np.array([(each.low, each.high) for each in found])
axes.errorbar(range(SPECIMENS), values, yerr=np.abs(ends - values[:, None]).T, fmt="o", ms=4, label="identified")
axes.plot(range(SPECIMENS), FRICTION, "k_", ms=14, label="simulated")
axes.set_xlabel("specimen")
axes.set_ylabel("friction per length [N/m]")
axes.legend(frameon=False)
figure.savefig("many_files.svg", metadata={"Date": None})
print("wrote many_files.svg")
