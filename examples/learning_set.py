# SPDX-License-Identifier: Apache-2.0
"""A learning set: recordings as a sensor shows them, with the truth behind each, in parts that share no specimen.

python examples/learning_set.py    # writes learning_set/ and learning_set.svg
"""

import tomllib
from pathlib import Path

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt
import numpy as np
import pyarrow.dataset

import needleforce as nf

question = tomllib.loads((Path(__file__).parent / "studies" / "learning_set.toml").read_text(encoding="utf-8"))
question["study"]["samples"] = 1000
nf.study(question, out="learning_set")
rows = pyarrow.dataset.dataset("learning_set/recordings", partitioning="hive").to_table().to_pandas()
parts = rows.groupby("split", observed=True)["number"].agg(["size", "nunique"])
print("\n".join(f"{part}: {row['size']} recordings of {row['nunique']} specimens" for part, row in parts.iterrows()))

figure, axes = plt.subplots(2, 3, figsize=(7.2, 4.0), layout="constrained", sharex=True, sharey=True)
for panel, (_, one) in zip(axes.flat, rows.sort_values("number").iterrows()):
    for phase in nf.Phase:
        shown = np.asarray(one["phase"]) == list(nf.Phase).index(phase)
        panel.plot(1e3 * one["depth"][shown], one["force"][shown], ".", ms=2, label=phase.name, rasterized=True)
    for puncture in one["puncture_depths"]:
        panel.axvline(1e3 * puncture, color="0.6", lw=0.8)
figure.supxlabel("depth [mm]", fontsize="medium")
figure.supylabel("force [N]", fontsize="medium")
lines = axes[0, 0].get_legend_handles_labels()
figure.legend(*lines, loc="outside upper center", ncols=5, frameon=False, markerscale=4)
figure.savefig("learning_set.svg", metadata={"Date": None}, dpi=150)
print("wrote learning_set.svg")
