# SPDX-License-Identifier: Apache-2.0
"""Times of a clock or a calendar as seconds from the first."""

import re

import numpy as np

from ...errors import InputError

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
