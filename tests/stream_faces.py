# SPDX-License-Identifier: Apache-2.0
"""Streams through a program of tests/conformance in each language, and the rows that it writes."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from browser import CHROMIUM, WITHOUT

FACES = ("c++", "c", "python", "wasm", "browser")


class StreamFaces:
    """``program`` is the name of the files."""

    def __init__(self, root: Path, folder: Path, program: str, request) -> None:
        self.root, self.folder, self.program = root, folder, program
        self.request, self.source = request, root / "tests" / "conformance"

    def of(self, streams: dict[str, list[str]], numbers: int) -> Callable[[str], dict]:
        """By face, and in it by stream: numbers, words, and rows of one word. Each face runs once."""
        outputs: dict[str, dict] = {}
        paths = [self.folder / f"{name}.txt" for name in streams]
        for path, lines in zip(paths, streams.values(), strict=True):
            path.write_text("\n".join(lines) + "\n", encoding="utf-8")

        def found(face: str) -> dict:
            if face not in outputs:
                command = [*self._command(face), *paths]
                text = subprocess.run(command, capture_output=True, text=True, check=True).stdout
                rows = (rows_of(part, numbers) for part in text.split("case ")[1:])
                outputs[face] = dict(zip(streams, rows, strict=True))
            return outputs[face]

        return found

    def _command(self, face: str) -> list:
        if face in ("c++", "c"):
            return [self._compiled(face)]
        if face == "python":
            return [sys.executable, self.source / f"{self.program}.py"]
        wasm = self.request.getfixturevalue("wasm")
        if face == "wasm":
            return ["node", self.source / f"{self.program}.mjs", wasm / "needleforce.mjs"]
        if CHROMIUM is None:
            pytest.skip(WITHOUT)
        return [sys.executable, self.source / "in_browser.py", f"{self.program}.mjs", wasm]

    def _compiled(self, face: str) -> Path:
        source, program = self.source / self.program, self.folder / face
        if face == "c++":
            run = ["g++", "-std=c++20", "-O1", f"-I{self.root / 'include'}", source.with_suffix(".cpp")]
        else:
            library = self.request.getfixturevalue("shared_library")
            where = [library, f"-Wl,-rpath={library.parent}"]
            run = ["gcc", "-std=c11", "-Wall", "-Werror", source.with_suffix(".c"), *where]
        subprocess.run([*run, "-o", program], check=True)
        return program


def rows_of(text: str, numbers: int):
    """Of the output for one stream: numbers (n, numbers), the words after them, and the rows of one word."""
    rows = [line.split() for line in text.splitlines()[1:]]
    samples = [row for row in rows if len(row) > numbers]
    values = np.array([row[:numbers] for row in samples], float)
    return values, [row[numbers:] for row in samples], [row for row in rows if len(row) == 1]
