# SPDX-License-Identifier: Apache-2.0
"""A haptic device renders twice the tissue's force, at most 0.5 N and never more energy than the user put in; then the
sensor fails. Twin of guard.cpp."""

import needleforce as nf
from needleforce.control import Guard

guard = Guard(
    nf.Insertion(nf.preset("paper")),
    force_scale=2.0,
    max_force=0.5,
    stale_after=5e-3,
    fall_time=10e-3,
    longest_cycle=1.5e-3,
    max_speed=0.3,
    max_acceleration=20.0,
    delay=1,
)
dt, speed = 1e-3, 20e-3
outputs = [guard.step(speed * dt * (cycle - 1), None, dt) for cycle in range(600)]  # to 12 mm, measured a cycle late
largest = max(output.force for output in outputs)
print(f"largest force {largest:.4f} N, energy put in {1e3 * outputs[-1].energy:.3f} mJ")
record = guard.recorder()
cycles, output = 0, outputs[-1]
while output.force > 0.0:
    output, cycles = guard.miss(dt), cycles + 1
print(f"without a measurement no force after {cycles} cycles")

for number, force, sample, clamped in zip(
    *(record[name][-64:] for name in ("number", "force", "sample_force", "clamped"))
):
    if number % 32 == 0:
        print(f"cycle {number}: {force:.3f} N of {2.0 * sample:.3f} N{', clamped' if clamped else ''}")
