# SPDX-License-Identifier: Apache-2.0
"""Force curves of Nanosurf instruments (nid) by NSFopen: a recording a curve, forward, pause and backward one after the
other."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from ...files import check_count
from ..recording import Note
from ..table import Table
from .arrays import MAX_TABLES, FileArrays, clean, reading, vector
from .jpk import TIP

_FORMAT = "a Nanosurf file (nid)"
# names of a phase in the data and in the header, and of its duration
_PHASES = (("Forward", "Spec forward", "modFw"), ("Forward Pause", "Spec fwd pause", "pauseFw"),
           ("Backward", "Spec backward", "modBw"), ("Backward Pause", "Spec bwd pause", "pauseBw"))  # fmt: skip
_EXPORT = "In Nanosurf's software, export the curves as CSV or ASCII text."
_DEFLECTION, _HEIGHTS = "Deflection", ("Z-Axis Sensor", "Z-Axis")


def tables(path: Path) -> list[Table]:
    """The force curves of a file: time, channels with their units, and for a deflection in newtons the position of the
    tip. Raises InputError for a damaged file, and one with images alone."""
    from NSFopen.read.read import nid_read

    found = FileArrays(path=path, format=_FORMAT, header=lambda name, _: name)
    with reading(path, _FORMAT, _EXPORT):
        file = nid_read(str(path))
        data = file.data["Spec"] if "Spec" in file.data.index.get_level_values(0) else {}
        phases = [each for each in _PHASES if each[0] in data]
        if not phases:
            raise InputError("file", _FORMAT, "it has images, and no force curves", str(path), "Name another file.")
        frames, stiffness = _frames(file.param["HeaderDump"]), _stiffness(file.param["Tip"])
        points = {name: frame["points"] for name, frame in frames.items()}
        count = len(next(iter(data[phases[0][0]])))
        check_count("curves", count, MAX_TABLES, path)
        for number in range(count):
            columns = _joined(data, phases, file.param["Spec"], points, number)
            name = f"curve {number + 1}" if count > 1 else ""
            _add_curve(found, name, columns, frames[phases[0][1]]["units"], stiffness)
    return found.finish()


def _frames(header: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Name of a frame of force curves -> its number of points, and the unit of each channel."""
    frames: dict[str, dict[str, Any]] = {}
    for key, stated in header.items():
        if str(key).startswith("DataSet-") and {"Frame", "Points", "Dim2Name"} <= set(stated.keys()):
            frame = frames.setdefault(stated["Frame"], {"points": int(stated["Points"]), "units": {}})
            frame["units"][stated["Dim2Name"]] = clean(stated.get("Dim2Unit", ""))
    return frames


def _stiffness(probe: Mapping[str, Any]) -> float:
    """The spring constant of the cantilever [N/m], NaN if it is not stated."""
    values = [probe[key] for key in probe.keys() if isinstance(probe[key], Mapping)]
    return next((float(each["Value"]) for each in values if each.get("Unit") == "N/m"), float("nan"))


def _joined(data: Mapping, phases: Sequence, spec: Mapping[str, Any], points: Mapping[str, int], number: int) -> dict:
    """Time and channels of a curve, with all phases in their order in time."""
    parts: list[dict[str, np.ndarray]] = []
    time = 0.0
    for phase, frame, duration in phases:
        part = {name: np.asarray(data[phase][name][number], float) for name in data[phase].keys()}
        rows = min(len(each) for each in part.values())
        step = float(spec[duration]["Value"]) / points[frame]
        part = {"time": time + step * np.arange(rows), **{name: each[:rows] for name, each in part.items()}}
        parts.append(_in_order(part, parts[-1] if parts else None))
        time += step * rows
    return {name: np.concatenate([each[name] for each in parts]) for name in parts[0] if all(name in p for p in parts)}


def _in_order(part: dict[str, np.ndarray], before: Mapping[str, np.ndarray] | None) -> dict[str, np.ndarray]:
    """The channels of a phase from where the one before ended: a way back may be stored by increasing height."""
    height = next((name for name in _HEIGHTS if name in part), None)
    if before is None or height is None or not len(part[height]):
        return part
    first, last = np.abs(part[height][[0, -1]] - before[height][-1])
    return part if first <= last else {name: v if name == "time" else v[::-1] for name, v in part.items()}


def _add_curve(
    found: FileArrays, name: str, columns: Mapping[str, np.ndarray], units: Mapping[str, str], stiffness: float
) -> None:
    """Add the table of a curve; a deflection in newtons is a force."""
    units = {"time": "s"} | dict(units)
    is_force = units.get(_DEFLECTION) == "N"
    arrays = [
        vector("force" if is_force and each == _DEFLECTION else each, values, units.get(each, ""))
        for each, values in columns.items()
    ]
    height = next((each for each in _HEIGHTS if each in columns and units.get(each) == "m"), None)
    if is_force and height and np.isfinite(stiffness):
        arrays.insert(1, vector("tip position", columns[height] - columns[_DEFLECTION] / stiffness, "m"))
    found.add(name, arrays, [("spring constant", f"{stiffness:g} N/m")] if np.isfinite(stiffness) else [])
    if len(arrays) > len(columns):
        found.tables[-1].notes.append(Note("computed", TIP.format(stiffness)))
