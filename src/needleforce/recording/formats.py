# SPDX-License-Identifier: Apache-2.0
"""Detection of a file's format by its first bytes, independent of its name."""

from pathlib import Path

MCAP = b"\x89MCAP0\r\n"  # https://mcap.dev/spec
BAG = "metadata.yaml"  # in the folder of a ROS 2 bag
_MAGIC = {MCAP: "log", b"PAR1": "parquet"}


def format_of(path: Path) -> str:
    """``log`` for MCAP and for the folder of a ROS 2 bag, ``parquet``, otherwise ``text``.

    A file that cannot be read counts as ``text``; the text reader then reports the reason.
    """
    try:
        if (path / BAG).is_file():
            return "log"
        if not path.is_file():  # opening a pipe would block
            return "text"
        with open(path, "rb") as file:
            start = file.read(8)
    except (OSError, ValueError):
        return "text"
    return next((name for magic, name in _MAGIC.items() if start.startswith(magic)), "text")
