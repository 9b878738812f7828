# SPDX-License-Identifier: Apache-2.0
import os
from pathlib import Path

import pytest
from hypothesis import settings

# the same examples on every machine: a red run means a changed program
settings.register_profile("needleforce", derandomize=True, deadline=None)
settings.load_profile("needleforce")

ROOT = Path(__file__).resolve().parents[1]
RECORDINGS = Path(os.environ.get("NEEDLEFORCE_RECORDINGS", ROOT.parent / "shared" / "data"))


@pytest.fixture(scope="session")
def recordings() -> Path:
    """The folder of real recordings made by others: tests that need it say so and skip where it is absent."""
    if not RECORDINGS.is_dir():
        pytest.skip(f"no real recordings at {RECORDINGS}; set NEEDLEFORCE_RECORDINGS")
    return RECORDINGS


@pytest.fixture(scope="session")
def root() -> Path:
    return ROOT
