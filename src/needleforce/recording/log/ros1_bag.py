# SPDX-License-Identifier: Apache-2.0
"""ROS 1 bags by the package rosbags: their messages as those of ROS 2, within bounds of memory and time."""

import bz2
import os
from pathlib import Path
from typing import Any, BinaryIO

from ...errors import InputError, install_step
from ...files import open_regular, unpacked_limit
from ..recording import Note
from .topics import TYPES, Collected

MARK = b"#ROSBAG"
_HEAD = b"#ROSBAG V2.0\n"
_BLOCK_BYTES = 1 << 16
_MESSAGE_CHARS = 160


def read_ros1_bag(path: Path, collected: Collected) -> list[Note]:
    """Pass the messages of a ROS 1 bag to ``collected``; it has no counters. Returns notes on what is damaged.

    Raises InputError for a bag without index, for a damaged one, for one that would take more memory or time than a
    recording, and if the package rosbags is missing.
    """
    try:
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        advice = install_step("rosbags", "ros")
        raise InputError("package rosbags", "missing", "it is needed for ROS 1 bags", str(path), advice) from None
    reindex = f"Check that it is complete, or make a new index with rosbag reindex {path.name}"
    try:
        _check_version(path)
        convert = get_typestore(Stores.ROS2_HUMBLE).ros1_to_cdr
        undecoded = 0
        with _reader(path) as reader:
            wanted = [each for each in reader.connections if each.msgtype in TYPES]
            for each in reader.connections:
                if each.msgtype not in TYPES:
                    collected.leave_out(each.topic, each.msgtype)
            for connection, arrival, data in reader.messages(wanted) if wanted else ():
                reader.count(len(data))
                try:
                    cdr = bytes(convert(data, connection.msgtype))
                except Exception:  # of various classes, for a message that is shorter than its type
                    undecoded += 1
                    continue
                message = {"topic": connection.topic, "message": connection.msgtype, "data": cdr}
                collected.take(**message, counter=0, arrival=arrival, device=arrival)
    except (InputError, MemoryError):
        raise
    except Exception as error:
        reason = " ".join(str(error).split())[:_MESSAGE_CHARS]
        if "not indexed" in reason:
            raise InputError("bag", "without an index", "it was not closed", str(path), f"{reindex}.") from None
        raise InputError("bag", "not readable", reason, str(path), f"{reindex}.") from None
    text = f"{undecoded} messages cannot be decoded and are left out"
    return [Note("damaged", text, undecoded)] if undecoded else []


def _check_version(path: Path) -> None:
    with open_regular(path) as file:
        start = file.read(len(_HEAD))
    if start != _HEAD:
        limit = "version 2.0 is read"
        raise InputError("bag", f"of version {start[len(MARK) :].decode('latin-1').strip()}", limit, str(path),
                         f"Convert it with rosbag fix {path.name} NEW.bag.")  # fmt: skip


class _Opening:
    """What the library asks of a path."""

    def __init__(self, path: Path):
        self._path = path

    def exists(self) -> bool:
        """That opening it will give the better message."""
        return True

    def open(self, _: str) -> BinaryIO:
        """The open file."""
        return open_regular(self._path)


def _reader(path: Path) -> Any:
    """A reader that bounds what is indexed, unpacked and read in all, whatever the bag states."""
    import lz4.frame
    from rosbags.rosbag1 import Reader

    class Bounded(Reader):
        def __init__(self) -> None:
            super().__init__(_Opening(path))
            self._size = os.stat(path).st_size
            self._indexed = self._read = 0

        def read_index_data(self, pos: int, indexes: dict) -> None:
            before = self.bio.tell()
            super().read_index_data(pos, indexes)
            self._indexed += self.bio.tell() - before
            if self._indexed > self._size:  # chunks that share one index
                raise ValueError("the index is longer than the file")

        def read_chunk(self) -> Any:
            chunk = super().read_chunk()
            unpack = chunk.decompressor
            if unpack is bz2.decompress:
                return chunk._replace(decompressor=lambda data: self._unpacked(bz2.BZ2Decompressor(), data))
            if unpack is lz4.frame.decompress:
                made = lz4.frame.LZ4FrameDecompressor
                return chunk._replace(decompressor=lambda data: self._unpacked(made(), data))
            return chunk._replace(decompressor=lambda data: self.count(len(data)) or data)

        def _unpacked(self, stream: Any, data: bytes) -> bytes:
            parts = []
            while not stream.eof:
                block = stream.decompress(data, max_length=_BLOCK_BYTES)
                if not block and stream.needs_input:
                    raise ValueError("a chunk ends too early")
                data = b""
                self.count(len(block))
                parts.append(block)
            return b"".join(parts)

        def count(self, size: int) -> None:
            """Raise InputError for more bytes in all than a bag of this size has."""
            self._read += size
            limit = unpacked_limit(self._size)
            if self._read > limit:
                limits = f"at most {limit >> 20} MiB for a file of this size"
                raise InputError("unpacked size", f"over {limit >> 20} MiB", limits, str(path), "Unpack it with rosbag "
                                 "decompress, and leave out other topics with rosbag filter.")  # fmt: skip

    return Bounded()
