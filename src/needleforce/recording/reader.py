# SPDX-License-Identifier: Apache-2.0
"""``read`` and ``read_all``: from files to recordings."""

import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..files import enough_memory
from .card import Preamble
from .formats.detect import format_of, tables_of
from .options import ReadOptions, keywords_of
from .recording import Recording
from .recording_file import open_file

if TYPE_CHECKING:
    from .look import Look


@keywords_of(ReadOptions)
def read(path: str | os.PathLike, options: ReadOptions) -> "Recording | Look":
    """Read a recording from a file of any format: text, Excel, Parquet, MATLAB, HDF5, TDMS, NumPy, JSON, MCAP, bags.

    The format is detected from the first bytes. A table of text may have anything above it, a row of units, any common
    delimiter, decimal sign and encoding, and need not have headers.

    Parameters
    ----------
    path : str or os.PathLike
        The file, or the folder of a bag.
    options : ReadOptions
        The keywords.

    Returns
    -------
    Recording
        Arrays in SI. ``card.assumptions`` lists what was assumed, ``notes`` what was found. With ``dry_run`` a
        ``Look``, which prints itself.

    Raises
    ------
    InputError
        The file cannot be read as a recording; the message names the line if there is one.
    """
    return read_file(path, options)


def read_file(path: str | os.PathLike, options: ReadOptions) -> "Recording | Look":
    """As ``read``, with the options as one value."""
    if not options.dry_run:
        return open_file(path, options).read(options.part)[0]
    from .look import look

    with enough_memory(path):
        return look(path, options)


@keywords_of(ReadOptions)
def read_all(path: str | os.PathLike, options: ReadOptions) -> "list[Recording | Look]":
    """Every recording of a file, in its order, or those that ``part`` stands for, with ``*`` for any text: ``"B*"``;
    ``"cycle *"`` stands for every cycle of each recording.

    Parameters
    ----------
    path : str or os.PathLike
        The file.
    options : ReadOptions
        The keywords.

    Returns
    -------
    list of Recording

    Raises
    ------
    InputError
        As ``read``, for the first part that cannot be read.
    """
    opened = open_file(path, options)
    chosen = [part for part, _ in opened.chosen()]
    if options.dry_run:
        return [read_file(path, replace(options, part=part)) for part in chosen]
    return [opened.read(part)[0] for part in chosen]


def card_texts(path: Path, keys: tuple[str, ...]) -> dict[str, str]:
    """The entries with these ``keys`` in the card of a file of any format. Raises InputError if it cannot be read."""
    if format_of(path).log:
        from .log.reader import card_and_end

        card = card_and_end(path)[0] if path.is_file() else {}  # the folder of a bag has no card
        return {key: card[key] for key in keys if card.get(key)}
    with enough_memory(path):
        preamble = Preamble(tables_of(path)[0].comments, str(path))
    return {key: preamble.text(key) for key in keys if preamble.text(key)}
