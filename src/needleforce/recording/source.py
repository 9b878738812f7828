# SPDX-License-Identifier: Apache-2.0
"""A recording from what a user has at hand: a recording, a file, a DataFrame, named columns or arrays."""

import os
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from ..errors import InputError
from .options import ReadOptions
from .parts import part_of
from .reader import read, recording_from_table
from .recording import Recording
from .table import named_columns

RecordingSource: TypeAlias = Any
"""A Recording, a path, a pandas DataFrame, a mapping of columns, or (time, depth, force) in SI."""

TAKEN = "a Recording, a path, a pandas DataFrame, a mapping of columns, or arrays (time, depth, force)"


def recording_of(source: RecordingSource) -> Recording:
    """A recording, read or built where needed.

    Parameters
    ----------
    source : Recording, path, pandas.DataFrame, mapping or tuple of arrays
        A file is read by ``nf.read``. Columns of a DataFrame or of a mapping have names with units, as in a CSV file
        (``"Force [N]"``, ``"depth_mm"``). Arrays are (time [s], depth [m], force [N]), (n,) each.

    Returns
    -------
    Recording

    Raises
    ------
    InputError
        For another type, and for all that makes no recording of the data.
    """
    if isinstance(source, Recording):
        return source
    if isinstance(source, str | os.PathLike):
        return read(source)
    if (hasattr(source, "iloc") and hasattr(source, "columns")) or isinstance(source, Mapping):
        columns = source if hasattr(source, "iloc") else dict(source)
        return recording_from_table(part_of(named_columns(columns), {}), ReadOptions())[0]
    if is_arrays(source):
        return Recording(time=source[0], depth=source[1], force=source[2])
    raise InputError("recording", type(source).__name__, f"taken are {TAKEN}", next_step="See nf.read for files.")


def is_arrays(source: Any) -> bool:
    """True for (time, depth, force): three sequences of numbers, and no sequence of recordings."""
    if not isinstance(source, tuple) or len(source) != 3:
        return False
    return all(isinstance(each, np.ndarray | Sequence) and not isinstance(each, str) for each in source)


def recordings_of(sources: Any) -> list[Recording]:
    """One recording or several, each from any source.

    Parameters
    ----------
    sources : source or sequence of sources
        As in ``recording_of``; a list or tuple holds repeats, but for a tuple of three arrays, which is one recording.

    Returns
    -------
    list of Recording

    Raises
    ------
    InputError
        As ``recording_of``; of several, with the place in the sequence.
    """
    several = isinstance(sources, list | tuple) and not is_arrays(sources)
    if not several:
        return [recording_of(sources)]
    found = []
    for k, each in enumerate(sources):
        try:
            found.append(recording_of(each))
        except InputError as error:
            raise error if error.place else error.at(f"recordings[{k}]") from None
    return found
