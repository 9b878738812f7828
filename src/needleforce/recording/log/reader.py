# SPDX-License-Identifier: Apache-2.0
"""All that can be read of a log: one of ours, or any MCAP file or ROS 2 bag with such messages."""

import os
import struct
from collections.abc import Callable, Mapping
from io import BytesIO
from pathlib import Path

from ...errors import InputError
from ..formats import BAG, MCAP
from ..recording import Note
from .mcap_records import CHANNEL, MESSAGE, METADATA, RECORD_HEAD, SCHEMA, Walk
from .messages import Log
from .topics import Collected
from .writer import CARD, END

_MESSAGE = struct.Struct("<HIQQ")  # channel, counter, times of arrival and of the device
_ORPHANS = 64 << 20  # bytes of messages kept until their channel is found, as it may be at the end
_OBJECT = 100  # bytes that each of them takes beside its own
_DEFINITIONS = 1 << 17  # schemas and channels: each has a number of 16 bits
_NO_SCHEMA = 0  # the number that says so
_LARGEST = 1 << 20  # bytes of a card


def read_bag(folder: Path, take: Callable[[str, str, int, int, int, bytes], None]) -> None:
    """Hand all messages to ``take`` (topic, type, counter, arrival [ns], device [ns], CDR); a bag has no counters.

    Raises InputError where the folder is no bag, or rosbags is not there.
    """
    if not (folder / BAG).is_file():
        limit = f"a ROS 2 bag has a {BAG}"
        raise InputError("folder", "no ROS 2 bag", limit, str(folder), "Name a file, or the folder of a bag.")
    try:
        from rosbags.rosbag2 import Reader
    except ImportError:
        advice = 'Install the extra "ros": pip install "needleforce[ros]".'
        raise InputError("package rosbags", "missing", "it reads ROS 2 bags", str(folder), advice) from None
    try:
        with Reader(folder) as reader:
            for connection, arrival, data in reader.messages():
                take(connection.topic, connection.msgtype, 0, arrival, arrival, bytes(data))
    except InputError:
        raise
    except Exception as error:  # whatever the package meets in a damaged bag
        why = " ".join(str(error).split())[:200]
        raise InputError("bag", "not readable", why, str(folder), "Check that it is whole.") from None


def read_log(path: str | os.PathLike, columns: Mapping[str, str] | None = None) -> Log:
    """Read an MCAP file with WrenchStamped or Wrench, JointState or PoseStamped; or the folder of a ROS 2 bag.

    A file that was cut off gives what was whole, and ``complete`` is False. ``columns`` chooses where there are
    several: ``{"force": "/ft/wrench", "depth": "/joint_states:needle"}``. Raises InputError for what is no such file,
    and where a choice is needed.
    """
    place = Path(path)
    collected = Collected(columns or {}, str(place))
    if place.is_dir():
        read_bag(place, collected.take)
        return Log(collected.wrench(), collected.axis(), collected.marks, {}, None, True, collected.notes())
    walk, contents = Walk(place), _Contents(collected)
    for code, record in walk.records():
        contents.take(code, record)
    notes = walk.notes + contents.finish() + collected.notes()
    if not walk.complete:
        notes.append(Note("incomplete", "the recording was not closed: it ends where it was last flushed"))
    card, end = contents.metadata.get(CARD, {}), contents.metadata.get(END)
    return Log(collected.wrench(), collected.axis(), collected.marks, card, end, walk.complete, notes)


class _Contents:
    """Schemas and channels as they are met, and the messages that go by them."""

    def __init__(self, collected: Collected):
        self._collected = collected
        self.metadata: dict[str, dict] = {}
        self._schemas: dict[int, str] = {_NO_SCHEMA: ""}
        self._channels: dict[int, tuple[str, int]] = {}
        self._defined: set[tuple[int, bytes]] = set()
        self._orphans: list[bytes] = []
        self._orphaned = self._lost = 0

    def take(self, code: int, record: bytes) -> None:
        if code == MESSAGE:
            self._message(record)
        elif (code, record) not in self._defined:  # many recorders repeat them in every chunk
            if len(self._defined) < _DEFINITIONS:
                self._defined.add((code, record))
                self._definition(code, record)
            else:
                self._lost += 1

    def finish(self) -> list[Note]:
        """The messages whose channel was found after them, and a note on the rest."""
        orphans, self._orphans, self._orphaned = self._orphans, [], 0
        for record in orphans:
            self._message(record)
        self._lost += len(self._orphans)
        what = f"{self._lost} messages or definitions are damaged or belong to no topic: left out"
        return [Note("damaged", what, self._lost)] if self._lost else []

    def _message(self, record: bytes) -> None:
        if len(record) < _MESSAGE.size:
            self._lost += 1
            return
        channel, counter, arrival, device = _MESSAGE.unpack_from(record)
        topic, schema = self._channels.get(channel, ("", -1))
        if schema in self._schemas:
            self._collected.take(topic, self._schemas[schema], counter, arrival, device, record[_MESSAGE.size :])
        elif self._orphaned < _ORPHANS:
            self._orphans.append(record)
            self._orphaned += len(record) + _OBJECT
        else:
            self._lost += 1

    def _definition(self, code: int, record: bytes) -> None:
        from mcap.data_stream import ReadDataStream
        from mcap.exceptions import McapError
        from mcap.records import Channel, Metadata, Schema

        kind = {SCHEMA: Schema, CHANNEL: Channel, METADATA: Metadata}[code]
        try:
            found = kind.read(ReadDataStream(BytesIO(record)))
        except (McapError, struct.error, ValueError):
            self._lost += 1
            return
        if code == METADATA:
            self.metadata[found.name] = found.metadata
        elif code == SCHEMA:
            self._schemas[found.id] = found.name
        else:
            schema = found.schema_id if found.message_encoding == "cdr" else _NO_SCHEMA
            self._channels[found.id] = (found.topic, schema)


def card_and_end(path: Path) -> tuple[dict[str, str], dict[str, str] | None]:
    """The card, empty where none is whole, and the end, None for a file that was not closed. Passes over all samples.

    Raises InputError for a file that cannot be read.
    """
    found: dict[str, dict[str, str]] = {}
    try:
        with open(path, "rb") as file:
            size = file.seek(0, 2)
            file.seek(0)
            at = len(MCAP) if file.read(len(MCAP)) == MCAP else size
            while at + RECORD_HEAD.size <= size:
                file.seek(at)
                code, length = RECORD_HEAD.unpack(file.read(RECORD_HEAD.size))
                at += RECORD_HEAD.size + length
                if code == METADATA and length <= _LARGEST and at <= size:
                    found.update(_metadata(file.read(length)))
    except OSError as error:
        raise InputError("recording", "not read", error.strerror or "", str(path)) from None
    return found.get(CARD, {}), found.get(END)


def _metadata(content: bytes) -> dict[str, dict[str, str]]:
    from mcap.data_stream import ReadDataStream
    from mcap.exceptions import McapError
    from mcap.records import Metadata

    try:
        record = Metadata.read(ReadDataStream(BytesIO(content)))
    except (McapError, struct.error, ValueError):
        return {}
    return {record.name: record.metadata}
