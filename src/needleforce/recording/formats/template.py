# SPDX-License-Identifier: Apache-2.0
"""A template of a format: copy this file, fill in its two places, and add a row to ``FORMATS`` in detect.py::

    Format(
        module="",  # the name of the copy, such as ".needle_log"
        name="",  # as messages call it
        suffixes=(),  # the usual endings of its files
        starts=(),  # its first bytes, or `member` or `matches` in place of them
        limited=True,  # False for one that is read by Python and numpy alone
        package="",  # that reads it, and the extra in pyproject.toml that has it
        extra="",
    ),

tests/house/test_new_format.py does so, and reads a file.
"""

from pathlib import Path
from typing import BinaryIO

import numpy as np

from ...files import open_regular
from ..table import Table
from .arrays import FileArrays, reading, vector

_FORMAT = ""  # 1. what messages call it, such as "a Nanosurf file (nid)"


def tables(path: Path) -> list[Table]:
    """The tables of a file. Raises InputError for a damaged one."""
    found = FileArrays(path=path, format=_FORMAT, header=lambda name, column: f"{name}[:,{column}]")
    with reading(path, _FORMAT), open_regular(path) as file:  # any exception of a library becomes an InputError
        columns = _columns(file)
    found.add("", [vector(header, values, unit) for header, (values, unit) in columns.items()])
    return found.finish()


def _columns(file: BinaryIO) -> dict[str, tuple[np.ndarray, str]]:
    """The columns of an open file: header -> values (n,) and unit."""
    return {}  # 2. import a library here, as most files are of another format; bound each number that the file states
