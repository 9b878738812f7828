# SPDX-License-Identifier: Apache-2.0
"""Fields of file names by evidence: what a part of the names means is decided from its values in the whole folder.

A date is a date. A number that agrees with the measured speed of the strokes is the speed. An integer that only counts
within otherwise equal names is the repeat. What is not decided is named ``field_1``, ``field_2`` …
"""

import datetime
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath

import numpy as np

MAX_SPEED_DEVIATION = 0.05  # [share] between a number and the measured speed
MIN_AGREEING_SHARE = 0.9  # of the files: a few may be labelled or recorded wrongly
SPEED_UNITS = {"mm_s": 1e-3, "mm_min": 1e-3 / 60.0, "m_s": 1.0}
_DATE = re.compile(
    r"(?<!\d)(?P<year>(?:19|20)\d\d)(?P<s>[-_.]?)(?P<month>\d\d)(?P=s)(?P<day>\d\d)"
    r"(?:[-_T ]?(?P<hour>[01]\d|2[0-3])[-_.:h]?[0-5]\d(?:[-_.:m]?[0-5]\d)?)?(?!\d)"
)
_SEPARATOR = re.compile(r"[_\s,;=/]+")
_FINE_SEPARATOR = re.compile(r"[_\s,;=/]+|(?<=\w)-(?=\w)")  # used if it cuts every name into as many parts
_NUMBER = re.compile(r"(\D*?)([+-]?\d+(?:\.\d+)?)(\D*)")
MAX_EXAMPLES = 3  # values of an undecided field in the note


@dataclass(frozen=True)
class Parts:
    """The parts of one name, and the separators before each of them (the first is empty)."""

    texts: tuple[str, ...]
    between: tuple[str, ...]

    def last(self, count: int) -> "Parts":
        """The last ``count`` parts; the first of them is all that stands before the others."""
        head = len(self.texts) - count + 1
        first = self.texts[0] + "".join(b + t for b, t in zip(self.between[1:head], self.texts[1:head]))
        return Parts((first, *self.texts[head:]), ("", *self.between[head:]))

    @property
    def tail(self) -> str:
        """The kinds of the numbers (1) and dates (d) after the last word."""
        return re.search(r"[1d]*$", "".join(map(_kind, self.texts)))[0]


def infer_fields(names: Sequence[str], speeds: Mapping[str, float]) -> tuple[dict[str, dict[str, str]], str]:
    """The fields of each name that has the form of most, and a note on what was decided and what was not.

    A speed needs two different values, each of which agrees with the measured speed in one unit: of unrelated numbers,
    spread evenly over a decade on a logarithmic scale, 0.6 % do so with two values (three units for the first, 4 % of
    the decade for each), 0.03 % with three. A repeat is decided if one field alone counts in more than half of the
    files. A numbered property that is counted in the same way, such as a needle with its own number for each of equal
    series, cannot be distinguished by names: then both are undecided.

    Parameters
    ----------
    names : sequence of str
        Files relative to the campaign's folder.
    speeds : mapping
        File -> measured speed of its insertion [m/s], for those that can be read.

    Returns
    -------
    fields : dict
        File -> field -> text; a name of another form is left out.
    note : str
        A sentence for the user; empty without fields.
    """
    parts = _cut(names)
    if len(parts) < 2:
        return {}, ""
    columns = list(zip(*(each.texts for each in parts.values())))
    decided, counting = _decided(columns, [speeds.get(name, np.nan) for name in parts])
    titles = [decided.get(k, f"field_{k + 1}") for k in range(len(columns))]
    fields = {name: dict(zip(titles, each.texts)) for name, each in parts.items()}
    return fields, _note(titles, columns, list(parts.values()), counting)


def _cut(names: Sequence[str]) -> dict[str, Parts]:
    """The names of the most frequent form in equally many parts; the first part may contain separators."""
    fine = {name: _parts(name, _FINE_SEPARATOR) for name in names}
    cut = fine
    if len({len(each.texts) for each in fine.values()}) > 1:
        cut = {name: _parts(name, _SEPARATOR) for name in names}
    tails = Counter(each.tail for each in cut.values())
    tail = max(tails, key=lambda each: (tails[each], len(each)), default="")
    same = {name: each for name, each in cut.items() if each.tail == tail}
    count = min((len(each.texts) for each in same.values()), default=0)
    return {name: each.last(count) for name, each in same.items()} if count > 1 else {}


def _parts(name: str, separator: re.Pattern) -> Parts:
    """A name without its ending, cut at the separators outside dates."""
    path = PurePosixPath(name)
    stem = "/".join((*path.parts[:-1], path.stem))
    dates = [match[0] for match in _DATE.finditer(stem) if _is_date(match)]
    masked = _DATE.sub(lambda match: "\0" if _is_date(match) else match[0], stem)
    between = ["", *separator.findall(masked)]
    texts, known = separator.split(masked), iter(dates)
    return Parts(tuple(re.sub("\0", lambda _: next(known), text) for text in texts), tuple(between))


def _is_date(match: re.Match) -> bool:
    try:
        datetime.date(int(match["year"]), int(match["month"]), int(match["day"]))
    except ValueError:
        return False
    return True


def _kind(text: str) -> str:
    match = _DATE.fullmatch(text)
    if match and _is_date(match):
        return "d"
    return "1" if re.fullmatch(r"[+-]?\d+(\.\d+)?", text) else "w"


def _decided(columns: list[tuple[str, ...]], speeds: list[float]) -> tuple[dict[int, str], list[int]]:
    """Field number -> its name, for those that the values decide; and the numbers of the fields that count, of which
    one alone is the repeat."""
    dates = [k for k, column in enumerate(columns) if all(_kind(text) == "d" for text in column)]
    found = {dates[0]: "date"} if len(dates) == 1 else {}
    rates = [(k, unit) for k, column in enumerate(columns) for unit in _speed_unit(_numbers(column), speeds)]
    found |= {k: f"speed_{unit}" for k, unit in rates} if len(rates) == 1 else {}
    rest = [k for k in range(len(columns)) if k not in dates]
    counting = [k for k in rest if k not in found and _counts(columns, k, rest)]
    return found | ({counting[0]: "repeat"} if len(counting) == 1 else {}), counting


def _numbers(column: Sequence[str]) -> np.ndarray | None:
    """The numbers of a field, whose letters must be the same in all names: 3 in ``rep3``; None if they are not."""
    matches = [_NUMBER.fullmatch(text) for text in column]
    if not all(matches) or len({(match[1], match[3]) for match in matches}) > 1:
        return None
    return np.array([float(match[2]) for match in matches])


def _speed_unit(values: np.ndarray | None, speeds: list[float]) -> list[str]:
    """The units in which a field is the measured speed: two different values or more, each of which agrees."""
    measured = np.array(speeds)
    known = np.isfinite(measured)
    if values is None or len(set(values[known])) < 2:
        return []
    return [unit for unit, factor in SPEED_UNITS.items() if _agrees(factor * values[known], measured[known])]


def _agrees(labelled: np.ndarray, measured: np.ndarray) -> bool:
    close = np.abs(measured - labelled) <= MAX_SPEED_DEVIATION * labelled
    each = [np.mean(close[labelled == value]) > 0.5 for value in set(labelled)]
    return bool(np.mean(close) >= MIN_AGREEING_SHARE and all(each))


def _counts(columns: list[tuple[str, ...]], field: int, rest: list[int]) -> bool:
    """Whether a field counts from 0 or 1 within the names that are equal but for it and the date, in most files; a
    number may be missing, but no more of them than there are."""
    values = _numbers(columns[field])
    if values is None or (values != np.round(values)).any() or values.min() not in (0.0, 1.0):
        return False
    groups: dict[tuple, list[float]] = {}
    for row, value in zip(zip(*(columns[k] for k in rest if k != field)), values, strict=False):
        groups.setdefault(row, []).append(value)
    if len(rest) == 1:
        groups = {(): list(values)}
    several = [group for group in groups.values() if len(group) > 1]
    distinct = all(len(set(group)) == len(group) and np.ptp(group) < 2 * len(group) for group in several)
    return distinct and 2 * sum(map(len, several)) > len(values)


def _note(titles: list[str], columns: list[tuple[str, ...]], parts: list[Parts], counting: list[int]) -> str:
    """What was decided, what was not with examples, and the option that names the fields."""
    known = [title for title in titles if not title.startswith("field_")]
    undecided = [
        f"{title} ({_examples(column)})" for title, column in zip(titles, columns) if title.startswith("field_")
    ]
    between = [Counter(each).most_common(1)[0][0] for each in zip(*(each.between for each in parts))]
    pattern = "".join(f"{separator}{{{title}}}" for separator, title in zip(between, titles))
    text = f"The fields of the file names were decided by their values: {', '.join(known) or 'none'}."
    text += f" Not decided: {', '.join(undecided)}." if undecided else ""
    if len(counting) > 1:
        last = titles[counting[-1]]
        pattern = pattern.replace(f"{{{last}}}", "{repeat}")
        text += f" Several fields count: if {last} is the number of the repeat, give --pattern '{pattern}'."
        return f"{text} The other fields may have your own names in it."
    return f"{text} To name them, give --pattern '{pattern}' with your own names."


def _examples(column: Sequence[str]) -> str:
    values = list(dict.fromkeys(column))
    return ", ".join(values[:MAX_EXAMPLES]) + (" …" if len(values) > MAX_EXAMPLES else "")
