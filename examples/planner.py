# SPDX-License-Identifier: Apache-2.0
"""The tissue moves. A planner thread estimates depth and stiffness of a deeper layer at 30 Hz; the loop at 1 kHz adopts
each model without a jump in force. Twin of planner.cpp."""

import math
import threading

import needleforce as nf
from needleforce.control import LiveInsertion

dt, frame, seconds = 1e-3, 1.0 / 30.0, 4.0
angle = math.radians(15.0)
above = nf.Model(
    nf.laws.Cone(120e3, angle), nf.laws.PunctureDepth(3e-3), nf.laws.Coulomb(18.6), nf.laws.ConstantCutting(0.08)
)


def planned(time):
    """The planner's model: breathing moves the deeper layer by 0.5 mm; nearer to the surface it is stiffer."""
    breath = math.sin(2.0 * math.pi * 0.25 * time)
    stiffness = nf.laws.Cone(300e3 * (1.0 - 0.2 * breath), angle)
    below = nf.Layer(6e-3 + 0.5e-3 * breath, stiffness, above.puncture, above.friction, above.cutting)
    return above.replace(deeper=(below,))


live = LiveInsertion(planned(0.0))
due, sent = threading.Semaphore(0), threading.Semaphore(0)


def plan():
    """One model per frame, in the loop's time; here the loop runs as fast as it can."""
    frames = 0
    while frames * frame < seconds:
        due.acquire()
        live.replace(planned(frames * frame))
        frames += 1
        sent.release()


planner = threading.Thread(target=plan)
planner.start()
force = largest = 0.0
frames = cycle = 0
while (cycle := cycle + 1) * dt < seconds:
    time = cycle * dt
    depth = min(4e-3 * time, 8e-3)
    # the loop waits for each frame so that both twins print the same; a real-time loop never waits
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
print(f"{live.taken} models adopted, {live.refused} rejected")
print(f"largest change of force {1e3 * largest:.2f} mN in 1 ms, of {force:.3f} N")
