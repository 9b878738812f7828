# SPDX-License-Identifier: Apache-2.0
"""Which format a file has, by its first bytes, whatever it is called."""

from pathlib import Path

MCAP = b"\x89MCAP0\r\n"  # https://mcap.dev/spec
BAG = "metadata.yaml"  # in the folder of a ROS 2 bag
_MAGIC = {MCAP: "log", b"PAR1": "parquet"}


def format_of(path: Path) -> str:
    """``log`` for MCAP and for the folder of a ROS 2 bag, ``parquet``, else ``text``, which then says what is wrong."""
    try:
        if (path / BAG).is_file():
            return "log"
        if not path.is_file():  # a pipe would keep its reader waiting
            return "text"
        with open(path, "rb") as file:
            start = file.read(8)
    except (OSError, ValueError):
        return "text"
    return next((name for magic, name in _MAGIC.items() if start.startswith(magic)), "text")
