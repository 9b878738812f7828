# SPDX-License-Identifier: Apache-2.0
"""A small table as CSV, never half-written."""

import os
from pathlib import Path

import numpy as np

from ..errors import InputError


def write_table(path: Path, columns: dict[str, np.ndarray], digits: int = 7) -> Path:
    """Write (n,) columns under their headers with so many significant digits; the same bytes for the same numbers."""
    rows = [",".join(f"{value:.{digits}g}" for value in row) for row in zip(*columns.values(), strict=True)]
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.write_text("\n".join([",".join(columns), *rows, ""]), encoding="utf-8", newline="\n")
        os.replace(part, path)
    except OSError as error:
        raise InputError("file", "not written", error.strerror or "", str(path), "Check the folder.") from None
    finally:
        part.unlink(missing_ok=True)
    return path
