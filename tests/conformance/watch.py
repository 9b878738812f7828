# SPDX-License-Identifier: Apache-2.0
"""The same streams through the Python package."""

import sys
from pathlib import Path

import needleforce as nf


def numbers(watch, event) -> list:
    parts = (event.time, event.depth, event.size, event.probability, event.delay) if event else (0.0,) * 5
    return [*parts, watch.noise, watch.needed_fall]


for path in sys.argv[1:]:
    print("case", path)
    watch = nf.EventDetector()
    for line in Path(path).read_text(encoding="utf-8").splitlines():
        match line.split():
            case ["keep"]:
                kept = watch.save()
            case ["restore"]:
                watch.restore(kept)
                print("taken")
            case ["reset"]:
                watch.reset()
            case sample:
                event = watch.step(*map(float, sample))
                print(*numbers(watch, event), event.kind if event else "none", watch.status)
