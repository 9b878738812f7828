# SPDX-License-Identifier: Apache-2.0
"""The records of an MCAP file from any program, in order, also if the file is truncated or damaged; no chunk is
unpacked to more than its stated size or ``MAX_RECORD_BYTES``."""

import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

from ...errors import InputError
from ...files import MCAP, open_regular, unpacked_limit
from ..recording import Note

MAX_RECORD_BYTES = 64 << 20  # bytes of one record, packed or not; chunks of recorders have a few MiB
_PIECE_BYTES = 1 << 20
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, METADATA = 0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x0C
_READ = (SCHEMA, CHANNEL, MESSAGE, CHUNK, METADATA)
RECORD_HEAD = struct.Struct("<BQ")


class NotUnpacked(ValueError):
    """A chunk cannot be unpacked; the message gives the reason."""


def unpacked(chunk: Any) -> bytes:
    """The bytes of an ``mcap.records.Chunk``: uncompressed, lz4 or zstd. Raises NotUnpacked."""
    if chunk.uncompressed_size > MAX_RECORD_BYTES:
        raise NotUnpacked(f"its stated size is more than {MAX_RECORD_BYTES >> 20} MiB")
    decompressors = {"": _plain, "lz4": _lz4, "zstd": _zstd}
    if chunk.compression not in decompressors:
        raise NotUnpacked(f"unknown compression {chunk.compression[:20]!r}")
    data = decompressors[chunk.compression](chunk.data, chunk.uncompressed_size)
    if len(data) != chunk.uncompressed_size:
        raise NotUnpacked("its size differs from the stated size")
    return data


def _plain(data: bytes, _: int) -> bytes:
    return data


def _zstd(data: bytes, size: int) -> bytes:
    import zstandard

    try:
        reader = zstandard.ZstdDecompressor(max_window_size=MAX_RECORD_BYTES).stream_reader(
            data, read_across_frames=True
        )
        return _read(lambda limit: reader.read(limit), size)
    except zstandard.ZstdError as error:
        raise NotUnpacked(str(error)) from None


def _lz4(data: bytes, size: int) -> bytes:
    from lz4.frame import LZ4FrameDecompressor

    decompressor, left = LZ4FrameDecompressor(), [data]

    def read_next(limit: int) -> bytes:
        return b"" if decompressor.eof else decompressor.decompress(left.pop() if left else b"", max_length=limit)

    try:
        return _read(read_next, size)
    except (RuntimeError, EOFError) as error:
        raise NotUnpacked(str(error)) from None


def _read(read_next: Callable[[int], bytes], size: int) -> bytes:
    """Up to one byte more than ``size``, piece by piece, because the stated size may be wrong."""
    pieces, length = [], 0
    while length <= size:
        piece = read_next(min(_PIECE_BYTES, size + 1 - length))
        if not piece:
            break
        pieces.append(piece)
        length += len(piece)
    return b"".join(pieces)


@dataclass
class RecordReader:
    """Reads the records of a file in order; ``complete`` is whether the file was closed, ``notes`` list its faults."""

    path: Path
    complete: bool = False
    notes: list[Note] = field(default_factory=list)

    def records(self) -> Iterator[tuple[int, bytes]]:
        """Operation code and content of schemas, channels, messages and metadata, inside and outside of chunks.

        Raises InputError for a file that is not MCAP; ``notes`` list what is left out and why reading ended early.
        """
        try:
            with open_regular(self.path) as file:
                size = file.seek(0, 2)
                file.seek(0)
                if file.read(len(MCAP)) != MCAP:
                    limit, advice = "its first bytes differ", "Check the name, and whether the recording was started."
                    raise InputError("file", "not an MCAP file", limit, str(self.path), advice)
                self._left = unpacked_limit(size)
                yield from self._walk(file, size)
        except OSError as error:
            step = "Check the disk or the network, or copy the file."
            raise InputError("file", "not readable", error.strerror or "", str(self.path), step) from None

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
            self._left_out("cut_off", f"the file is truncated or damaged at byte {at}: the remainder", size - at)

    def _record(self, code: int, length: int, file: BinaryIO) -> Iterator[tuple[int, bytes]]:
        if code not in _READ:
            return
        if length > MAX_RECORD_BYTES:
            self._left_out("left_out", f"a record is longer than {MAX_RECORD_BYTES >> 20} MiB: its content", length)
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
                raise NotUnpacked("the unpacked chunks of the file are larger than any recording")
            data = unpacked(chunk)
            if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
                raise NotUnpacked("its checksum differs")
        except (McapError, NotUnpacked, OverflowError, struct.error, ValueError) as error:
            reason = str(error)[:80] or "not a chunk"
            self._left_out("damaged", f"a chunk is damaged ({reason}): its content", len(record))
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
            self._left_out("damaged", "a chunk contains an invalid record: its remainder", len(data) - at)

    def _left_out(self, kind: str, message: str, count: int) -> None:
        self.notes.append(Note(kind, f"{message}, {count} bytes, is left out", count))
