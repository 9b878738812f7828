# SPDX-License-Identifier: Apache-2.0
"""Formats of files. Each is a row in ``detect``, and a module here that reads it."""

from collections.abc import Callable
from dataclasses import dataclass

BYTES_PER_S = 16e6  # the slowest at which the limited process may read


@dataclass(frozen=True, kw_only=True)
class Format:
    """A format of files, recognised by its content; one of ``starts``, ``member`` and ``matches`` states how.

    Parameters
    ----------
    module : str
        The module that reads it, such as ``".hdf5"``: its function ``tables`` takes a path, and gives the tables of a
        file. It is imported for a file of this format alone.
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

    module: str = ""
    name: str
    suffixes: tuple[str, ...] = ()
    starts: tuple[bytes, ...] = ()
    member: bytes = b""
    matches: Callable[[bytes], bool] | None = None
    limited: bool = False
    bytes_per_s: float = BYTES_PER_S
    package: str = ""
    extra: str = ""
    log: bool = False
    advice: str = ""
