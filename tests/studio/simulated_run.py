# SPDX-License-Identifier: Apache-2.0
"""The recorder's process of the live view on a simulated clock, so that a busy computer delays nothing in it:
``python simulated_run.py ALONE FAULT=VALUE …`` waits ALONE seconds for a page, and its virtual rig has the faults."""

import sys
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from simulated_time import SimulatedTime

from needleforce.rig.live import VirtualRig, parse_fault
from needleforce.studio import live_run

alone, *faults = sys.argv[1:]
live_run.MAX_ALONE = float(alone)
live_run.VirtualRig = partial(VirtualRig, faults=dict(map(parse_fault, faults)))
with SimulatedTime():
    live_run.main(sys.stdin, sys.stdout)
