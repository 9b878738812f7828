# SPDX-License-Identifier: Apache-2.0
"""One file as quantities in SI on one clock: columns, values, order and units are processed in this order."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .. import core
from ..errors import InputError
from ..files import file_name
from .assumed_motion import AssumedMotion
from .quantities import dimension
from .recording import COLUMNS, Card, Note, Recording
from .roles import Column, Roles
from .samples import MOTION, UNEVEN_SHARE, Samples, check_count, drop_incomplete, load, put_in_order, split_motion
from .stated import Stated, stated_by
from .table import Table
from .unit_guess import assign_units

_NOISE, _BOTH_SIGNS = 10.0, 0.1  # times the noise, and of the larger change of a force: what a second sign must exceed
_MANY_COLUMNS = 5  # of which each may be a recording
_MAX_MAGNITUDE = 1e30  # of any quantity in any unit: far beyond any instrument
_MIN_STEP_S = 1e-15  # [s]


@dataclass(kw_only=True)
class Stream:
    """The quantities of one file as (n,) arrays in SI, with assumptions and notes; ``place`` is the file.

    Of a table, ``row`` is the place of each sample in it.

    ``motion`` is a second stream of the same file with its own times, which then contains depth or velocity.
    """

    place: str
    sha256: str
    values: dict[str, np.ndarray]
    assumptions: list[str]
    notes: list[Note]
    motion: "Stream | None" = None

    def recording(self, card: Card, notes: Iterable[Note]) -> Recording:
        """The recording of complete quantities; ``notes`` are those of its file, before its own."""
        values = dict(self.values)
        main = {quantity: values.pop(quantity) for quantity in COLUMNS}
        return Recording(**main, axes=values, card=card, notes=tuple(dict.fromkeys([*notes, *self.notes])))


def read_stream(
    table: Table,
    roles: Roles,
    wanted: tuple[str, ...],
    units: Mapping[str, str],
    *,
    default_units: Mapping[str, str] | None = None,
    assumed: AssumedMotion = AssumedMotion(),  # noqa: B008
) -> Stream:
    """Read the ``wanted`` quantities of one file; time, force, and depth or velocity are required if wanted.

    ``units`` are given by the user; ``default_units`` apply to headers without a unit; time and depth may be
    ``assumed``. Raises InputError.
    """
    chosen, stated = roles.chosen(wanted), stated_by(table)
    sentences = [f"the {q} is the column {c.header!r}, {c.reason}" for q, c in chosen.items() if "whose" in c.reason]
    sentences += _put_stated_units(chosen, stated, units)
    notes = _leave_out_torques(chosen, units)
    alone = roles.by_unit(_absent(chosen, wanted, assumed))
    chosen |= alone
    if stated.rate and "time" not in chosen and assumed.rate is None and not assumed.speed:
        assumed = assumed.completed(stated.rate.value, stated.rate.text)
    required = _required(chosen, wanted, roles, assumed, stated)
    samples, complete, cut_off = load(table, chosen)
    samples.notes += notes + _unused(chosen, assumed) + _contradicted_given(assumed, stated)
    other = None if complete else split_motion(samples, cut_off)
    without_unit = [quantity for quantity, column in chosen.items() if column.unit is None]
    units = {q: u for q, u in (default_units or {}).items() if q in without_unit} | dict(units)
    if other is None:
        if not complete:
            drop_incomplete(samples, required, cut_off)
        stream = _in_order_and_si(samples, units, assumed)[0]
        stream.notes += _contradicted_rate(stream, stated) if "time" in chosen else []
        return _assuming(stream, alone, sentences)
    drop_incomplete(other, ("time", required[-1]), cut_off=False)
    motion, time_unit = _in_order_and_si(other, units, assumed)
    drop_incomplete(samples, ("time", "force"), cut_off=False)
    stream = _in_order_and_si(samples, units | {"time": time_unit}, assumed)[0]
    return _assuming(replace(stream, motion=motion), alone, sentences)


def _put_stated_units(chosen: dict[str, Column], stated: Stated, given: Mapping[str, str]) -> list[str]:
    """Give columns without a unit the one that the file states above its table; returns a sentence for each."""
    sentences = []
    for quantity in [q for q in stated.units if q in chosen and chosen[q].unit is None and q not in given]:
        symbol, text = stated.units[quantity]
        chosen[quantity] = replace(chosen[quantity], unit=symbol)
        sentences.append(f"{quantity} is in {symbol}, as the file states: {text!r}")
    return sentences


def _unused(chosen: Mapping[str, Column], assumed: AssumedMotion) -> list[Note]:
    """A note on a rate, speed or step that was given although the file has a time or a motion."""
    message = assumed.unused("time" in chosen, bool(chosen.keys() & set(MOTION)))
    return [Note("unused", message)] if message else []


def _contradicted_rate(stream: Stream, stated: Stated) -> list[Note]:
    """A note if the file states another rate than its time has."""
    step = float(np.median(np.diff(stream.values["time"])))
    if stated.rate is None or abs(step * stated.rate.value - 1.0) <= UNEVEN_SHARE:
        return []
    message = (
        f"the file states {stated.rate.text!r}, but its time has {1.0 / step:.6g} samples a second: the time is used"
    )
    return [Note("contradiction", message)]


def _contradicted_given(assumed: AssumedMotion, stated: Stated) -> list[Note]:
    """A note for a rate or speed that is given although the file states another one."""
    given = {"rate": None if assumed.stated else assumed.rate, "speed": assumed.speed}
    both = [(name, value, getattr(stated, name)) for name, value in given.items() if value and getattr(stated, name)]
    return [
        Note("contradiction", f"the file states {own.text!r}: the {name} that was given is used")
        for name, value, own in both
        if abs(value / own.value - 1.0) > UNEVEN_SHARE
    ]


def _assuming(stream: Stream, alone: Mapping[str, Column], sentences: Sequence[str]) -> Stream:
    """The stream with ``sentences``, and one for each column that was chosen because no other has a unit of its
    quantity."""
    only = [f"the {q} is the column {c.header!r}, the only one with a unit for it" for q, c in alone.items()]
    return replace(stream, assumptions=[*only, *sentences, *stream.assumptions])


def _in_order_and_si(samples: Samples, units: Mapping[str, str], assumed: AssumedMotion) -> tuple[Stream, str]:
    """Check the order of samples without missing values and convert them to SI; also return the unit of their time."""
    _check_magnitudes(samples)
    timed = "time" in samples.values
    if timed:
        put_in_order(samples)
    check_count(samples)
    place = file_name(samples.table.path)
    if "depth" in samples.values and np.ptp(samples.values["depth"]) == 0.0:
        header = samples.columns["depth"].header
        raise constant_depth(f"depth (column {header!r})", samples.values["depth"][0], place)
    assigned, assumptions = assign_units(samples, units, needle=not assumed.counted)
    values = {quantity: unit.to_si(samples.values[quantity]) for quantity, unit in assigned.items()}
    assumptions += _supply(values, len(next(iter(values.values()))), assumed)
    values["row"] = np.arange(len(values["time"])) if samples.rows is None else samples.rows
    _check_finer_than_clock(values["time"], samples)
    stream = Stream(place=place, sha256=samples.sha256, values=values, assumptions=assumptions, notes=samples.notes)
    return stream, assigned["time"].symbol if timed else "s"


def _supply(values: dict[str, np.ndarray], count: int, assumed: AssumedMotion) -> list[str]:
    """Add time and depth where the file has none; return what is assumed."""
    sentences = []
    if "time" not in values:
        values["time"], sentence = assumed.time(count, values.get("depth"))
        sentences.append(sentence)
    if "force" in values and not values.keys() & set(MOTION) and assumed.gives_depth(True):
        values["depth"], sentence = assumed.depth(values["time"])
        sentences += [sentence, *([] if assumed.hold is not None else _withdrawal(values["force"]))]
    return sentences


def _withdrawal(force: np.ndarray) -> list[str]:
    """A sentence if a force cannot be that of a motion in one direction: beyond its noise it has both signs."""
    if not has_both_signs(force):
        return []
    return ["the force has both signs, as if the needle was drawn out again: then this depth is wrong, and a file with "
            "the motion is needed (--motion; its corners, with their times, are enough), or --stroke-mm and "
            "--hold-s"]  # fmt: skip


def has_both_signs(force: np.ndarray) -> bool:
    """Whether a force changes by more than its noise to both sides of its first value."""
    changes = float(force.max() - force[0]), float(force[0] - force.min())
    noise = core.second_difference_noise(np.ascontiguousarray(force, float))
    return min(changes) > max(_NOISE * noise, _BOTH_SIGNS * max(changes))


def _leave_out_torques(chosen: dict[str, Column], units: Mapping[str, str]) -> list[Note]:
    """Drop torques without a unit: unlike that of a force, it cannot be inferred from the size."""
    dropped = [q for q, column in chosen.items() if dimension(q) == "torque" and q not in units and column.unit is None]
    for quantity in dropped:
        del chosen[quantity]
    if not dropped:
        return []
    names = f"{', '.join(dropped)} {'is' if len(dropped) == 1 else 'are'}"
    message = f"{names} left out because no unit is given; to keep a torque, give its unit, such as --unit "
    return [Note("left_out", f"{message}{dropped[0]}=Nmm", len(dropped))]


def constant_depth(quantity: str, value: float, place: str) -> InputError:
    """The error for a needle that does not move."""
    step = "Check which column is the depth, and name it with --column depth=NAME."
    return InputError(quantity, f"constant at {value:g}", "the needle must move", place, step)


def _required(
    chosen: dict[str, Column], wanted: tuple[str, ...], roles: Roles, assumed: AssumedMotion, stated: Stated
) -> tuple[str, ...]:
    """The quantities that the file must have. Raises one InputError for all that are absent."""
    required = _needed(chosen, wanted, assumed)
    absent = [quantity for quantity in required if quantity not in chosen]
    if absent:
        raise roles.missing(absent, _instead(absent, "force" in wanted, len(roles.table.headers), stated))
    return tuple(required)


def _needed(chosen: Mapping[str, Column], wanted: Sequence[str], assumed: AssumedMotion) -> list[str]:
    """The quantities that must have a column: those wanted, without what the user states."""
    moving = "depth" if "depth" in chosen or "velocity" not in chosen else "velocity"
    required = [q for q in ("time", "force", moving) if q in wanted]
    if "time" in required and "time" not in chosen and assumed.gives_time(moving in chosen):
        required.remove("time")
    if "depth" in required and "depth" not in chosen and assumed.gives_depth("time" in chosen):
        required.remove("depth")
    return required


def _absent(chosen: Mapping[str, Column], wanted: Sequence[str], assumed: AssumedMotion) -> list[str]:
    return [quantity for quantity in _needed(chosen, wanted, assumed) if quantity not in chosen]


def _instead(absent: Sequence[str], whole: bool, columns: int, stated: Stated) -> list[str]:
    """Other ways to give what is absent."""
    ways = []
    if stated.speed and whole and len(absent) == 1 and absent[0] != "force":
        option = f"--speed-mm-s {1e3 * stated.speed.value:.6g}"
        ways.append(f"give {option} if the needle moved at {stated.speed.text!r} all the time")
    if "time" in absent and whole:
        ways.append("the time by --rate-hz" + ("" if "depth" in absent else " or --speed-mm-s"))
    if "depth" in absent and whole:
        ways.append("the depth by --step-um or --speed-mm-s of a constant motion, with --stroke-mm and --hold-s if it "
                    "stops or returns")  # fmt: skip
        ways.append("give a motion file with --motion FILE")
    if "force" in absent and columns > _MANY_COLUMNS:
        ways.append("the force of a recording in each column with --column 'force=*'")
    if "time" in absent and whole:
        ways.append("use the command indentation, which needs no time")
    return ways


def _check_magnitudes(samples: Samples) -> None:
    """Check that no value is so large that differences and squares overflow."""
    for quantity, values in samples.values.items():
        if np.max(np.abs(values), initial=0.0) > _MAX_MAGNITUDE:
            largest = int(np.argmax(np.abs(values)))
            name, limit = f"{quantity} (column {samples.columns[quantity].header!r})", f"at most {_MAX_MAGNITUDE:g}"
            raise InputError(name, f"{values[largest]:g}", limit, samples.place(largest), "Correct or remove the line.")


def _check_finer_than_clock(time: np.ndarray, samples: Samples) -> None:
    """Check that time stamps remain distinct in seconds: a division can make neighbours of 1e15 µs equal."""
    if not (np.diff(time) > _MIN_STEP_S).all():
        limit = f"consecutive times differ by less than {_MIN_STEP_S:g} s"
        step = "Subtract the time of the first sample before saving."
        raise InputError("time", "too large for its steps", limit, str(samples.table.path), step)
