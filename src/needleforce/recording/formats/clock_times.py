# SPDX-License-Identifier: Apache-2.0
"""Times of a clock or a calendar as seconds from the first, and time stamps in two columns, whole seconds and the rest
of each, as one column."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ...errors import InputError
from ..quantities import RECOGNISED, plain_name
from ..table import Table, TimeStamp

_SECONDS = ("sec", "secs", "seconds")
# last word of the name of the rest -> parts of a second
_RESTS = {
    "nanosec": 1e9, "nanosecs": 1e9, "nanoseconds": 1e9, "nsec": 1e9, "nsecs": 1e9,
    "usec": 1e6, "usecs": 1e6, "microsec": 1e6, "microseconds": 1e6,
}  # fmt: skip
_DAY_S = 86400.0
_WITHOUT_DATE = re.compile(r"\d{1,3}:\d\d(:\d\d)?([.,]\d+)?")


def seconds_of(texts: np.ndarray, place: str) -> np.ndarray:
    """Seconds from the first of (n,) times, NaN where there is none.

    Taken are ISO 8601, dates with the day first (``29.09.2021 17:38:03``), and times without date as ``h:m:s`` or
    ``m:s.f``; these may pass midnight. Raises InputError for others.
    """
    import pandas

    given = pandas.Series(texts, dtype="object").str.strip().str.replace(",", ".", regex=False)
    present = given.notna().to_numpy()
    if not present.any():
        return np.full(len(given), np.nan)
    first = given[present].iloc[0]
    try:
        found = _of_clock(given) if _WITHOUT_DATE.fullmatch(first) else _of_calendar(given, first)
    except (ValueError, OverflowError):
        limit, step = "times such as 17:38:03.5 or 2021-09-29 17:38:03 are read", "Write the times in seconds."
        raise InputError("time", repr(str(first)[:40]), limit, place, step) from None
    return found - found[present][0]


def _of_clock(given: "pandas.Series") -> np.ndarray:  # noqa: F821
    """Seconds of ``h:m:s`` or ``m:s.f``, with a day for every passage of midnight."""
    import pandas

    short = given.str.count(":") == 1
    seconds = pandas.to_timedelta(given.where(~short, "0:" + given)).dt.total_seconds().to_numpy()
    steps = np.diff(seconds, prepend=seconds[:1])
    return seconds + _DAY_S * np.cumsum(np.nan_to_num(steps) < -0.5 * _DAY_S)


def _of_calendar(given: "pandas.Series", first: str) -> np.ndarray:  # noqa: F821
    import pandas

    if re.match(r"\d{4}-", first):
        found = pandas.to_datetime(given, format="ISO8601", utc=True)
    else:
        found = pandas.to_datetime(given, dayfirst="." in first.split(" ")[0], utc=True, format="mixed")
    return (found - found[found.first_valid_index()]).dt.total_seconds().to_numpy()


def join_stamps(table: Table) -> Table:
    """The table with its first pair of columns such as ``header.stamp.sec`` and ``header.stamp.nanosec`` as one time;
    the table itself without such a pair, or if the second one has other values than parts of a second."""
    for stamp in _pairs(table.headers):
        if _are_parts(table, stamp):
            headers, units = list(table.headers), list(table.units) or [""] * len(table.headers)
            name = headers[stamp.whole]
            prefix = name[: -len(plain_name(name).rsplit("_", 1)[-1])].rstrip("._-/ ")
            is_time = any(each(prefix) == "time" for each in RECOGNISED.values())
            headers[stamp.whole], units[stamp.whole] = prefix if is_time else f"{prefix} stamp".strip(), "s"
            if table.lines is not None:
                table.lines.headers = headers  # its errors name them, too
            return replace(table, headers=headers, units=units, stamp=stamp)
    return table


def _pairs(headers: Sequence[str]) -> Iterator[TimeStamp]:
    """The columns of whole seconds with those of the rest, whose names begin alike."""
    words = [plain_name(header).rsplit("_", 1) for header in headers]
    names = [(parts[0] if len(parts) > 1 else "", parts[-1]) for parts in words]
    for rest, (prefix, last) in enumerate(names):
        if last in _RESTS:
            whole = (k for k, name in enumerate(names) if name[0] == prefix and name[1] in _SECONDS)
            yield from (TimeStamp(k, rest, _RESTS[last]) for k in whole)


def _are_parts(table: Table, stamp: TimeStamp) -> bool:
    """Whether a column holds parts of a second, and not the same time in another unit."""
    if table.is_large:
        return True
    values = table.readable(stamp.rest)
    values = values[np.isfinite(values)]
    return bool(len(values) and values.min() >= 0.0 and values.max() < stamp.per_second)
