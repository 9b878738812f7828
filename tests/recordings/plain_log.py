# SPDX-License-Identifier: Apache-2.0
"""A simple insertion written as a live recording, with values that a test can compute."""

from needleforce.recording.log import LogWriter

START = 1_790_000_000_000_000_000  # ns
DELAY = 200_000  # ns, of every packet
CARD = {"needle": "trocar", "tissue": "gel", "rig": "bench", "filter_length": "50", "axial": "fz"}


def wrench(number: int) -> tuple[float, ...]:
    return (0.1 + number, 0.2 + number, 1e-3 * number, 0.3, 0.4, 0.5)


def write(path, count=500, every=16, flush=100, skip=(), first=0, close=True):
    """``count`` wrenches at 1 kHz, a state at each ``every``-th of them: 1 µm of depth each ms."""
    log = LogWriter(path, CARD)
    for number in range(count):
        stamp = START + number * 1_000_000
        if number not in skip:
            log.wrench(first + number, stamp + DELAY, number * 1_000_000, stamp, wrench(number))
        if number % every == 0:
            log.state(number // every, stamp + DELAY, number * 1_000_000, stamp, 1e-6 * number, 1e-3)
        if number % flush == flush - 1:
            log.flush()
    if close:
        log.close({"why": "done"})
    return log
