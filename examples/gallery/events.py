# SPDX-License-Identifier: Apache-2.0
"""
Contact, puncture and exit in a recording
=========================================

A recording is read from a file with the column names of a laboratory, and its events are found from the noise and the
course of the force alone: no threshold in newtons. Each event has the samples between which it happened.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import needleforce as nf

folder = next(each for each in (Path(), *Path.cwd().parents) if (each / "examples" / "insertion.csv").exists())
recording = nf.read(folder / "examples" / "insertion.csv")
events = nf.segment(recording)
plt.plot(recording.time, recording.force, color="0.5", lw=1)
for name, event in (("contact ", events.contact), ("puncture ", events.punctures[0]), ("exit ", events.exit)):
    plt.plot(event.time, event.force, "o", mfc="white", mec="#c64f00")
    plt.annotate(name, (event.time, event.force), (0, 8), textcoords="offset points", ha="right")
for span in events.phases:
    plt.axvline(span.start, color="0.85", lw=0.8, zorder=0)
plt.xlabel("time [s]")
plt.ylabel("force [N]")
plt.show()
