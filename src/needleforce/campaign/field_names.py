# SPDX-License-Identifier: Apache-2.0
"""What a field of a condition may be called."""

import re
from collections.abc import Iterable

from ..errors import InputError

COLUMNS = ("file", "pooled", "status", "quantity", "value", "low", "high", "unit", "identifiable", "outlier", "why")
"""The table's own columns: a field of the same name would hide one."""
REPEATS = ("repeat", "date", "file", "time", "run")
"""Fields in which repeats of one condition differ."""


def check_fields(names: Iterable[str], place: str) -> None:
    """Raises InputError for a field without a proper name, named twice, or named like a column of the table."""
    seen = set()
    for name in names:
        if not re.fullmatch(r"[^\W\d][\w -]*", name):
            raise InputError("field", repr(name), "a name of letters, digits and _ is needed", place)
        if name in COLUMNS:
            raise InputError("field", repr(name), "the table has a column of this name", place, "Name it otherwise.")
        if name in seen:
            raise InputError("field", repr(name), "stands there twice", place, "Give each field its own name.")
        seen.add(name)
