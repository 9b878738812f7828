# SPDX-License-Identifier: Apache-2.0
import contextlib
import inspect
import os
import shutil
import signal
import subprocess
import time
from pathlib import Path

import progress_lines
import pytest
from building import built
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


SHARES = 28
ALL_REPETITIONS = pytest.StashKey[bool]()  # of a test, and of the run what the test has that runs
# each has a fixture that takes long to make: a campaign, an installed package, a plugin, a browser with its server
ONE_PROCESS = tuple(f"tests/{folder}" for folder in ("campaign", "packaging", "simulators", "studio"))
# nine tenths of the time: in a run for a share each of their tests has its turn in one of so many shares
TURNS = 7
_LONG = "campaign commands fe identification mechanics packaging recordings report simulators steering studies studio"
BY_TURNS = tuple(f"tests/{folder}/" for folder in _LONG.split())
# files that take long: at the end, one process would wait for the other
EARLY = (*ONE_PROCESS, "tests/steering", "tests/studies", "tests/fe/test_insertion_fit")


def pytest_addoption(parser):
    parser.addoption("--lines", action="store_true", help="a line every five seconds instead of dots")
    parser.addoption("--long", action="store_true", help="only the tests that repeat themselves, with all repetitions")
    share = (
        f"all repetitions for one of {SHARES} shares, from 1; of the long folders a seventh; with --long only the first"
    )
    parser.addoption("--share", type=int, default=0, help=share)


def pytest_configure(config):
    progress_lines.register(config)
    config.addinivalue_line("markers", "long: only with all repetitions; else a test with fewer repetitions remains")


def pytest_collection_modifyitems(config, items):
    """All repetitions are for what has the fixture ``many`` or the marker ``long``: with ``--long``, or in the share of
    ``--share``. Of ``SHARES`` tests one is in a share: the cases of one test, which take equally long, are on different
    days. Tests that share what repeats are together. In a share those in ``BY_TURNS`` take turns, by their place."""
    long, share = config.getoption("--long"), config.getoption("--share")

    def is_marked(item):
        return item.get_closest_marker("long") is not None

    def repeats(item):
        return is_marked(item) or "many" in getattr(item, "fixturenames", ())

    def group(item):
        repeats_itself = is_marked(item) or "many" in inspect.signature(item.function).parameters
        return item.nodeid if repeats_itself else item.nodeid.split("::")[0]

    groups = list(dict.fromkeys(group(item) for item in items if repeats(item)))
    of_share = set(groups[share - 1 :: SHARES] if share else groups if long else ())
    of_others = {item for place, item in enumerate(items) if share and place % TURNS != share % TURNS}
    for item in items:
        item.stash[ALL_REPETITIONS] = repeats(item) and group(item) in of_share

    def has_turn(item):
        return item not in of_others or not item.nodeid.startswith(BY_TURNS)

    def is_chosen(item):
        return item.stash[ALL_REPETITIONS] or (has_turn(item) and not (long or is_marked(item)))

    config.hook.pytest_deselected(items=[item for item in items if not is_chosen(item)])
    chosen = [item for item in items if is_chosen(item)]
    items[:] = sorted(chosen, key=lambda item: not item.nodeid.startswith(EARLY))


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    item.config.stash[ALL_REPETITIONS] = item.stash[ALL_REPETITIONS]


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """A process has all tests of a file, or of a folder in ``ONE_PROCESS``. In the order of the folders: with the files
    of few tests at the end, as pytest-xdist would have them, one process waits for the last and slowest."""
    from xdist.scheduler import LoadFileScheduling

    class ByFile(LoadFileScheduling):
        def _split_scope(self, nodeid):
            file = super()._split_scope(nodeid)
            return next((folder for folder in ONE_PROCESS if file.startswith(folder)), file)

    config.option.loadscopereorder = False
    return ByFile(config, log)


@pytest.fixture(scope="session")
def many(request):
    """``many(5, 200)``: how often to repeat something here, and how often where all repetitions are made."""
    return lambda few, full: full if request.config.stash[ALL_REPETITIONS] else few


@pytest.fixture(scope="session")
def recordings() -> Path:
    """The folder of real recordings made by others: tests that need it say so and skip where it is absent."""
    if not RECORDINGS.is_dir():
        pytest.skip(f"no real recordings at {RECORDINGS}; set NEEDLEFORCE_RECORDINGS")
    return RECORDINGS


@pytest.fixture(scope="session")
def root() -> Path:
    return ROOT


@pytest.fixture(scope="session")
def once(tmp_path_factory):
    """``once(name, make)``: the folder that ``make(folder)`` fills, in the one process of a run that asks first."""
    own = tmp_path_factory.getbasetemp()
    of_run = own.parent if "PYTEST_XDIST_WORKER" in os.environ else own

    def made(name: str, make) -> Path:
        folder, begun = of_run / name, of_run / f"{name}_begun"
        try:
            begun.mkdir()
        except FileExistsError:
            for _ in range(600):
                if folder.exists():
                    return folder
                time.sleep(0.2)
            pytest.fail(f"the process that makes {name} does not end")
        make(own / f"{name}_made")
        return (own / f"{name}_made").rename(folder)

    return made


@pytest.fixture(scope="session")
def shared_library(root, once) -> Path:
    """The C library as programs and hosts load it, with all of its parts."""
    options = ("-DBUILD_SHARED_LIBS=ON", "-DCMAKE_BUILD_TYPE=None", "-DCMAKE_CXX_FLAGS=-O1")
    return once("c_library", lambda folder: built(root, folder, *options)) / "libneedleforce.so"


@pytest.fixture(scope="session")
def wasm(root, once) -> Path:
    """The folder with needleforce.mjs and the core for WebAssembly: that of ``make wasm`` if it is of these sources,
    else one that one process of a run compiles."""
    missing = [tool for tool in ("clang++-19", "node") if shutil.which(tool) is None]
    if missing:
        pytest.skip(f"no {' and no '.join(missing)}: tools/system_packages.sh proof installs what WebAssembly needs")
    if subprocess.run(["make", "--question", "--silent", "wasm"], cwd=root, capture_output=True).returncode == 0:
        return root / "src" / "needleforce" / "studio" / "core"
    build = root / "bindings" / "wasm" / "build.sh"
    return once("wasm", lambda folder: subprocess.run([build, folder], check=True))
