# SPDX-License-Identifier: Apache-2.0
"""The one place that defines the folder of real recordings made by others."""

import os
from pathlib import Path

RECORDINGS = Path(os.environ.get("NEEDLEFORCE_RECORDINGS", Path(__file__).resolve().parents[2] / "shared" / "data"))
