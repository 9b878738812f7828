# SPDX-License-Identifier: Apache-2.0
"""A file that is hashed while it is read: its bytes come from the disk once, and from no two versions of it."""

import hashlib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

_AT_ONCE = 4  # blocks: each change of thread costs


class Hashed:
    """A binary file for pandas, to be used with ``with``; its SHA-256 is computed on another core."""

    def __init__(self, path: Path):
        self._path, self._digest, self._ended = path, hashlib.sha256(), False
        self._waiting: list[bytes] = []

    def __enter__(self):
        self._file = open(self._path, "rb", buffering=0)
        self._beside = ThreadPoolExecutor(1)
        return self

    def __exit__(self, *_):
        self._file.close()
        self._beside.shutdown()

    def __iter__(self):
        return iter(lambda: self.read(1 << 18), b"")

    def read(self, size: int = -1) -> bytes:
        """The next bytes, none at the end."""
        data = self._file.read(size)
        self._waiting += [data] if data else []
        if len(self._waiting) == _AT_ONCE or not data:
            self._beside.submit(self._update, self._waiting)
            self._waiting = []
        self._ended = not data
        return data

    def _update(self, blocks: list[bytes]) -> None:
        for block in blocks:
            self._digest.update(block)

    def sha256(self) -> str:
        """The digest of the whole file, after ``with``; what was not read yet is read now."""
        if self._ended:
            return self._digest.hexdigest()
        with open(self._path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
