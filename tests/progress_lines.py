# SPDX-License-Identifier: Apache-2.0
"""`pytest --lines`: a line at least every five seconds instead of dots, with what is running in how many tests, and at
the end the files that took longest."""

import threading
import time
from collections import Counter

import pytest

QUIET = 5.0  # [s]
SLOWEST = 15  # files


class ProgressLines:
    """Counts the tests that are done, also those of other processes, and prints where they are."""

    def __init__(self, config):
        self.config, self.begin = config, time.monotonic()
        self.total, self.done, self.running, self.seconds = 0, 0, {}, Counter()
        self.over = threading.Event()

    def pytest_sessionstart(self):
        threading.Thread(target=self._watch, daemon=True).start()

    @pytest.hookimpl(optionalhook=True)
    def pytest_xdist_node_collection_finished(self, ids):
        self.total = len(ids)

    def pytest_collection_finish(self, session):
        self.total = self.total or len(session.items)

    def pytest_runtest_logstart(self, nodeid):
        self.running[nodeid] = nodeid.split("::")[0].rsplit("/", 1)[-1]

    def pytest_runtest_logfinish(self, nodeid):
        self.running.pop(nodeid, None)
        self.done += 1

    def pytest_runtest_logreport(self, report):
        self.seconds[report.nodeid.split("::")[0]] += report.duration

    def pytest_terminal_summary(self, terminalreporter):
        terminalreporter.write_line(f"the {SLOWEST} files that took longest, of {self.seconds.total():.0f} s:")
        for file, seconds in self.seconds.most_common(SLOWEST):
            terminalreporter.write_line(f"{seconds:7.0f} s {file}")

    @pytest.hookimpl(tryfirst=True)
    def pytest_report_teststatus(self, report):
        # no letters: the lines have the count; failures and skips are listed at the end as ever
        if report.passed and report.when == "call" and not hasattr(report, "wasxfail"):
            return "passed", "", ""
        if report.skipped and not hasattr(report, "wasxfail"):
            return "skipped", "", ""
        return None

    def pytest_sessionfinish(self):
        self.over.set()

    def _watch(self):
        while not self.over.wait(QUIET):
            self.config.pluginmanager.get_plugin("terminalreporter").write_line(self._where(), flush=True)

    def _where(self) -> str:
        seconds = f"{time.monotonic() - self.begin:.0f} s"
        if not self.total:
            return f"Python tests: collecting, {seconds}"
        files = ", ".join(sorted(set(self.running.copy().values())))
        return f"Python tests: {self.done} of {self.total}, {100 * self.done // self.total} %, {seconds}, in {files}"


def register(config) -> None:
    """Starts the lines where they are asked for, in the process that prints."""
    if config.getoption("--lines") and not hasattr(config, "workerinput"):
        config.pluginmanager.register(ProgressLines(config))
