# SPDX-License-Identifier: Apache-2.0
import contextlib
import signal
from pathlib import Path

import progress_lines
import pytest
from hypothesis import settings
from recorded_data import RECORDINGS

# the same examples on every machine: a red run means a changed program
settings.register_profile("needleforce", derandomize=True, deadline=None)
settings.load_profile("needleforce")

# a shell that runs the tests in its background ignores Ctrl-C for them; the programs they start must not inherit that
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    with contextlib.suppress(ValueError):  # a test runner's own thread
        signal.signal(signal.SIGINT, signal.default_int_handler)

ROOT = Path(__file__).resolve().parents[1]


def pytest_addoption(parser):
    parser.addoption("--lines", action="store_true", help="a line every five seconds instead of dots")


def pytest_configure(config):
    progress_lines.register(config)


@pytest.fixture(scope="session")
def recordings() -> Path:
    """The folder of real recordings made by others: tests that need it say so and skip where it is absent."""
    if not RECORDINGS.is_dir():
        pytest.skip(f"no real recordings at {RECORDINGS}; set NEEDLEFORCE_RECORDINGS")
    return RECORDINGS


@pytest.fixture(scope="session")
def root() -> Path:
    return ROOT
