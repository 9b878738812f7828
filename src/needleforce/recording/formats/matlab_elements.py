# SPDX-License-Identifier: Apache-2.0
"""The elements of a MATLAB 5 file, measured before scipy sees them: it unpacks without a limit, takes the types of
elements as addresses, and reads beyond the end of an array that lacks a part.

Only tags and heads are looked at (MATLAB's "MAT-File Format", chapter 1); values are read by scipy alone.
"""

import struct
import zlib
from io import BytesIO
from math import prod
from pathlib import Path
from typing import BinaryIO

from ...files import MAX_SAMPLES, unpacked_limit
from .arrays import check_count, check_size

_HEAD_BYTES, _TAG_BYTES, _FLAGS_BYTES = 128, 8, 8
_UINT32, _MATRIX, _COMPRESSED = 6, 14, 15  # types of elements
_DATA_TYPES = {1, 2, 3, 4, 5, 6, 7, 9, 12, 13, 16, 17, 18}
_CELL, _STRUCT, _OBJECT, _TEXT, _SPARSE, _FUNCTION, _OPAQUE = 1, 2, 3, 4, 5, 16, 17  # classes of arrays
_COMPLEX = 0x800  # flag of an array
_PARTS = {_CELL: 0, _STRUCT: 2, _OBJECT: 3, _SPARSE: 3, _FUNCTION: 0}  # elements of values after the head; others 1
_MAX_ARRAYS = 1 << 18  # of a file, the empty ones included: each takes some 100 bytes in memory
_MAX_SIDES = 32  # of an array
_MAX_DEPTH = 64  # arrays within each other: scipy calls itself for each
_MAX_CHARS = 1 << 20  # of a text
_BLOCK_BYTES = 1 << 16
_KEPT_BYTES = 256  # of an element of a head


def check_elements(content: bytes, path: Path) -> None:
    """Measure the elements of a MATLAB 5 file.

    Raises InputError for elements that unpack beyond the limit, for more arrays than any recording has, and for arrays
    whose stated shape is larger than that of any recording; ValueError for an array that lacks a part.
    """
    if len(content) < _HEAD_BYTES or 0 in content[:4]:  # MATLAB 4: without compression, each array as long as its data
        return
    order = "<" if content[126:128] == b"IM" else ">"
    measured = _Measured(unpacked_limit(len(content)), order, path)
    at = _HEAD_BYTES
    while at + _TAG_BYTES <= len(content):
        kind, size = struct.unpack_from(f"{order}II", content, at)
        begin = at + _TAG_BYTES
        if kind == _COMPRESSED:
            measured.walk(_Unpacked(content[begin : begin + size]))
        else:
            measured.walk(BytesIO(content[at : begin + size]))
        at = begin + size


class _Unpacked:
    """A stream of the unpacked bytes of an element."""

    def __init__(self, packed: bytes):
        self._object, self._packed, self._ready = zlib.decompressobj(), packed, b""

    def read(self, size: int) -> bytes:
        """The next bytes, fewer at the end."""
        while len(self._ready) < size:
            block = self._object.decompress(self._packed, _BLOCK_BYTES)
            self._packed = self._object.unconsumed_tail
            if not block:
                break
            self._ready += block
        found, self._ready = self._ready[:size], self._ready[size:]
        return found


class _Measured:
    """Walks through arrays and counts their bytes; arrays within cells and structs follow directly, so that those of
    all levels are one sequence."""

    def __init__(self, limit: int, order: str, path: Path):
        self._limit, self._order, self._path = limit, order, path
        self._arrays = self._size = 0

    def walk(self, stream: BinaryIO | _Unpacked) -> None:
        """Walk through one array of the workspace and those within it."""
        self._stream = stream
        expected = [1]  # of each array within the other, how many are still to come
        while expected:
            if not expected[-1]:
                expected.pop()
                continue
            expected[-1] -= 1
            expected.append(self._array())
            check_count("arrays", self._arrays + expected[-1], _MAX_ARRAYS, self._path)
            if len(expected) > _MAX_DEPTH:
                raise ValueError(f"more than {_MAX_DEPTH} arrays within each other")

    def _array(self) -> int:
        """Pass the head and values of one array; returns how many arrays follow that belong to it."""
        kind, size, _ = self._tag()
        if kind != _MATRIX:
            raise ValueError(f"an element of the type {kind} instead of an array")
        self._arrays += 1
        if size == 0:
            return 0
        kind, size, _ = self._tag()
        if (kind, size) != (_UINT32, _FLAGS_BYTES):
            raise ValueError("an array without flags")
        (flags,) = struct.unpack_from(f"{self._order}I", self._bytes(_FLAGS_BYTES))
        number = flags & 0xFF
        if not _CELL <= number <= _OPAQUE:
            raise ValueError(f"an array of the class {number}")
        if number == _OPAQUE:  # it has three texts instead of a shape and a name
            for _ in range(3):
                self._element()
            return 1
        shape, size = self._element()
        if size % 4 or not 2 <= size // 4 <= _MAX_SIDES:
            raise ValueError(f"an array with a shape of {size} bytes")
        count = prod(struct.unpack(f"{self._order}{size // 4}I", shape))
        limits = {_CELL: _MAX_ARRAYS, _STRUCT: _MAX_ARRAYS, _OBJECT: _MAX_ARRAYS, _TEXT: _MAX_CHARS}
        check_count("values in an array", count, limits.get(number, 16 * MAX_SAMPLES), self._path)
        self._element()  # the name
        return self._values(number, count, is_complex=bool(flags & _COMPLEX))

    def _values(self, number: int, count: int, is_complex: bool) -> int:
        parts = _PARTS.get(number, 1) + (is_complex and number not in (_CELL, _STRUCT, _OBJECT, _TEXT, _FUNCTION))
        elements = [self._element() for _ in range(parts)]
        if number in (_STRUCT, _OBJECT):  # the last two are the length of a name, and the names of the fields
            (length,) = struct.unpack_from(f"{self._order}i", elements[-2][0].ljust(4, b"\0"))
            if length < 1:
                raise ValueError("fields without names")
            return count * (elements[-1][1] // length)
        return {_CELL: count, _FUNCTION: 1}.get(number, 0)

    def _element(self) -> tuple[bytes, int]:
        """The first bytes of an element that is no array, and its size."""
        kind, size, small = self._tag()
        if kind not in _DATA_TYPES:
            raise ValueError(f"an element of the type {kind}")
        if small is not None:
            return small, size
        padded = size + -size % 8
        found = self._bytes(min(padded, _KEPT_BYTES))
        left = padded - len(found)
        while left > 0:
            left -= len(self._bytes(min(left, _BLOCK_BYTES)))
        return found[:size], size

    def _tag(self) -> tuple[int, int, bytes | None]:
        """Type and size of the next element, and its content if that is part of the tag."""
        tag = self._bytes(_TAG_BYTES)
        kind, size = struct.unpack(f"{self._order}II", tag)
        if not kind >> 16:
            return kind, size, None
        kind, size = kind & 0xFFFF, kind >> 16
        if size > 4 or kind == _MATRIX:
            raise ValueError("a short element of more than four bytes")
        return kind, size, tag[4 : 4 + size]

    def _bytes(self, size: int) -> bytes:
        found = self._stream.read(size)
        if len(found) < size:
            raise ValueError("an array ends within its values")
        self._size += size
        check_size(self._size, self._limit, self._path)
        return found
