# SPDX-License-Identifier: Apache-2.0
"""The used columns of a table: missing values, two streams in alternating rows, and the order of the time stamps, their
repetitions, gaps and jitter; and samples reduced to a lower rate."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from ..errors import InputError
from ..files import MAX_SAMPLES
from .recording import COLUMNS, Card, Note, Recording
from .roles import Column
from .table import Table

MAX_MISSING_SHARE = 0.01  # share of rows with a missing value that may be left out, with a note


MOTION = ("depth", "velocity")
_MAX_SHARED_SHARE = 0.5  # of the smaller stream's rows: more rows with both mean one stream with missing values
_GAP_STEPS = 3.0  # median steps: a longer step is a gap
UNEVEN_SHARE = 0.1  # of the median step: a step that differs by more is uneven
_MIN_JITTER_SHARE = 0.01  # of all steps: with more uneven ones a note on jitter is made
_MIN_RATIO = 2.0  # of the rates: with less there is nothing to filter
_MIN_WEIGHT = 0.75  # of a sample within the recording: one with less is at an end, or at a gap, and not in its middle
_RATES = 1e-3, 1e6  # [Hz]


@dataclass(kw_only=True)
class Samples:
    """The used columns of a table as (n,) float64 arrays in the file's units; ``rows`` are their row numbers in the
    table, None if no row was left out."""

    table: Table
    columns: dict[str, Column]
    values: dict[str, np.ndarray]
    notes: list[Note] = field(default_factory=list)
    rows: np.ndarray | None = None
    sha256: str = ""

    def place(self, row: int) -> str:
        """The place of a row of ``values`` in the file."""
        return self.table.place(row if self.rows is None else int(self.rows[row]))

    def keep(self, mask: np.ndarray) -> None:
        """Keep the rows where ``mask`` is True."""
        self.rows = np.flatnonzero(mask) if self.rows is None else self.rows[mask]
        self.values = {quantity: values[mask] for quantity, values in self.values.items()}

    def part(self, quantities: list[str], mask: np.ndarray) -> "Samples":
        """Some quantities, where ``mask`` is True, without the notes."""
        columns = {quantity: self.columns[quantity] for quantity in quantities}
        values = {quantity: self.values[quantity] for quantity in quantities}
        part = Samples(table=self.table, columns=columns, values=values, sha256=self.sha256)
        part.keep(mask)
        return part


def load(table: Table, columns: dict[str, Column]) -> tuple[Samples, bool, bool]:
    """Read the columns: the samples, whether no value is missing, and whether the last line is truncated.

    Rows at the end without any value are no rows. Raises InputError for text and for a wrong number of cells.
    """
    indices = [column.index for column in columns.values()]
    try:
        found, all_cells = table.read(indices)
        values = dict(zip(columns, found))
        complete = all_cells and all(map(_finite, values.values()))
        if not complete:
            values = _without_blank_end(values)
            complete = all_cells and all(map(_finite, values.values()))
        cut_off = not complete and table.is_cut_off(indices)
        samples = Samples(table=table, columns=columns, values=values, sha256=table.digest(), notes=list(table.notes))
    except InputError as error:
        raise _of_quantity(error, columns) from None
    return samples, complete, cut_off


def _of_quantity(error: InputError, columns: Mapping[str, Column]) -> InputError:
    """The error of a column with the name of its quantity."""
    named = (q for q, column in columns.items() if error.quantity == f"column {column.header!r}")
    quantity = next(named, "")
    if not quantity:
        return error
    return InputError(f"{quantity} ({error.quantity})", error.value, error.limit, error.place, error.next_step)


def _without_blank_end(values: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The columns up to the last row in which any has a value."""
    present = np.any([~np.isnan(each) for each in values.values()], axis=0)
    stop = int(np.flatnonzero(present)[-1]) + 1 if present.any() else 0
    return {quantity: each[:stop] for quantity, each in values.items()}


def _finite(values: np.ndarray) -> bool:
    """Whether all of (n,) values are finite; a finite sum proves it faster than a test of each value."""
    with np.errstate(all="ignore"):
        return bool(np.isfinite(values.sum()) or np.isfinite(values).all())


def split_motion(samples: Samples, cut_off: bool) -> Samples | None:
    """Split samples of two interleaved streams: return the rows of the motion and keep those of the force.

    Returns None, and leaves them unchanged, if they contain one stream. They contain two streams if at least two
    rows have only force, at least two have only motion, and the rows with both are at most half of the smaller stream.
    A row with both, where two time stamps coincide, belongs to each. Raises InputError if more than 1 % of the rows
    have neither.
    """
    moving = [quantity for quantity in MOTION if quantity in samples.values]
    if not moving or "force" not in samples.values:
        return None
    force = _present(samples, ["force"], cut_off)
    motion = _present(samples, moving, cut_off)
    both = np.count_nonzero(force & motion)
    counts = int(np.count_nonzero(force)), int(np.count_nonzero(motion))
    if min(counts) - both < 2 or both > _MAX_SHARED_SHARE * min(counts):
        return None
    _check_third_stream(samples, force | motion, cut_off)
    message = f"rows of force ({counts[0]}) and of motion ({counts[1]}) alternate in this file, each with its own times"
    notes = [Note("interleaved", message + "; depth is interpolated onto the force's times", counts[1])]
    notes += [Note("cut_off", "the last line is truncated and is left out")] if cut_off else []
    other = samples.part(["time", *moving], motion)
    own = samples.part([quantity for quantity in samples.values if quantity not in moving], force)
    samples.columns, samples.values, samples.rows = own.columns, own.values, own.rows
    samples.notes += notes
    return other


def _present(samples: Samples, quantities: list[str], cut_off: bool) -> np.ndarray:
    found = ~np.all([np.isnan(samples.values[quantity]) for quantity in quantities], axis=0)
    found[len(found) - cut_off :] = False
    return found


def _check_third_stream(samples: Samples, known: np.ndarray, cut_off: bool) -> None:
    rows = np.flatnonzero(~known[: len(known) - cut_off])
    if len(rows) > MAX_MISSING_SHARE * len(known):
        limit = f"of {len(known)} rows, at most 1 % may have neither; the others belong to two streams"
        step = "Remove the rows of the third stream, or save each stream in its own file and give the motion file with "
        step += "--motion."
        raise InputError("rows with neither force nor motion", len(rows), limit, samples.place(int(rows[0])), step)
    if len(rows):
        first = samples.place(int(rows[0]))
        message = f"{len(rows)} rows have neither force nor motion and are left out; the first is {first}"
        samples.notes.append(Note("missing", message, len(rows)))


def drop_incomplete(samples: Samples, required: tuple[str, ...], cut_off: bool) -> None:
    """Leave out rows with missing values, with a note, if they are at most 1 % or a truncated last line.

    A column that is not ``required`` and misses more values is left out itself. Raises InputError for infinite values
    and for a required column with more missing values.
    """
    for quantity, values in samples.values.items():
        infinite = np.flatnonzero(np.isinf(values))
        if len(infinite):
            raise _not_finite(samples, quantity, infinite, "infinite")
    for quantity in list(samples.values):
        _drop_column_if_incomplete(samples, quantity, quantity in required, cut_off)
    complete = ~np.any([np.isnan(values) for values in samples.values.values()], axis=0)
    if cut_off:
        complete[-1] = False  # also where the truncated cell is the last that is used
        samples.notes.append(Note("cut_off", "the last line is truncated and is left out"))
    lost = int(np.count_nonzero(~complete)) - cut_off
    if lost:
        first = samples.place(int(np.argmin(complete)))
        message = f"{lost} of {len(complete)} rows have a missing value and are left out; the first is {first}"
        samples.notes.append(Note("missing", message, lost))
    if not complete.all():
        samples.keep(complete)


def _drop_column_if_incomplete(samples: Samples, quantity: str, required: bool, cut_off: bool) -> None:
    """Raise InputError for a required column with too many missing values; leave out another one, with a note."""
    gaps = np.flatnonzero(np.isnan(samples.values[quantity]))
    count = len(gaps) - bool(cut_off and len(gaps) and gaps[-1] == len(samples.values[quantity]) - 1)
    if count <= MAX_MISSING_SHARE * len(samples.values[quantity]):
        return
    if required:
        raise _not_finite(samples, quantity, gaps, "missing or not a number")
    samples.notes.append(Note("left_out", f"{quantity} has {count} missing values: the column is left out", count))
    del samples.values[quantity]


def _not_finite(samples: Samples, quantity: str, rows: np.ndarray, what: str) -> InputError:
    total = len(samples.values[quantity])
    advice = "Remove these lines, or record again."
    if 0.2 * total < len(rows) < total:
        advice = "If this column has a slower clock than the others, save it in its own file and give it with --motion."
    header = samples.columns[quantity].header
    limit = f"{len(rows)} of {total} rows, at most 1 % may be missing" if what[0] == "m" else f"in {len(rows)} rows"
    return InputError(f"{quantity} (column {header!r})", what, limit, samples.place(int(rows[0])), advice)


def put_in_order(samples: Samples) -> None:
    """Average rows with equal time stamps into one, with a note; the unit of time need not be known.

    Raises InputError if time decreases, with the line and both values.
    """
    steps = np.diff(samples.values["time"])
    if len(steps) and steps.min() <= 0.0:
        _check_not_decreasing(samples, steps)
        _merge(samples, steps)


def check_count(samples: Samples) -> None:
    """Raise InputError for fewer than two samples."""
    count = len(next(iter(samples.values.values())))
    if count < 2:
        step = "Check that the recording is complete, that its columns hold values, and that its time increases."
        raise InputError("number of samples", count, "at least 2 are needed", str(samples.table.path), step)


def timing_notes(time: np.ndarray) -> list[Note]:
    """Notes on gaps (steps longer than three medians) and jitter of a strictly increasing time (n,) [s]."""
    steps = np.diff(time)
    if steps.max() <= (1.0 + UNEVEN_SHARE) * steps.min():  # then no step is far from the median
        return []
    median = float(np.median(steps))
    notes = []
    if steps.max() > _GAP_STEPS * median:
        gaps, at = int(np.count_nonzero(steps > _GAP_STEPS * median)), int(np.argmax(steps))
        notes.append(
            Note(
                "gap",
                f"{gaps} gaps, the longest of {steps[at] * 1e3:.4g} ms at {time[at]:.6g} s; "
                f"the median step is {median * 1e3:.4g} ms",
                gaps,
            )
        )
    uneven = int(np.count_nonzero(np.abs(steps - median) > UNEVEN_SHARE * median))
    if uneven > _MIN_JITTER_SHARE * len(steps):
        low, high = np.percentile(steps, [5, 95]) * 1e3
        notes.append(
            Note(
                "jitter",
                f"{uneven} of {len(steps)} steps differ from their median of {median * 1e3:.4g} ms "
                f"by over 10 %; 90 % lie between {low:.4g} and {high:.4g} ms",
                uneven,
            )
        )
    return notes


def _check_not_decreasing(samples: Samples, steps: np.ndarray) -> None:
    decreases = np.flatnonzero(steps < 0.0)
    if len(decreases):
        row = int(decreases[0]) + 1
        before, after = samples.values["time"][row - 1], samples.values["time"][row]
        value = f"{after:.10g} after {before:.10g}"
        step = f"It decreases {len(decreases)} times. Sort the lines, or save each run in its own file."
        raise InputError("time", value, "it must not decrease", samples.place(row), step)


def _merge(samples: Samples, steps: np.ndarray) -> None:
    starts = np.flatnonzero(np.concatenate([[True], steps > 0.0]))
    sizes = np.diff(np.append(starts, len(steps) + 1))
    time = samples.values["time"][starts]  # not averaged: an average of equal stamps could differ by an ulp
    samples.values = {q: np.add.reduceat(values, starts) / sizes for q, values in samples.values.items()} | {
        "time": time
    }
    samples.rows = starts if samples.rows is None else samples.rows[starts]
    count = int(np.count_nonzero(steps == 0.0))
    samples.notes.append(Note("repeated_time", f"{count} samples repeat a time stamp and are averaged", count))


class Decimated:
    """Samples at ``rate`` [Hz], to which blocks of others are added in any order of time.

    Each sample is the mean of those around it, weighted by a triangle of two of the new steps to each of its sides but
    one: w = 1 - |t| rate. It is the mean over a step taken twice: its response is sinc²(f / rate), so it has no delay,
    no overshoot at a fall of the force, and the noise of n samples a step falls by sqrt(3 n / 2). Time is averaged as
    the other quantities, so that losses and uneven steps shift nothing.
    """

    def __init__(self, rate: float):
        if not _RATES[0] <= rate <= _RATES[1]:
            limit = f"outside {_RATES[0]:g} to {_RATES[1]:g} Hz"
            raise InputError("rate to decimate to", f"{rate:g} Hz", limit, next_step="Give it with --decimate-to-hz.")
        self._rate, self._origin, self._ratio, self.count = rate, 0.0, 1.0, 0
        self._names: tuple[str, ...] = ()
        self._sums = np.zeros((0, 0))

    def add(self, values: Mapping[str, np.ndarray]) -> None:
        """Add samples (n,) of quantities, of which one is the time [s]; the first ones are the earliest."""
        time = values["time"]
        if not self.count:
            self._names, self._origin = tuple(values), float(time[0])
            self._sums = np.zeros((1 + len(values), 0))
        self.count += len(time)
        place = np.maximum(time - self._origin, 0.0) * self._rate
        whole = place.astype(np.int64)
        share, first, end = place - whole, int(whole.min()), int(whole.max()) + 2
        self._reserve(end)
        for weight, offset in ((1.0 - share, 0), (share, 1)):
            for row, name in zip(self._sums, ("", *self._names)):
                terms = weight * values[name] if name else weight
                row[first:end] += np.bincount(whole - first + offset, terms, end - first)

    def _reserve(self, count: int) -> None:
        if count > MAX_SAMPLES:
            limit = f"more than {MAX_SAMPLES} samples"
            raise InputError("rate to decimate to", f"{self._rate:g} Hz", limit, next_step="Give a lower one.")
        if count > self._sums.shape[1]:
            more = min(max(count, 2 * self._sums.shape[1]), MAX_SAMPLES) - self._sums.shape[1]
            self._sums = np.pad(self._sums, ((0, 0), (0, more)))

    def values(self) -> dict[str, np.ndarray]:
        """The new samples of each quantity. Raises InputError for a rate that is not lower."""
        weight = self._sums[0]
        usual = float(np.median(weight[weight > 0.0]))
        if usual < _MIN_RATIO:
            limit = f"at most half the rate of the recording, which is about {usual * self._rate:.4g} Hz"
            raise InputError("rate to decimate to", f"{self._rate:g} Hz", limit, next_step="Give a lower one.")
        kept = weight >= _MIN_WEIGHT * usual
        self._ratio = usual
        return {name: row[kept] / weight[kept] for name, row in zip(self._names, self._sums[1:])}

    def card(self, card: Card) -> Card:
        """The card of the recording that was reduced, with a filter length of the same delay."""
        sentence = (
            f"{self.count} samples are reduced to {self._rate:g} a second: each is the mean over {self._ratio:.4g}, "
            "taken twice, without delay"
        )
        length = 1 + round((card.filter_length - 1) / self._ratio)
        return replace(card, filter_length=length, assumptions=(*card.assumptions, sentence))


def decimated(recording: Recording, rate: float) -> Recording:
    """A recording at a lower rate [Hz]; its card states how it was reduced. Raises InputError for a rate that is not
    lower."""
    reduced = Decimated(rate)
    reduced.add({name: getattr(recording, name) for name in COLUMNS} | recording.axes)
    values = reduced.values()
    main = {name: values.pop(name) for name in COLUMNS}
    return replace(recording, **main, axes=values, card=reduced.card(recording.card))
