# SPDX-License-Identifier: Apache-2.0
"""A virtual rig in a separate process, so that the measured cost is that of the recorder only."""

import json
import subprocess
import sys
import time
from contextlib import contextmanager

_SERVER = """
import json, sys, time
import numpy as np
from needleforce import preset
from needleforce.rig.live import VirtualRig
options = json.loads(sys.argv[1])
model = preset(options.pop("preset")) if "preset" in options else None
with VirtualRig(model, **options) as rig:
    print(json.dumps([rig.sensor_port, rig.axis_port, rig.page_port]), flush=True)
    for line in sys.stdin:
        truth = rig.truth()
        since = float(line)
        late = truth.time >= since
        columns = {name: getattr(truth, name)[late].tolist() for name in ("time", "depth", "force")}
        streams = [{key: value for key, value in vars(each).items()} for each in truth.streams]
        print(json.dumps(columns | {"streams": streams, "now": rig.time}), flush=True)
"""


class RigProcess:
    """``options`` are those of ``VirtualRig``, ``preset`` the name of its tissue model; the ports are free ones."""

    def __init__(self, **options):
        arguments = [sys.executable, "-c", _SERVER, json.dumps(options)]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        self._process = subprocess.Popen(arguments, **pipes)
        self.sensor, self.axis, self.page = json.loads(self._process.stdout.readline())

    def truth(self, since: float = 0.0) -> dict:
        """Time, depth and force of the needle from ``since`` [s], the log of each stream, and the rig's time now."""
        self._process.stdin.write(f"{since}\n")
        self._process.stdin.flush()
        return json.loads(self._process.stdout.readline())

    def arguments(self) -> list[str]:
        """Its addresses, as options of ``needleforce record``."""
        here = "127.0.0.1"
        page = f"http://{here}:{self.page}/netftapi2.xml"
        return ["--sensor", f"{here}:{self.sensor}", "--sensor-page", page, "--axis", f"{here}:{self.axis}"]

    def end(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.communicate()


@contextmanager
def rig(**options):
    """A rig that ends with the block."""
    made = RigProcess(**options)
    try:
        yield made
    finally:
        made.end()
        time.sleep(0.1)
