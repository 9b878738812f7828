# SPDX-License-Identifier: Apache-2.0
"""A slow planner in a thread of its own says at 30 Hz where a deeper layer is and how stiff, as the tissue moves;
the loop at 1 kHz takes it over, smooth in force. Twin of planner.cpp."""

import math
import threading

import needleforce as nf
from needleforce.control import LiveInsertion

dt, frame, seconds = 1e-3, 1.0 / 30.0, 4.0
angle = math.radians(15.0)
above = nf.Model(
    nf.laws.Cone(120e3, angle), nf.laws.PunctureDepth(3e-3), nf.laws.Coulomb(18.6), nf.laws.ConstantCutting(0.08)
)


def seen(time):
    """What the planner sees at a time: the deeper layer breathes by 0.5 mm, and is stiffer the further out it is."""
    breath = math.sin(2.0 * math.pi * 0.25 * time)
    stiffness = nf.laws.Cone(300e3 * (1.0 - 0.2 * breath), angle)
    below = nf.Layer(6e-3 + 0.5e-3 * breath, stiffness, above.puncture, above.friction, above.cutting)
    return above.replace(deeper=(below,))


live = LiveInsertion(seen(0.0))
due, sent = threading.Semaphore(0), threading.Semaphore(0)


def plan():
    """One model a frame, by the loop's time, which here runs as fast as it can."""
    frames = 0
    while frames * frame < seconds:
        due.acquire()
        live.replace(seen(frames * frame))
        frames += 1
        sent.release()


planner = threading.Thread(target=plan)
planner.start()
force = largest = 0.0
frames = cycle = 0
while (cycle := cycle + 1) * dt < seconds:
    time = cycle * dt
    depth = min(4e-3 * time, 8e-3)
    # so that both twins say the same, the loop waits for each frame; a loop on a clock takes what is there
    while frames < int(time / frame) + 1:
        due.release()
        sent.acquire()
        frames += 1
    sample = live.step(depth, None, dt)
    if sample.punctured:
        print(f"puncture at {1e3 * depth:.2f} mm")
    else:
        largest = max(largest, abs(sample.force - force))
    force = sample.force
planner.join()
print(f"{live.taken} models taken over, {live.refused} kept out")
print(f"largest change of force {1e3 * largest:.2f} mN in 1 ms, of {force:.3f} N")
