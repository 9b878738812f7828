# SPDX-License-Identifier: Apache-2.0
"""The records of an MCAP file of any origin, one after the other, also where it is cut short or damaged; no chunk
unpacks to more than it states, nor to more than ``LARGEST``."""

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from ...errors import InputError
from ..formats import MCAP
from ..recording import Note

LARGEST = 64 << 20  # bytes of one record, packed or not: recorders' chunks are of one to some MiB
_AT_ONCE = 1 << 20
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, METADATA = 0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x0C
_READ = (SCHEMA, CHANNEL, MESSAGE, CHUNK, METADATA)
RECORD_HEAD = struct.Struct("<BQ")
# all chunks of a file together, unpacked: so much, and so much for each byte of the file
_UNPACKED, _UNPACKED_PER_BYTE = 256 << 20, 50


class NotUnpacked(ValueError):
    """Why a chunk is not."""


def unpacked(chunk) -> bytes:
    """The bytes of an ``mcap.records.Chunk``: plain, lz4 or zstd. Raises NotUnpacked."""
    if chunk.uncompressed_size > LARGEST:
        raise NotUnpacked(f"it says it holds more than {LARGEST >> 20} MiB")
    ways = {"": _plain, "lz4": _lz4, "zstd": _zstd}
    if chunk.compression not in ways:
        raise NotUnpacked(f"compressed by {chunk.compression[:20]!r}")
    data = ways[chunk.compression](chunk.data, chunk.uncompressed_size)
    if len(data) != chunk.uncompressed_size:
        raise NotUnpacked("it holds more or less than it says")
    return data


def _plain(data: bytes, _: int) -> bytes:
    return data


def _zstd(data: bytes, size: int) -> bytes:
    import zstandard

    try:
        reader = zstandard.ZstdDecompressor(max_window_size=LARGEST).stream_reader(data, read_across_frames=True)
        return _read(lambda most: reader.read(most), size)
    except zstandard.ZstdError as error:
        raise NotUnpacked(str(error)) from None


def _lz4(data: bytes, size: int) -> bytes:
    from lz4.frame import LZ4FrameDecompressor

    decompressor, left = LZ4FrameDecompressor(), [data]

    def some(most: int) -> bytes:
        return b"" if decompressor.eof else decompressor.decompress(left.pop() if left else b"", max_length=most)

    try:
        return _read(some, size)
    except (RuntimeError, EOFError) as error:
        raise NotUnpacked(str(error)) from None


def _read(some, size: int) -> bytes:
    """Up to one byte more than ``size``, piece by piece: what is said of it is not taken for granted."""
    pieces, length = [], 0
    while length <= size:
        piece = some(min(_AT_ONCE, size + 1 - length))
        if not piece:
            break
        pieces.append(piece)
        length += len(piece)
    return b"".join(pieces)


@dataclass
class Walk:
    """A walk through the records of a file, and what it found out: whether the file was closed, and what is amiss."""

    path: Path
    complete: bool = False
    notes: list[Note] = field(default_factory=list)

    def records(self) -> Iterator[tuple[int, bytes]]:
        """Operation code and content of the schemas, channels, messages and metadata, in and out of chunks.

        Raises InputError for what is no MCAP file; what is left out is in ``notes``, at the end also why it ended.
        """
        try:
            if not self.path.is_file():  # a pipe would keep its reader waiting
                what = "no plain file" if self.path.exists() else "missing"
                raise InputError("file", what, "", str(self.path), "Check the name and the folder.")
            with open(self.path, "rb") as file:
                size = file.seek(0, 2)
                file.seek(0)
                if file.read(len(MCAP)) != MCAP:
                    limit, advice = "its first bytes are others", "Check the name, and whether it was ever begun."
                    raise InputError("file", "no MCAP file", limit, str(self.path), advice)
                self._left = _UNPACKED + _UNPACKED_PER_BYTE * size
                yield from self._walk(file, size)
        except OSError as error:
            raise InputError("file", "not readable", error.strerror or "", str(self.path)) from None

    def _walk(self, file: BinaryIO, size: int) -> Iterator[tuple[int, bytes]]:
        at = len(MCAP)
        while at + RECORD_HEAD.size <= size:
            code, length = RECORD_HEAD.unpack(file.read(RECORD_HEAD.size))
            if code == FOOTER:
                self.complete = True
                return
            if code == 0 or length > size - at - RECORD_HEAD.size:
                break
            yield from self._record(code, length, file)
            at += RECORD_HEAD.size + length
            file.seek(at)
        if at < size:
            self._amiss("cut_off", f"the file is cut off or damaged {at} bytes from its start: the rest", size - at)

    def _record(self, code: int, length: int, file: BinaryIO) -> Iterator[tuple[int, bytes]]:
        if code not in _READ:
            return
        if length > LARGEST:
            self._amiss("left_out", f"a record is longer than {LARGEST >> 20} MiB: its content", length)
        elif code == CHUNK:
            yield from self._chunk(file.read(length))
        else:
            yield code, file.read(length)

    def _chunk(self, record: bytes) -> Iterator[tuple[int, bytes]]:
        from mcap.data_stream import ReadDataStream
        from mcap.exceptions import McapError
        from mcap.records import Chunk

        try:
            chunk = Chunk.read(ReadDataStream(BytesIO(record)))
            self._left -= chunk.uncompressed_size
            if self._left < 0:
                raise NotUnpacked("the file's chunks hold far more than a recording")
            data = unpacked(chunk)
            if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
                raise NotUnpacked("its check sum differs")
        except (McapError, NotUnpacked, OverflowError, struct.error, ValueError) as error:
            self._amiss("damaged", f"a chunk is damaged ({str(error)[:80] or 'no chunk'}): its content", len(record))
            return
        yield from self._inside(data)

    def _inside(self, data: bytes) -> Iterator[tuple[int, bytes]]:
        at = 0
        while at + RECORD_HEAD.size <= len(data):
            code, length = RECORD_HEAD.unpack_from(data, at)
            end = at + RECORD_HEAD.size + length
            if code not in (SCHEMA, CHANNEL, MESSAGE) or end > len(data):
                break
            yield code, data[at + RECORD_HEAD.size : end]
            at = end
        if at < len(data):
            self._amiss("damaged", "a chunk holds what is no message: the rest of it", len(data) - at)

    def _amiss(self, kind: str, message: str, count: int) -> None:
        self.notes.append(Note(kind, f"{message}, {count} bytes, is left out", count))
