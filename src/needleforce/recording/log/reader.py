# SPDX-License-Identifier: Apache-2.0
"""Reading of logs: those written by this package, and any MCAP file or ROS 2 bag with the same message types."""

import os
import struct
from collections.abc import Callable, Mapping
from io import BytesIO
from pathlib import Path

from ...errors import InputError
from ...files import BAG, MCAP
from ..recording import Note
from .mcap_records import CHANNEL, MESSAGE, METADATA, RECORD_HEAD, SCHEMA, RecordReader
from .messages import Log
from .topics import Collected
from .writer import CARD, END

_MESSAGE = struct.Struct("<HIQQ")  # channel, counter, times of arrival and of the device
_MAX_ORPHAN_BYTES = 64 << 20  # messages kept until their channel is defined, which may be at the end of the file
_OVERHEAD_BYTES = 100  # bytes of overhead of each of them
_MAX_DEFINITIONS = 1 << 17  # schemas and channels: each has an identifier of 16 bits
_NO_SCHEMA = 0  # identifier of a channel without schema
_MAX_CARD_BYTES = 1 << 20  # bytes of a card


def read_bag(folder: Path, take: Callable[..., None]) -> None:
    """Pass all messages to ``take`` (topic, type, counter, arrival [ns], device [ns], CDR); a bag has no counters.

    Raises InputError if the folder is not a bag, if the bag is damaged, or if the package rosbags is missing.
    """
    if not (folder / BAG).is_file():
        limit = f"a ROS 2 bag contains {BAG}"
        raise InputError("folder", "not a ROS 2 bag", limit, str(folder), "Name a file, or the folder of a bag.")
    try:
        from rosbags.rosbag2 import Reader
    except ImportError:
        advice = 'Install it with pip install "needleforce[ros]".'
        raise InputError("package rosbags", "missing", "it is needed for ROS 2 bags", str(folder), advice) from None
    try:
        with Reader(folder) as reader:
            for connection, arrival, data in reader.messages():
                take(
                    topic=connection.topic,
                    message=connection.msgtype,
                    counter=0,
                    arrival=arrival,
                    device=arrival,
                    data=bytes(data),
                )
    except InputError:
        raise
    except Exception as error:  # the package raises various exceptions for a damaged bag
        reason = " ".join(str(error).split())[:200]
        raise InputError("bag", "not readable", reason, str(folder), "Check that it is complete.") from None


def read_log(path: str | os.PathLike, columns: Mapping[str, str] | None = None) -> Log:
    """Read an MCAP file, or the folder of a ROS 2 bag, with WrenchStamped or Wrench and JointState or PoseStamped.

    Parameters
    ----------
    path : str or os.PathLike
        The file or folder. A truncated file is read up to its last complete record.
    columns : mapping, optional
        Topics to use if there are several: ``{"force": "/ft/wrench", "depth": "/joint_states:needle"}``.

    Returns
    -------
    Log
        The messages, marks and card; ``complete`` is False for a truncated file.

    Raises
    ------
    InputError
        Not such a file, or several topics match and none is given.
    """
    place = Path(path)
    collected = Collected(columns or {}, str(place))
    if place.is_dir():
        read_bag(place, collected.take)
        return Log(
            wrench=collected.wrench(),
            axis=collected.axis(),
            marks=collected.marks,
            card={},
            end=None,
            complete=True,
            notes=collected.notes(),
        )
    reader, contents = RecordReader(place), _Contents(collected)
    for code, record in reader.records():
        contents.take(code, record)
    notes = reader.notes + contents.finish() + collected.notes()
    if not reader.complete:
        notes.append(Note("incomplete", "the recording was not closed: it ends at the last flush"))
    return Log(
        wrench=collected.wrench(),
        axis=collected.axis(),
        marks=collected.marks,
        card=contents.metadata.get(CARD, {}),
        end=contents.metadata.get(END),
        complete=reader.complete,
        notes=notes,
    )


class _Contents:
    """Schemas and channels in the order of the file, and the messages that refer to them."""

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
        elif (code, record) not in self._defined:  # many recorders repeat the definitions in every chunk
            if len(self._defined) < _MAX_DEFINITIONS:
                self._defined.add((code, record))
                self._definition(code, record)
            else:
                self._lost += 1

    def finish(self) -> list[Note]:
        """Process the messages that precede the definition of their channel; return a note on the unusable ones."""
        orphans, self._orphans, self._orphaned = self._orphans, [], 0
        for record in orphans:
            self._message(record)
        self._lost += len(self._orphans)
        message = f"{self._lost} messages or definitions are damaged or belong to no topic and are left out"
        return [Note("damaged", message, self._lost)] if self._lost else []

    def _message(self, record: bytes) -> None:
        if len(record) < _MESSAGE.size:
            self._lost += 1
            return
        channel, counter, arrival, device = _MESSAGE.unpack_from(record)
        topic, schema = self._channels.get(channel, ("", -1))
        if schema in self._schemas:
            self._collected.take(
                topic=topic,
                message=self._schemas[schema],
                counter=counter,
                arrival=arrival,
                device=device,
                data=record[_MESSAGE.size :],
            )
        elif self._orphaned < _MAX_ORPHAN_BYTES:
            self._orphans.append(record)
            self._orphaned += len(record) + _OVERHEAD_BYTES
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
    """The card, empty if none is complete, and the end record, None for a file that was not closed.

    Samples are skipped. Raises InputError for a file that cannot be read.
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
                if code == METADATA and length <= _MAX_CARD_BYTES and at <= size:
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
