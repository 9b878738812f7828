# SPDX-License-Identifier: Apache-2.0
"""Force curves of JPK instruments (Bruker) by afmformats: a recording a curve, with the depth of the tip."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...files import check_count, open_regular, unpacked_limit
from ..recording import Note
from ..table import Table
from .arrays import MAX_TABLES, Array, FileArrays, check_size, reading

_FORMAT = "a JPK force curve"
_HEIGHTS = ("height (measured)", "height (piezo)")  # the surest first
_FACTS = ("spring constant", "sensitivity", "imaging mode", "instrument", "software version", "date", "setpoint")
_EXPORT = "In JPK Data Processing, export it as text (.txt); a batch does many at once."
TIP = "the tip position is the height of the probe corrected by its bending, force over {:g} N/m"


def tables(path: Path) -> list[Table]:
    """The curves of a JPK file, with approach, pause and retract one after the other: time, force, tip position and
    height. Raises InputError for a damaged file, and one whose force is not calibrated."""
    from afmformats.errors import MissingMetaDataError
    from afmformats.formats.fmt_jpk import load_jpk

    found = FileArrays(path=path, format=_FORMAT, header=lambda name, _: name)
    with reading(path, _FORMAT, _EXPORT):
        _check_unpacked(path)
        try:
            curves = load_jpk(path)
        except MissingMetaDataError as error:
            raise _not_calibrated(path) from error
        check_count("curves", len(curves), MAX_TABLES, path)
        for number, curve in enumerate(curves, 1):
            _add_curve(found, f"curve {number}" if len(curves) > 1 else "", curve)
    return found.finish()


def _check_unpacked(path: Path) -> None:
    """Raise InputError for an archive that is far larger unpacked, and as numbers of 8 bytes, of 2 in the file."""
    from zipfile import ZipFile

    with open_regular(path) as file, ZipFile(file) as archive:
        size = sum(each.file_size for each in archive.infolist())
    check_size(4 * size, unpacked_limit(path.stat().st_size), path)


def _not_calibrated(path: Path) -> InputError:
    step = "Calibrate the cantilever in JPK Data Processing, and save the curve again."
    return InputError("spring constant", "missing", "the force is its product with the deflection", str(path), step)


def _checked(values: np.ndarray, rows: int) -> np.ndarray:
    if len(values) != rows:
        raise ValueError(f"{len(values)} samples, {rows} are stated")
    return np.asarray(values)


def _has(data: Mapping[str, np.ndarray], column: str) -> bool:
    """Whether a curve has a column, which the library knows only when it reads it."""
    from afmformats.formats.fmt_jpk.jpk_data import ReadJPKError

    try:
        return len(data[column]) > 0
    except ReadJPKError:
        return False


def _add_curve(found: FileArrays, name: str, curve: dict) -> None:
    """Add the table of a curve, whose values are computed when they are used."""
    data, facts = curve["data"], curve["metadata"]
    stiffness, rows = float(facts["spring constant"]), int(facts["point count"])
    height = next(each for each in _HEIGHTS if _has(data, each))
    read = {
        ("time", "s"): lambda: data["time"],
        ("force", "N"): lambda: data["force"],
        ("tip position", "m"): lambda: data[height] + data["force"] / stiffness,
        ("height", "m"): lambda: data[height],
        ("segment", ""): lambda: data["segment"],
    }
    arrays = [
        Array(name=column, rows=rows, units=[unit], read=lambda _, values=values: _checked(values(), rows))
        for (column, unit), values in read.items()
    ]
    found.add(name, arrays, [(key, facts[key]) for key in _FACTS if key in facts])
    found.tables[-1].notes.append(Note("computed", TIP.format(stiffness)))
