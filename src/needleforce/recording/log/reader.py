# SPDX-License-Identifier: Apache-2.0
"""Reading of logs: those written by this package, and any MCAP file or ROS 2 bag with the same message types."""

import math
import os
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path, PurePath
from typing import Any

from ...errors import InputError, install_step
from ...files import BAG, MAX_RECORDING_BYTES, MCAP, digest, leads_out, open_regular, read_bytes
from ..recording import Note
from .mcap_records import CHANNEL, CHUNK, MESSAGE, METADATA, RECORD_HEAD, SCHEMA, RecordReader
from .messages import Log
from .ros1_bag import MARK, read_ros1_bag
from .topics import Collected
from .writer import CARD, CONTINUED, END, PART, part_path

_MESSAGE = struct.Struct("<HIQQ")  # channel, counter, times of arrival and of the device
_MAX_ORPHAN_BYTES = 64 << 20  # messages kept until their channel is defined, which may be at the end of the file
_OVERHEAD_BYTES = 100  # bytes of overhead of each of them
_MAX_DEFINITIONS = 1 << 17  # schemas and channels: each has an identifier of 16 bits
_NO_SCHEMA = 0  # identifier of a channel without schema
_MAX_METADATA_BYTES, _MAX_BRACKETS = 1 << 18, 1000  # of the description of a bag
_MAX_CARD_BYTES = 1 << 20  # bytes of a card


def read_bag(folder: Path, collected: Collected) -> list[Note]:
    """Pass all messages of a ROS 2 bag to ``collected``; a bag has no counters. Returns notes on what is damaged.

    Raises InputError if the folder is not a bag, if the bag is damaged, compressed as a whole, or contains anything but
    regular files, or if the package rosbags is missing.
    """
    if not (folder / BAG).is_file():
        limit = f"a ROS 2 bag contains {BAG}"
        raise InputError("folder", "not a ROS 2 bag", limit, str(folder), "Name a file, or the folder of a bag.")
    try:
        from rosbags.rosbag2 import Reader
    except ImportError:
        advice = install_step("rosbags", "ros")
        raise InputError("package rosbags", "missing", "it is needed for ROS 2 bags", str(folder), advice) from None
    try:
        storage, files = _bag_files(folder)
        if storage == "mcap":
            return [note for file in files for note in _Contents(_Uncounted(collected), file).read()]
        for file in files:
            _check_database(file)
        with Reader(folder) as reader:
            for connection, arrival, data in reader.messages():
                message = {"topic": connection.topic, "message": connection.msgtype, "data": bytes(data)}
                collected.take(**message, counter=0, arrival=arrival, device=arrival)
        return []
    except (InputError, MemoryError):
        raise
    except Exception as error:  # the packages raise various exceptions for a damaged bag
        reason = " ".join(str(error).split())[:200]
        raise InputError("bag", "not readable", reason, str(folder), "Check that it is complete.") from None


def _bag_files(folder: Path) -> tuple[str, list[Path]]:
    """The storage of a bag and its files. Raises InputError or another exception for a folder that is not safe."""
    from ruamel.yaml import YAML

    text = read_bytes(folder / BAG, "bag", _MAX_METADATA_BYTES)
    if text.count(b"[") + text.count(b"{") > _MAX_BRACKETS:  # the parser's time grows with the square of open ones
        raise ValueError(f"{BAG} contains more than {_MAX_BRACKETS} brackets")
    for event in YAML(typ="safe").parse(text.decode()):  # what is merged or repeated can double at every level
        if getattr(event, "anchor", None) or getattr(event, "tag", None) or getattr(event, "value", None) == "<<":
            raise ValueError(f"{BAG} contains an anchor, an alias, a tag or a merge key")
    size = 0
    for path in folder.iterdir():
        with open_regular(path, "file of a bag") as file:
            size += file.seek(0, os.SEEK_END)
        if leads_out(path, folder):
            limit, step = f"leads out of {folder}", "Put the file itself into the folder."
            raise InputError("file of a bag", "a link", limit, str(path), step)
    if size > MAX_RECORDING_BYTES:
        limit, advice = f"at most {MAX_RECORDING_BYTES} are read", "Split it, for example with ros2 bag convert."
        raise InputError("size of the bag", f"{size} bytes", limit, str(folder), advice)
    facts = YAML(typ="safe").load(text.decode())["rosbag2_bagfile_information"]
    if (facts.get("compression_mode") or "none").lower() != "none":  # its size is not known before it is unpacked
        advice = "Unpack it, for example with ros2 bag convert."
        raise InputError("bag", "compressed", "only bags without compression are read", str(folder), advice)
    return facts["storage_identifier"], [folder / PurePath(name).name for name in facts["relative_file_paths"]]


def _check_database(path: Path) -> None:
    """Raise ValueError unless an SQLite file has plain tables only: a view or a computed column can be endless."""
    import contextlib
    import sqlite3

    with contextlib.closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)) as database:
        for kind, name, text in database.execute("SELECT type, name, sql FROM sqlite_master").fetchall():
            plain = kind == "index" or (kind == "table" and text.upper().startswith("CREATE TABLE"))
            if not plain or any(row[-1] for row in database.execute("SELECT * FROM pragma_table_xinfo(?)", (name,))):
                raise ValueError(f"{name[:40]!r} is not a plain table")


def read_log(path: str | os.PathLike, columns: Mapping[str, str] | None = None, part: str | None = None) -> Log:
    """Read an MCAP file with the parts that continue it, a ROS 1 bag, or the folder of a ROS 2 bag.

    It needs messages of WrenchStamped or Wrench, and of JointState or PoseStamped.

    Parameters
    ----------
    path : str or os.PathLike
        The file or folder. A truncated file is read up to its last complete record.
    columns : mapping, optional
        Topics to use if there are several: ``{"force": "/ft/wrench", "depth": "/joint_states:needle"}``.
    part : str, optional
        One part of a recording in parts, such as ``part0001``, which the file by itself stands for.

    Returns
    -------
    Log
        The messages, marks and card; ``complete`` is False for a truncated file.

    Raises
    ------
    InputError
        Not such a file, or several topics match and none is given; a part is missing, or another one.
    """
    return next(logs(path, columns, part))


def logs(
    path: str | os.PathLike, columns: Mapping[str, str] | None, part: str | None = None, block: float = math.inf
) -> Iterator[Log]:
    """As ``read_log``, in blocks of so many messages, one after the other; a bag is one. Only the last one has the end
    and the notes, and none of the messages of the others."""
    place = Path(path)
    collected = Collected(columns or {}, str(place))
    read: list[_Contents] = []
    notes: list[Note] = []
    if place.is_dir() or _is_ros1_bag(place):
        if part is not None:
            _chosen_file(place, {}, part)
        notes += (read_bag if place.is_dir() else read_ros1_bag)(place, collected)
    else:
        for contents in _parts(place, part, collected, notes):
            read.append(contents)
            for _ in contents.blocks(block):
                yield _log(collected, read, None)
            notes += contents.notes
    log = _log(collected, read, notes + collected.notes())
    files = log.files or ((place,) if place.is_file() else ())
    log.sha256 = digest(*files) if files else ""
    collected.clear()
    yield log


def _is_ros1_bag(path: Path) -> bool:
    with open_regular(path) as file:
        return file.read(len(MARK)) == MARK


def _log(collected: Collected, read: "list[_Contents]", notes: list[Note] | None) -> Log:
    """What was collected from the files that were read so far; without notes, as far as it is complete."""
    if notes is None:
        collected, notes = collected.cut(), []
    return Log(
        wrench=collected.wrench(),
        axis=collected.axis(),
        marks=collected.marks,
        card=read[0].card if read else {},
        end=read[-1].metadata.get(END) if read else None,
        complete=all(each.complete for each in read),
        notes=notes,
        others=collected.others(),
        axial=collected.axial,
        files=tuple(each.path for each in read),
    )


def _parts(path: Path, part: str | None, collected: Collected, notes: list[Note]) -> "Iterator[_Contents]":
    """The files of a recording in their order, each to be read before the next is taken. Raises InputError for one that
    is missing or another.

    The recorder, which may be at work, begins a part after the last readings of the one before, where it then names it:
    a part that was begun before the one before was read, or that is named there, misses none of them.
    """
    first = _facts_of_part(path) or {}
    file, number = path if part is None else _chosen_file(path, first, part), 1
    while True:
        following = part_path(path, number + 1)
        begun = following.exists()
        yield (contents := _Contents(collected, file))
        if part is not None or first.get("part") != "1":
            return
        if not (begun or CONTINUED in contents.metadata.get(END, {})):
            return
        file, number = following, number + 1
        facts = _facts_of_part(file) if file.exists() else {"part": "missing", "run": first.get("run")}
        if facts is None and not part_path(path, number + 1).exists():
            notes.append(Note("incomplete", f"part {number} was only begun: it holds no readings"))
            return
        what = (facts or {}).get("part", "none") if (facts or {}).get("run") == first.get("run") else "of another run"
        if what != str(number):
            limit = "the files are not those that were recorded one after the other"
            step = "Put them back, or read each by itself, such as with --part part0001."
            raise InputError(f"part {number}", what, limit, str(file), step)


def _chosen_file(path: Path, first: Mapping[str, str], part: str) -> Path:
    """The file of one part of a recording, named as in its file."""
    files = {"part0001": path}
    while first.get("part") == "1" and (file := part_path(path, len(files) + 1)).exists():
        files[file.stem.rpartition(".")[2]] = file
    if part not in files or len(files) == 1:
        limit = f"it has part0001 to {list(files)[-1]}" if len(files) > 1 else "a log has one recording"
        step = "Give one of these." if len(files) > 1 else "Leave it out."
        raise InputError("part", repr(part[:60]), limit, str(path), step)
    return files[part]


def _facts_of_part(path: Path) -> dict[str, str] | None:
    """What a file states of the part that it is, empty if nothing; None for one that ends before."""
    for code, record in RecordReader(path).records() if path.stat().st_size >= len(MCAP) else ():
        if code in (CHUNK, MESSAGE, SCHEMA):
            return {}
        if code == METADATA and (found := _metadata(record).get(PART)):
            return found
    return None


@dataclass
class _Uncounted:
    """Messages of a bag, whose counters and times of sending recorders fill in various ways."""

    collected: Collected
    count = 0

    def take(self, *, arrival: int, counter: int, device: int, **message: Any) -> None:
        self.collected.take(arrival=arrival, counter=0, device=arrival, **message)


class _Contents:
    """A file: schemas and channels in its order, and the messages that refer to them, for ``collected``."""

    def __init__(self, collected: Any, path: Path):
        self._collected, self.path = collected, path
        self.complete, self.notes = False, []
        self.metadata: dict[str, dict] = {}
        self._schemas: dict[int, str] = {_NO_SCHEMA: ""}
        self._channels: dict[int, tuple[str, int]] = {}
        self._defined: set[tuple[int, bytes]] = set()
        self._orphans: list[bytes] = []
        self._orphaned = self._lost = 0

    @property
    def card(self) -> dict[str, str]:
        """The card, of a later part with the time at which it begins."""
        part = self.metadata.get(PART, {})
        start = {"start_s": part["start_s"]} if part.get("part", "1") != "1" and "start_s" in part else {}
        return self.metadata.get(CARD, {}) | start

    def read(self) -> list[Note]:
        """Read the file; notes on what is damaged."""
        for _ in self.blocks(math.inf):
            pass
        return self.notes

    def blocks(self, size: float) -> Iterator[None]:
        """Read the file, with a stop whenever so many messages were collected."""
        reader = RecordReader(self.path)
        for code, record in reader.records():
            self.take(code, record)
            if self._collected.count >= size:
                yield
        self.complete, self.notes = reader.complete, reader.notes + self.finish()
        if not reader.complete:
            self.notes.append(Note("incomplete", "the recording was not closed: it ends at the last flush"))

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
        with open_regular(path) as file:
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
        step = "Check the disk or the network, or copy the file."
        raise InputError("recording", "not read", error.strerror or "", str(path), step) from None
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
