# SPDX-License-Identifier: Apache-2.0
"""Waves of Igor Pro (ibw) by igor2: a column each, the time from their scale; force curves of Asylum Research with
force and depth of the tip."""

import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..recording import Note
from ..table import Table
from .arrays import Array, FileArrays, clean, orientation, reading, vector
from .jpk import TIP

_FORMAT = "an Igor wave (ibw)"
_DEFLECTIONS, _HEIGHTS = ("Defl", "Deflection"), ("ZSnsr", "ZSensor", "Raw")  # of Asylum's force curves [m]
_SPRING = "SpringConstant"
_HEADER_BYTES = {2: 126, 5: 384}  # version -> bytes of which 16-bit words add up to zero
_MAX_NOTES = 200  # lines of the note of a wave


def tables(path: Path) -> list[Table]:
    """The wave of a file: its columns with their labels, and a time if its scale is in seconds.

    A force curve of Asylum Research also has the force, from deflection and spring constant, and the position of the
    tip. Raises InputError for a damaged file, and a wave of text or of complex numbers.
    """
    from igor2 import binarywave

    found = FileArrays(path=path, format=_FORMAT, header=lambda name, k: f"{name}[{k}]")
    with reading(path, _FORMAT):
        wave = binarywave.load(str(path))["wave"]
        facts = _facts(wave["note"])
        arrays, bending = _arrays(wave, facts)
        found.add("", arrays, list(facts.items())[:_MAX_NOTES])
    finished = found.finish()
    if bending:
        finished[0].notes.append(Note("computed", TIP.format(bending)))
    return finished


def _arrays(wave: Mapping[str, Any], facts: Mapping[str, str]) -> tuple[list[Array], float]:
    """The columns of a wave, and the spring constant [N/m] of a force curve, 0 of another wave."""
    header, values = wave["wave_header"], np.asarray(wave["wData"])
    rows, columns, transposed = orientation(values.shape) or (0, 0, False)
    if values.dtype.kind not in "iuf" or not rows:
        raise ValueError(f"a wave of numbers with few columns is needed, it has {values.dtype} {values.shape}")
    flat = values.reshape(rows, columns) if not transposed else values.reshape(columns, rows).T
    stated = wave.get("labels") or [[], []]  # none in old files
    labels = [clean(_text(each)) for each in stated[0 if transposed else 1][1:]]
    name, unit = clean(_text(header["bname"])) or "wave", _unit(wave.get("data_units"), header.get("dataUnits"))
    names = labels if len(labels) == columns else [name] if columns == 1 else [f"{name}[{k}]" for k in range(columns)]
    arrays = [vector(names[k], flat[:, k].astype(float), unit) for k in range(columns)]
    step = float(np.ravel(header["sfA"] if "sfA" in header else header["hsA"])[0])
    time = [vector("time", step * np.arange(rows), "s")] if step > 0.0 and _time_unit(wave, header) == "s" else []
    force, bending = _force(names, flat, facts)
    return [*time, *force, *arrays], bending


def _force(names: list[str], values: np.ndarray, facts: Mapping[str, str]) -> tuple[list[Array], float]:
    """Force and tip position of a force curve of Asylum Research; none of another wave."""
    deflection = next((names.index(each) for each in _DEFLECTIONS if each in names), None)
    height = next((names.index(each) for each in _HEIGHTS if each in names), None)
    if deflection is None or height is None or _SPRING not in facts:
        return [], 0.0
    stiffness, bent = float(facts[_SPRING]), values[:, deflection].astype(float)
    tip = values[:, height].astype(float) - bent
    return [vector("force", stiffness * bent, "N"), vector("tip position", tip, "m")], stiffness


def _facts(note: bytes) -> dict[str, str]:
    """Names and values in the note of a wave."""
    lines = _text(note).replace("\n", "\r").split("\r")
    pairs = (line.partition(":") for line in lines if ":" in line)
    return {clean(key.strip()): clean(value.strip()) for key, _, value in pairs if value.strip()}


def _time_unit(wave: Mapping[str, Any], header: Mapping[str, Any]) -> str:
    units = header.get("dimUnits", header.get("xUnits"))
    first = np.asarray(units)[0] if np.ndim(units) > 1 else units
    return _unit(wave.get("dimension_units"), first)


def _unit(extended: Any, short: Any) -> str:
    """A unit that a wave states, in its header or, if it is long, after it."""
    return clean(_text(extended)) or clean("".join(map(_text, np.ravel(short))))


def _text(value: Any) -> str:
    return value.decode("latin-1").strip("\0 ") if isinstance(value, bytes) else "" if value is None else str(value)


def is_wave(start: bytes) -> bool:
    """Whether a file begins with the header of a wave, whose checksum is zero."""
    for order in "<>":
        version = struct.unpack_from(f"{order}h", start)[0] if len(start) > 1 else 0
        size = _HEADER_BYTES.get(version, 0)
        if size and len(start) > size and any(start[2:size]):
            return sum(struct.unpack_from(f"{order}{size // 2}h", start)) % 2**16 == 0
    return False
