# SPDX-License-Identifier: Apache-2.0
"""The command ``needleforce`` in a process of its own, without importing the package each time.

``run("identify", path)`` starts it in a copy of a process that has everything imported: arguments, streams, folder,
exit code and tracebacks are those of the command that a user starts, in a quarter of the time.
"""

import atexit
import json
import os
import select
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

HANGS_S = 600.0  # after which a command is taken to hang
_SERVE = """
import atexit, gc, json, os, sys, traceback
import matplotlib.figure, pandas, scipy.optimize, typer.testing
import needleforce.cli, needleforce.identification.report.page
sys.argv[0] = "-c"
gc.freeze()
while line := sys.stdin.readline():
    asked = json.loads(line)
    child = os.fork()
    if not child:
        break
    status = os.waitpid(child, 0)[1]
    print(os.waitstatus_to_exitcode(status), flush=True)
else:
    os._exit(0)
os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
os.dup2(os.open(asked["out"], os.O_WRONLY), 1)
os.dup2(os.open(asked["err"], os.O_WRONLY), 2)
sys.stdin = open(0)
os.chdir(asked["folder"])
sys.argv[1:] = asked["arguments"]
code = 1
try:
    needleforce.cli.main()
    code = 0
except SystemExit as ended:
    code = ended.code or 0
except BaseException:
    traceback.print_exc()
atexit._run_exitfuncs()
sys.stdout.flush()
sys.stderr.flush()
os._exit(code)
"""


class Done(NamedTuple):
    """How a command ended."""

    returncode: int
    stdout: str
    stderr: str


class _Server:
    """The process that has everything imported, started by the first command."""

    def __init__(self):
        self._process = None

    def run(self, arguments: list[str], folder: Path) -> Done:
        with tempfile.TemporaryDirectory() as place:
            out, err = Path(place, "out"), Path(place, "err")
            out.touch(), err.touch()
            asked = {"arguments": arguments, "folder": str(folder), "out": str(out), "err": str(err)}
            code = self._ask(json.dumps(asked), arguments)
            return Done(code, *(each.read_text(encoding="utf-8", errors="surrogateescape") for each in (out, err)))

    def _ask(self, line: str, arguments: list[str]) -> int:
        if self._process is None:
            self._process = subprocess.Popen(
                [sys.executable, "-c", _SERVE], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
            )
            atexit.register(self.close)
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()
        answered = select.select([self._process.stdout], [], [], HANGS_S)[0]
        answer = self._process.stdout.readline() if answered else ""
        if not answer:
            self.close()
            raise AssertionError(f"needleforce {arguments} hangs, or ended the process that started it")
        return int(answer)

    def close(self) -> None:
        process, self._process = self._process, None
        if process:
            process.kill()
            process.communicate()


_server = _Server()


def run(*arguments, cwd: str | os.PathLike | None = None) -> Done:
    """Run ``needleforce`` with these arguments."""
    return _server.run([os.fsdecode(each) if isinstance(each, bytes) else str(each) for each in arguments],
                       Path(os.fsdecode(cwd)) if cwd else Path.cwd())  # fmt: skip
