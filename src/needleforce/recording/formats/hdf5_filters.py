# SPDX-License-Identifier: Apache-2.0
"""Which datasets of HDF5 are read: stored in the file itself, by filters that unpack to no more than is stated."""

import zlib
from pathlib import Path
from typing import Any

from ...errors import InputError
from ...files import unpacked_limit
from .arrays import check_size, size_of

_CHECKED_CHUNK_BYTES = 1 << 16  # packed: deflate makes at most 1032 times as much of a smaller one, 64 MiB
_DEFLATE, _SHUFFLE, _CHECKSUM, _SZIP, _NBIT, _SCALE_OFFSET, _LZF = 1, 2, 3, 4, 5, 6, 32000
_FILTERS = {_DEFLATE, _SHUFFLE, _CHECKSUM, _SZIP, _NBIT, _SCALE_OFFSET, _LZF}
_COMPRESSING = {_DEFLATE, _SZIP, _NBIT, _SCALE_OFFSET, _LZF}


def refusal(dataset: Any) -> str:
    """Why a dataset is not read, empty for one that is."""
    plan = dataset.id.get_create_plist()
    if dataset.is_virtual:
        return "a virtual dataset, whose values may be in other files"
    if plan.get_external_count():
        return "its values are in another file"
    filters = [plan.get_filter(number) for number in range(plan.get_nfilters())]
    for number, _, _, name in filters:
        if number not in _FILTERS:
            shown = name.decode("utf-8", "replace") if name else f"number {number}"
            return f"the filter {shown} needs a plugin; h5repack -f GZIP=4 OLD NEW writes it without"
    numbers = [each[0] for each in filters]
    if len(set(numbers)) < len(numbers) or len(_COMPRESSING & set(numbers)) > 1:
        return "compressed more than once"
    return ""


def check_chunks(dataset: Any, path: Path) -> None:
    """Raise InputError for a chunk that unpacks to more than its size, which the library does without a limit."""
    if dataset.chunks is None:
        return
    size = size_of(dataset.chunks, dataset.dtype.itemsize)
    check_size(size, unpacked_limit(path.stat().st_size), path)
    if dataset.compression != "gzip":
        return
    for number in range(dataset.id.get_num_chunks()):
        info = dataset.id.get_chunk_info(number)
        if info.size > max(_CHECKED_CHUNK_BYTES, size // 1000):
            packed = dataset.id.read_direct_chunk(info.chunk_offset)[1]
            stream = zlib.decompressobj()
            if len(stream.decompress(packed, size + 1)) > size and not stream.eof:
                raise InputError("size of a chunk", "larger than stated", "", str(path), "Check the file.")
