# SPDX-License-Identifier: Apache-2.0
"""The force of the paper's model in a control loop, during insertion and withdrawal. Twin of step.cpp."""

import needleforce as nf

insertion = nf.Insertion(nf.preset("paper"))
dt, speed = 1e-3, 3e-3
forces = []
for cycle in range(8000):
    depth = speed * dt * (cycle if cycle < 4000 else 8000 - cycle)
    sample = insertion.step(depth, None, dt)
    assert sample.status == nf.Status.ok
    if sample.punctured:
        print(f"puncture at {1e3 * depth:.3f} mm")
    forces.append(sample.force)
print(f"largest push {max(forces):.4f} N, largest pull {-min(forces):.4f} N")
