# SPDX-License-Identifier: Apache-2.0
"""The live recording, written as it happens: only appended to, whole at every flush; and any recording as a log."""

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...files import checked_target
from ..recording import Recording
from .ros_messages import (
    JOINT_STATE,
    STRING,
    WRENCH_STAMPED,
    schema_text,
    state_message,
    string_message,
    wrench_message,
)

WRENCH_TOPIC, AXIS_TOPIC, MARKS_TOPIC = "/needle/wrench", "/needle/axis", "/needle/marks"
CARD, END = "needleforce", "needleforce.end"  # names of the metadata records
_TOPICS = {WRENCH_TOPIC: WRENCH_STAMPED, AXIS_TOPIC: JOINT_STATE, MARKS_TOPIC: STRING}
_AXES = ("fx", "fy", "tx", "ty", "tz")


class LogWriter:
    """An MCAP file that takes wrenches, states of the axis and marks as they come.

    ``path`` must not exist: nothing is overwritten. ``card`` says what was recorded, text by text. Times are whole
    nanoseconds >= 0: ``arrival`` when the packet reached this computer, ``device`` by the device's own clock,
    ``stamp`` the device's clock mapped to this computer's. ``sequence`` is the sender's own counter, modulo 2^32.

    Raises InputError where the file cannot be made or goes no further, as on a full disk: what was written until then
    stays, up to a whole record.
    """

    def __init__(self, path: str | os.PathLike, card: Mapping[str, str]):
        from mcap.writer import CompressionType, Writer

        self._file = _Appended(Path(path))
        self._writer = Writer(self._file, compression=CompressionType.ZSTD)
        self._count = self._kept = self._marks = 0
        try:
            self._writer.start("ros2", "needleforce")
            self._writer.add_metadata(CARD, {key: str(value) for key, value in card.items()})
            self._wrench, self._axis, self._notes = (self._channel(*each) for each in _TOPICS.items())
        except OSError as error:
            self._file.close()
            Path(path).unlink()
            raise _refusal(error, path) from None

    def wrench(self, sequence: int, arrival: int, device: int, stamp: int, wrench: Sequence[float]) -> None:
        """One sample of the sensor: fx fy fz [N] tx ty tz [N m] as measured."""
        self._add(self._wrench, arrival, wrench_message(stamp, wrench), device, sequence)

    def state(self, sequence: int, arrival: int, device: int, stamp: int, depth: float, velocity: float) -> None:
        """One state of the axis: depth [m], + inwards, and velocity [m/s]."""
        self._add(self._axis, arrival, state_message(stamp, depth, velocity), device, sequence)

    def mark(self, arrival: int, kind: str, **facts) -> None:
        """Something that happened: its kind, and facts that JSON can hold."""
        text = json.dumps({"kind": kind, **facts}, default=lambda value: value.tolist())
        self._add(self._notes, arrival, string_message(text), arrival, self._marks)
        self._marks += 1

    def flush(self) -> None:
        """Close the chunk and hand it to the system: all before is safe from the end of this program, by whatever.

        There is no wait for the disk, which can take seconds: who records has a needle to stop meanwhile.
        """
        self._guarded(self._writer.flush)
        self._kept = self._count

    def close(self, end: Mapping[str, str]) -> None:
        """Write how it ended, then index and footer, and wait for the disk. What is closed stays as it is."""
        if self._file.closed:
            return
        try:
            self.flush()
            self._guarded(self._writer.add_metadata, END, {key: str(value) for key, value in end.items()})
            self._guarded(self._writer.finish)
            self._guarded(self._file.sync)
        finally:
            self._file.close()

    def _channel(self, topic: str, message: str) -> int:
        schema = self._writer.register_schema(message, "ros2msg", schema_text(message).encode())
        return self._writer.register_channel(topic, "cdr", schema)

    def _add(self, channel: int, arrival: int, data: bytes, device: int, sequence: int) -> None:
        self._guarded(self._writer.add_message, channel, arrival, data, device, sequence & 0xFFFFFFFF)
        self._count += 1

    def _guarded(self, do, *arguments) -> None:
        if self._file.closed:
            raise InputError("recording", "closed", "nothing more can be written", str(self._file.path))
        try:
            do(*arguments)
        except OSError as error:
            self._file.close()
            raise _refusal(error, self._file.path, f"{self._kept} messages up to the last flush are kept") from None


class _Appended:
    """A new file to which whole records are appended: one that does not fit is taken back."""

    def __init__(self, path: Path):
        self.path, self._end = path, 0
        try:
            self._file = open(path, "xb", buffering=0)
        except FileExistsError:
            limit, advice = "there is something of this name", "Give another name: nothing is overwritten."
            raise InputError("recording", "not begun", limit, str(path), advice) from None
        except (OSError, ValueError) as error:
            raise _refusal(error, path) from None

    @property
    def closed(self) -> bool:
        return self._file.closed

    def write(self, data: bytes) -> None:
        """Append ``data``, or nothing of it."""
        left = memoryview(data)
        try:
            while left:
                left = left[self._file.write(left) :]
        except OSError:
            self._file.truncate(self._end)
            raise
        self._end += len(data)

    def tell(self) -> int:
        return self._end

    def flush(self) -> None:
        """Nothing is held back here."""

    def sync(self) -> None:
        os.fsync(self._file.fileno())

    def close(self) -> None:
        self._file.close()


def _refusal(error: Exception, path, kept: str = "") -> InputError:
    reason = getattr(error, "strerror", None) or str(error)
    limit = f"{reason}; {kept}" if kept else reason
    return InputError("recording", "ended early" if kept else "not begun", limit, str(path), "Check disk and folder.")


def write_log(recording: Recording, path: str | os.PathLike) -> Path:
    """Write a recording as MCAP, whole or not at all. ``read`` gives the same numbers back, times to the ns.

    The force is the wrench's fz, depth and velocity are states of the axis at the same times; the parts of a simulated
    force have no place in these messages and stay out. Raises InputError for times that are one and the same in ns,
    values that are not finite, and a file that cannot be made.
    """
    times = np.round((recording.time - recording.time[0]) * 1e9)
    target = checked_target(path)
    _check(recording, times, str(target))
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        _write(recording, times.astype(int).tolist(), part)
        os.replace(part, target)
    finally:
        part.unlink(missing_ok=True)
    return target


def _write(recording: Recording, times: list[int], part: Path) -> None:
    fx, fy, tx, ty, tz = (recording.axes.get(axis, np.zeros(len(times))).tolist() for axis in _AXES)
    wrenches = zip(fx, fy, recording.force.tolist(), tx, ty, tz)
    states = zip(recording.depth.tolist(), recording.velocity.tolist())
    log = LogWriter(part, _card(recording))
    for number, (time, wrench, state) in enumerate(zip(times, wrenches, states)):
        log.wrench(number, time, time, time, wrench)
        log.state(number, time, time, time, *state)
    log.close({"why": "written from a recording"})


def _check(recording: Recording, times: np.ndarray, place: str) -> None:
    if not (np.diff(times) > 0.0).all():
        raise InputError("time", "not increasing", "each sample must be a nanosecond later than the one before", place)
    for quantity in ("depth", "velocity", "force", *_AXES):
        values = recording.axes.get(quantity) if quantity in _AXES else getattr(recording, quantity)
        if values is not None and not np.isfinite(values).all():
            raise InputError(quantity, "not finite", f"at sample {int(np.argmin(np.isfinite(values)))}", place)


def _card(recording: Recording) -> dict[str, str]:
    card = recording.card
    return {
        "needle": card.needle,
        "tissue": card.tissue,
        "rig": card.rig,
        "filter_length": str(card.filter_length),
        "axial": "fz",
        "axes": " ".join(axis for axis in _AXES if axis in recording.axes),
        "start_s": repr(float(recording.time[0])),
        "origin": card.source,
        "origin_sha256": card.sha256,
        "assumptions": json.dumps(card.assumptions),
        "notes": json.dumps([[note.kind, note.message, note.count] for note in recording.notes]),
    }
