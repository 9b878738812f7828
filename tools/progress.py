#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs a command and prints a line at least every five seconds: what it has done, of how much, and for how long.

    progress.py NAME [--show | --keep PATTERN] -- COMMAND ...

The command's own output is printed if the command fails; with --show always, as it comes; with --keep its lines that
match PATTERN, at the end. Where the output shows that the disk is full or the network does not answer, the last line says
what to do. The exit code is the command's.
"""

import argparse
import re
import subprocess
import sys
import threading
import time
from pathlib import Path

QUIET, APART = 5.0, 2.0  # [s] longest silence; shortest time between two lines of the same job
COUNTED = re.compile(r"^\s*\[?(\d+)/(\d+)\]? (?:Test +#\d+: )?(.*)")  # ninja and ctest
FETCHED = re.compile(r"^\s*Downloading (\S+) \((.*)\)")
SHARE = re.compile(r"^(\w+ \w+)\.\.\. \[ *(\d+)%\] (\S+)")  # sphinx
CAUSES = {  # words of compilers and of pip, which end with a conflict of versions where there is only no network
    r"No space left on device|Errno 28": "The disk is full: make room",
    r"NewConnectionError|NameResolutionError|ConnectTimeoutError|ReadTimeoutError|ProxyError|SSLError": (
        "The network does not answer: look at it, or set HTTPS_PROXY"
    ),
}
INSTALLED = re.compile(r"^Installing collected packages: (.*)")


class Job:
    """A running command: its output so far, and a few words on where it is."""

    def __init__(self, name: str):
        self.name, self.output, self.words = name, [], "running"
        self.begin = self.printed = time.monotonic()
        self.packages = None

    def read(self, line: str) -> bool:
        """Keeps a line of the output; true if it says where the command is."""
        self.output.append(line)
        if match := COUNTED.match(line):
            self.words = f"{match[1]} of {match[2]}, {_what(match[3])}"
        elif match := FETCHED.match(line):
            self.words = f"downloading {'-'.join(match[1].split('-')[:2])}, {match[2]}"
        elif match := SHARE.match(line):
            self.words = f"{match[1]}, {match[2]} %, {match[3]}"
        elif match := INSTALLED.match(line):
            self.packages, self.before = match[1].split(", "), _installed()
        return bool(match)

    def tell(self) -> None:
        """Prints where the command is."""
        now = time.monotonic()
        if self.packages:
            self.words = f"{min(_installed() - self.before, len(self.packages))} of {len(self.packages)} installed"
        print(f"{self.name}: {self.words}, {now - self.begin:.0f} s", flush=True)
        self.printed = now


def _what(text: str) -> str:
    """A file instead of a build system's path to its object."""
    words = text.split()
    return Path(words[-1]).name.removesuffix(".o") if text.startswith(("Building", "Linking")) else words[0]


def _installed() -> int:
    """How many packages are in the virtual environment."""
    return sum(1 for _ in Path(".venv").glob("lib/python*/site-packages/*.dist-info"))


def _watch(job: Job, over: threading.Event) -> None:
    while not over.wait(0.5):
        if time.monotonic() - job.printed >= QUIET:
            job.tell()


def main() -> int:
    """Runs the command of the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("name")
    parser.add_argument("--show", action="store_true")
    parser.add_argument("--keep", default="(?!)")  # no line, not even an empty one
    parser.add_argument("command", nargs="+")
    options = parser.parse_args()
    job, over = Job(options.name), threading.Event()
    threading.Thread(target=_watch, args=(job, over), daemon=True).start()
    process = subprocess.Popen(
        options.command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace"
    )
    for line in process.stdout:
        counted = job.read(line)
        if options.show:
            print(line, end="", flush=True)
            job.printed = time.monotonic()
        elif counted and time.monotonic() - job.printed >= APART:
            job.tell()
    code = process.wait()
    over.set()
    if code and not options.show:
        sys.stdout.writelines(job.output)
    sys.stdout.writelines(line for line in job.output if re.search(options.keep, line))
    print(f"{job.name}: {'done' if code == 0 else 'failed'} after {time.monotonic() - job.begin:.0f} s", flush=True)
    if cause := next(
        (words for pattern, words in CAUSES.items() if code and re.search(pattern, "".join(job.output))), ""
    ):
        print(f"{cause}. Then give the command again: it goes on.")
    return code


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
