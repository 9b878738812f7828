# SPDX-License-Identifier: Apache-2.0
"""A chunk's content, and never more of it than it says, nor than ``LARGEST``: what unpacks without end is stopped."""

LARGEST = 64 << 20  # bytes of one record, packed or not: recorders' chunks are of one to some MiB
_AT_ONCE = 1 << 20


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
