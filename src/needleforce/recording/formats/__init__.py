# SPDX-License-Identifier: Apache-2.0
"""Formats of files. Each is declared in the module here that reads it; ``detect`` knows the modules."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..table import Table

BYTES_PER_S = 16e6  # the slowest at which the limited process may read


@dataclass(frozen=True, kw_only=True)
class Format:
    """A format of files, recognised by its content; one of ``starts``, ``member`` and ``matches`` states how.

    Parameters
    ----------
    name : str
        Its name in messages.
    suffixes : tuple of str
        The usual endings of its files, such as ``".h5"``.
    starts : tuple of bytes
        First bytes, one of which its files have.
    member : bytes
        What a file in it is called, in part, if it is a zip archive.
    matches : callable, optional
        The first 64 KiB of a file -> whether it is of this format.
    tables : callable, optional
        Path -> the tables of a file; a function of the module, as the limited process calls it by its name.
    limited : bool
        Whether the limited process of ``worker`` reads it: for libraries that a damaged file can crash, or keep busy.
    bytes_per_s : float
        The slowest at which that process may read a large file.
    package : str
        The package that reads it, if needleforce does not bring it.
    extra : str
        The extra of needleforce which has that package.
    log : bool
        Whether it has messages with topics instead of tables.
    advice : str
        How to export it, for a format that is recognised and not read.
    """

    name: str
    suffixes: tuple[str, ...] = ()
    starts: tuple[bytes, ...] = ()
    member: bytes = b""
    matches: Callable[[bytes], bool] | None = None
    tables: "Callable[[Path], Sequence[Table]] | None" = None
    limited: bool = False
    bytes_per_s: float = BYTES_PER_S
    package: str = ""
    extra: str = ""
    log: bool = False
    advice: str = ""
