# SPDX-License-Identifier: Apache-2.0
"""What stands at the two ends of a log of ours, without the samples between them."""

import struct
from io import BytesIO
from pathlib import Path

from ...errors import InputError
from ..formats import MCAP
from .mcap_records import METADATA, RECORD_HEAD
from .writer import CARD, END

_LARGEST = 1 << 20  # bytes of a card


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
