# SPDX-License-Identifier: Apache-2.0
"""Writing of live recordings, append-only and complete at every flush; and of any recording as a log."""

import json
import math
import os
import secrets
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ...errors import InputError
from ...files import MAX_PART_SAMPLES, atomic_write, checked_target
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
CARD, PART, END = "needleforce", "needleforce.part", "needleforce.end"  # names of the metadata records
CONTINUED = "continued"  # in the last record of a part: the name of the next one
_MAX_PARTS = 9999  # whose names sort; the last one takes what is left
STANDING = ("bias", "axis", "phase")  # marks that hold until the next of their kind: each part repeats them
_TOPICS = {WRENCH_TOPIC: WRENCH_STAMPED, AXIS_TOPIC: JOINT_STATE, MARKS_TOPIC: STRING}
_AXES = ("fx", "fy", "tx", "ty", "tz")
_CLOCKS = range(2**63)  # [ns] that readers accept
_STAMPS = range(-(2**31) * 10**9, 2**31 * 10**9)  # [ns]: a header holds seconds as int32


def part_path(path: Path, number: int) -> Path:
    """The file of a part: ``run.mcap``, ``run.part0002.mcap``, and so on, in the order in which they sort."""
    return path if number == 1 else path.with_name(f"{path.stem}.part{number:04}{path.suffix}")


class LogWriter:
    """MCAP files to which wrenches, states of the axis and marks are appended during a run: one, or several parts of
    which each is complete. A part ends where the next one, with card and marks, has begun.

    Parameters
    ----------
    path : str or os.PathLike
        The file; it must not exist, because nothing is overwritten.
    card : mapping
        The provenance, as text.
    file : binary file, optional
        An open empty file without buffer, to which is written instead of a new one; ``path`` then only names it, and
        there is one part.
    part_samples : int
        Wrenches after which the next part begins.
    part_time : float
        Time [s] after which the next part begins.

    Raises
    ------
    InputError
        The file cannot be created, a time does not fit into its messages, or a later write fails, for example on a full
        disk; complete records written before are kept.

    Notes
    -----
    All times are integers in nanoseconds >= 0: ``arrival`` is the time at which the packet reached this computer,
    ``device`` the time of the device's clock, and ``stamp`` the device's time mapped to this computer's clock.
    ``sequence`` is the sender's counter; it is stored modulo 2^32.
    """

    def __init__(
        self,
        path: str | os.PathLike,
        card: Mapping[str, str],
        file: BinaryIO | None = None,
        *,
        part_samples: int = MAX_PART_SAMPLES,
        part_time: float = math.inf,
    ):
        self._path, self._card = Path(path), {key: str(value) for key, value in card.items()}
        self._run = "" if file else secrets.token_hex(8)
        self._part_samples, self._part_time = part_samples, 1e9 * part_time
        self._number = self._begun = self._part_began = 0  # of this part: number, first wrench, and its arrival
        self._first: int | None = None  # stamp of the first wrench
        self._count = self.kept = self._marks = 0
        self._standing: dict[str, tuple[int, dict[str, Any]]] = {}
        self._begin(file, 0)

    def _begin(self, file: BinaryIO | None, stamp: int) -> None:
        """Begin the next part, whose first wrench has this stamp."""
        from mcap.writer import CompressionType, Writer

        path = part_path(self._path, self._number + 1)
        appended = _Appended(path, file)
        writer = Writer(appended, compression=CompressionType.ZSTD)
        start = 0.0 if self._first is None else 1e-9 * (stamp - self._first)
        part = {"run": self._run, "part": str(self._number + 1), "start_s": repr(start)}
        try:
            writer.start("ros2", "needleforce")
            writer.add_metadata(CARD, self._card)
            if self._run:
                writer.add_metadata(PART, part)
            channels = [_channel(writer, *each) for each in _TOPICS.items()]
        except OSError as error:
            appended.close()
            if file is None:
                path.unlink()
            raise _refusal(error, path) from None
        self._file, self._writer, self._number, self._begun = appended, writer, self._number + 1, self._count
        self._wrench, self._axis, self._notes = channels

    def _continue(self, arrival: int, stamp: int) -> None:
        """Begin the next part, then finish this one, which names it: what is missing later was lost later."""
        self.flush()
        file, writer = self._file, self._writer
        self._begin(None, stamp)
        self._part_began = arrival
        try:
            writer.add_metadata(END, {CONTINUED: self._file.path.name})
            writer.finish()
        except OSError as error:
            raise _refusal(error, file.path, f"{self.kept} wrenches up to the last flush are kept") from None
        finally:
            file.close()
        for kind, (at, facts) in self._standing.items():
            self.mark(at, kind, **facts)

    def wrench(self, sequence: int, arrival: int, device: int, stamp: int, wrench: Sequence[float]) -> None:
        """Append one sample of the sensor: fx fy fz [N] tx ty tz [N m] as measured."""
        self._check_times(arrival, device, stamp)
        if self._first is None:
            self._first, self._part_began = stamp, arrival
        elif self._count - self._begun >= self._part_samples or arrival - self._part_began >= self._part_time:
            if self._run and self._number < _MAX_PARTS:
                self._continue(arrival, stamp)
        self._add(self._wrench, arrival, wrench_message(stamp, wrench), device, sequence)
        self._count += 1

    def state(self, sequence: int, arrival: int, device: int, stamp: int, depth: float, velocity: float) -> None:
        """Append one state of the axis: depth [m], positive inwards, and velocity [m/s]."""
        self._check_times(arrival, device, stamp)
        self._add(self._axis, arrival, state_message(stamp, depth, velocity), device, sequence)

    def mark(self, arrival: int, kind: str, **facts: Any) -> None:
        """Append a mark: its kind, and facts that can be represented in JSON."""
        if kind in STANDING:
            self._standing[kind] = arrival, facts
        text = json.dumps({"kind": kind, **facts}, default=lambda value: value.tolist())
        self._add(self._notes, arrival, string_message(text), arrival, self._marks)
        self._marks += 1

    def flush(self) -> None:
        """Close the chunk and pass it to the operating system: flushed data survive a crash of this program.

        The call does not wait for the disk, which can take seconds: the caller must be able to stop the needle.
        """
        self._guarded(self._writer.flush)
        self.kept = self._count

    def close(self, end: Mapping[str, str]) -> None:
        """Write why the run ended, then index and footer, and wait for the disk. A second call does nothing."""
        if self._file.closed:
            return
        try:
            self.flush()
            self._guarded(self._writer.add_metadata, END, {key: str(value) for key, value in end.items()})
            self._guarded(self._writer.finish)
            self._guarded(self._file.sync)
        finally:
            self._file.close()

    def _check_times(self, arrival: int, device: int, stamp: int) -> None:
        """Raise InputError, with the file closed complete, for a time [ns] that a message cannot hold."""
        for time, limits in ((arrival, _CLOCKS), (device, _CLOCKS), (stamp, _STAMPS)):
            if time not in limits:
                self.close({"why": "a device reports an impossible time"})
                limit = f"messages hold {limits.start} to {limits.stop} ns"
                advice = "Check the clock or counter of the device."
                raise InputError("time of a sample", f"{time} ns", limit, str(self._file.path), advice)

    def _add(self, channel: int, arrival: int, data: bytes, device: int, sequence: int) -> None:
        message = channel, arrival, data, device, sequence & 0xFFFFFFFF
        self._guarded(self._writer.add_message, *message)

    def _guarded(self, write: Callable[..., object], *arguments: Any) -> None:
        """Call ``write``; an error of the file becomes an InputError and closes it."""
        if self._file.closed:
            raise InputError("recording", "closed", "nothing more can be written", str(self._file.path))
        before = self._file.tell()
        try:
            write(*arguments)
        except OSError as error:
            self._file.close()
            self.kept = self._count if self._file.tell() > before else self.kept  # only the index of a chunk is missing
            raise _refusal(error, self._file.path, f"{self.kept} wrenches up to the last flush are kept") from None


def _channel(writer: Any, topic: str, message: str) -> int:
    schema = writer.register_schema(message, "ros2msg", schema_text(message).encode())
    return writer.register_channel(topic, "cdr", schema)


class _Appended:
    """A new file to which complete records are appended; a record that does not fit is removed again."""

    def __init__(self, path: Path, file: BinaryIO | None = None):
        self.path, self._end = path, 0
        try:
            self._file = open(path, "xb", buffering=0) if file is None else file
        except FileExistsError:
            limit, advice = "the file exists", "Give another name: nothing is overwritten."
            raise InputError("recording", "not started", limit, str(path), advice) from None
        except (OSError, ValueError) as error:
            raise _refusal(error, path) from None

    @property
    def closed(self) -> bool:
        return self._file.closed

    def write(self, data: bytes) -> None:
        """Append all of ``data`` or nothing."""
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
        """Do nothing: this file has no buffer."""

    def sync(self) -> None:
        os.fsync(self._file.fileno())

    def close(self) -> None:
        self._file.close()


def _refusal(error: Exception, path: str | os.PathLike, kept: str = "") -> InputError:
    reason = getattr(error, "strerror", None) or str(error)
    limit = f"{reason}; {kept}" if kept else reason
    advice = "Check the folder and the free space of the disk."
    return InputError("recording", "ended early" if kept else "not started", limit, str(path), advice)


def write_log(recording: Recording, path: str | os.PathLike) -> Path:
    """Write a recording as MCAP, atomically; ``read`` returns the same values, times rounded to 1 ns.

    The force is written as fz of the wrench; depth and velocity are states of the axis at the same times. The parts of
    a simulated force are not written.

    Parameters
    ----------
    recording : Recording
        The recording.
    path : str or os.PathLike
        The file.

    Returns
    -------
    pathlib.Path
        The file written.

    Raises
    ------
    InputError
        Times that are equal when rounded to 1 ns, values that are not finite, or a file that cannot be created.
    """
    times = np.round((recording.time - recording.time[0]) * 1e9)
    target = checked_target(path)
    _check(recording, times, str(target))
    with atomic_write(target) as file:
        _write(recording, times.astype(int).tolist(), target, file.buffer.raw)
    return target


def _write(recording: Recording, times: list[int], target: Path, file: BinaryIO) -> None:
    axes = {axis: recording.axes.get(axis, np.zeros(len(times))) for axis in _AXES} | {"fz": recording.force}
    wrenches = zip(*(axes[axis].tolist() for axis in ("fx", "fy", "fz", "tx", "ty", "tz")))
    states = zip(recording.depth.tolist(), recording.velocity.tolist())
    log = LogWriter(target, _card(recording), file)
    for number, (time, wrench, (depth, velocity)) in enumerate(zip(times, wrenches, states)):
        clocks = {"sequence": number, "arrival": time, "device": time, "stamp": time}
        log.wrench(**clocks, wrench=wrench)
        log.state(**clocks, depth=depth, velocity=velocity)
    log.close({"why": "written from a recording"})


def _check(recording: Recording, times: np.ndarray, place: str) -> None:
    if not (np.diff(times) > 0.0).all():
        limit = "each sample must be at least one nanosecond later than the previous one"
        raise InputError("time", "not increasing", limit, place)
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
