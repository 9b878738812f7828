# SPDX-License-Identifier: Apache-2.0
"""Time stamps in two columns, whole seconds and the rest of each, as one column of time."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...errors import InputError
from ..columns import Column
from ..quantities import RECOGNISED, plain_name

_REST = "rest of the stamp"  # in place of a quantity
_SECONDS = ("sec", "secs", "seconds")
# last word of the name of the rest -> parts of a second
_RESTS = {
    "nanosec": 1e9, "nanosecs": 1e9, "nanoseconds": 1e9, "nsec": 1e9, "nsecs": 1e9,
    "usec": 1e6, "usecs": 1e6, "microsec": 1e6, "microseconds": 1e6,
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class WithStamps:
    """A table whose column ``whole`` has seconds and the column ``rest`` what to add, of which ``per_second`` are a
    second; with the interface of ``FileTable``."""

    table: Any
    whole: int
    rest: int
    per_second: float

    def __getattr__(self, name: str) -> Any:
        return getattr(self.table, name)

    @cached_property
    def headers(self) -> list[str]:
        """The headers: that of the seconds is a time."""
        name = self.table.headers[self.whole]
        prefix = name[: -len(plain_name(name).rsplit("_", 1)[-1])].rstrip("._-/ ")
        name = prefix if any(each(prefix) == "time" for each in RECOGNISED) else f"{prefix} stamp".strip()
        return [name if k == self.whole else header for k, header in enumerate(self.table.headers)]

    @cached_property
    def units(self) -> list[str]:
        """The units, seconds for the stamps."""
        units = list(self.table.units) or [""] * len(self.table.headers)
        return ["s" if k == self.whole else unit for k, unit in enumerate(units)]

    def numbers(self, columns: Mapping[str, Column]) -> tuple[dict[str, np.ndarray], str, bool]:
        """As ``FileTable.numbers``, with the parts of a second added to the stamps."""
        of_stamps = [q for q, column in columns.items() if column.index == self.whole]
        if not of_stamps:
            return self.table.numbers(columns)
        rest = Column(_REST, self.table.headers[self.rest], self.rest, None)
        values, sha256, complete = self.table.numbers({**columns, _REST: rest})
        parts = values.pop(_REST) / self.per_second
        return values | {q: values[q] + parts for q in of_stamps}, sha256, complete

    def from_row(self, number: int) -> "WithStamps | None":
        """As ``FileTable.from_row``."""
        found = self.table.from_row(number)
        return None if found is None else replace(self, table=found)


def with_stamps(table: Any) -> Any:
    """The table with its first pair of columns such as ``header.stamp.sec`` and ``header.stamp.nanosec`` as one time;
    the table itself without such a pair, or if the second one has other values than parts of a second."""
    for whole, rest, per_second in _pairs(table.headers):
        if _are_parts(table, rest, per_second):
            return WithStamps(table, whole, rest, per_second)
    return table


def _pairs(headers: Sequence[str]) -> Iterator[tuple[int, int, float]]:
    """The columns of whole seconds with those of the rest, whose names begin alike."""
    words = [plain_name(header).rsplit("_", 1) for header in headers]
    names = [(parts[0] if len(parts) > 1 else "", parts[-1]) for parts in words]
    for rest, (prefix, last) in enumerate(names):
        if last in _RESTS:
            whole = (k for k, name in enumerate(names) if name[0] == prefix and name[1] in _SECONDS)
            yield from ((k, rest, _RESTS[last]) for k in whole)


def _are_parts(table: Any, index: int, per_second: float) -> bool:
    """Whether a column holds parts of a second, and not the same time in another unit."""
    if getattr(table, "is_large", False):
        return True
    try:
        column = Column(_REST, table.headers[index], index, None)
        values = table.numbers({_REST: column})[0][_REST]
    except InputError:
        return False
    values = values[np.isfinite(values)]
    return bool(len(values) and values.min() >= 0.0 and values.max() < per_second)
