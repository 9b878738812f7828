# SPDX-License-Identifier: Apache-2.0
import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def recordings() -> Path:
    """The folder of real recordings made by others: tests that need it say so and skip where it is absent."""
    folder = Path(os.environ.get("NEEDLEFORCE_RECORDINGS", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no real recordings at {folder}; set NEEDLEFORCE_RECORDINGS")
    return folder


@pytest.fixture(scope="session")
def root() -> Path:
    return ROOT
