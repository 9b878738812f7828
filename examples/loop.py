# SPDX-License-Identifier: Apache-2.0
"""A 1 kHz loop along an insertion: the work of a step and the lateness of the wake-up, separately. Twin of loop.cpp.

`python examples/loop.py [seconds]`: insertion, hold and withdrawal in the given time.
"""

import contextlib
import ctypes
import gc
import os
import sys
import time

import needleforce as nf

PERIOD = 1_000_000  # [ns]


def motion(duration):
    """Trapezoid of speed from 2 mm above the surface to 10 mm deep and back; a fifth of the duration is the hold."""
    stroke = 0.4 * duration
    speed = 12e-3 / (0.9 * stroke)
    return nf.Motion.insert(-2e-3, speed, 10e-3, hold=0.2 * duration, acceleration=speed / (0.1 * stroke))


def prepare():
    """Locks the memory, requests real-time priority, and prints what was permitted."""
    gc.disable()
    locked = ctypes.CDLL(None).mlockall(1) == 0  # MCL_CURRENT: everything is allocated by now
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(80))
    words = ("not permitted", "yes")
    print(f"memory locked: {words[locked]}, real-time priority: {words[os.sched_getscheduler(0) == os.SCHED_FIFO]}")


def run(depths):
    """Work [ns] of each step, lateness [ns] of each wake-up, and the forces [N]."""
    insertion = nf.Insertion(nf.preset("paper"))
    work, late, forces = ([0] * len(depths) for _ in range(3))
    prepare()
    begin = time.monotonic_ns() + PERIOD
    for cycle, depth in enumerate(depths):
        due = begin + cycle * PERIOD
        time.sleep(max(0, due - time.monotonic_ns()) * 1e-9)
        woken = time.monotonic_ns()
        forces[cycle] = insertion.step(depth, None, 1e-9 * PERIOD).force
        work[cycle], late[cycle] = time.monotonic_ns() - woken, max(0, woken - due)
    return work, late, forces


def histogram(title, times):
    """Prints a histogram in microseconds; each bin is twice as wide as the one before."""
    ordered = sorted(times)
    median, p99 = (1e-3 * ordered[int(share * (len(ordered) - 1))] for share in (0.5, 0.99))
    print(f"{title}: {len(times)} steps, median {median:.3f}, p99 {p99:.3f}, largest {1e-3 * ordered[-1]:.3f} us")
    bins = [ns.bit_length() for ns in times]
    for k in range(min(bins), max(bins) + 1):
        count = bins.count(k)
        print(f"  below {1e-3 * 2**k:11.3f} us {count:7d} {'#' * (-(-50 * count // len(times)))}")


if __name__ == "__main__":
    duration = float(sys.argv[1]) if sys.argv[1:] else 10.0
    if not 0.1 <= duration <= 3600.0:
        sys.exit("give 0.1 to 3600 seconds")
    times = [1e-9 * PERIOD * cycle for cycle in range(round(duration * 1e9 / PERIOD))]
    work, late, forces = run(motion(duration).at(times)[0].tolist())
    histogram("work of a step with two readings of the clock", work)
    histogram("lateness of the wake-up", late)
    print(f"force: largest {max(forces):.9f} N, mean {sum(forces) / len(forces):.9f} N")
