# SPDX-License-Identifier: Apache-2.0
"""The files of the page: its own, the core as WebAssembly, and one with all laws, tips and presets from the core's
tables. Each is read once and then found by its name alone."""

import json
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..display.quantities import scale
from ..errors import InputError
from ..export import by_name
from ..files import atomic_write, json_safe, read_bytes
from ..mechanics.buckling import equivalent_half_angle
from ..models.laws import FAMILIES, laws_of
from ..models.model import Layer, Model
from ..preset_files.build import needle_lines
from ..preset_files.presets import preset, presets
from ..preset_files.schema import EQUIVALENCES, si_key, tips
from ..vocabulary import __version__
from .planning import MAX_OBSTACLES
from .solid_example import SOLID, SOLID_FILE, SOLID_TITLE, solid_example
from .steering_presets import steering_presets

PAGE = Path(__file__).with_name("page")
CORE = Path(__file__).with_name("core")
CORE_FILES = ("needleforce.wasm", "needleforce.mjs", "pieces.mjs", "online.mjs")
TABLES = "tables.json"
TYPES = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".mjs": "text/javascript; charset=utf-8",
    ".json": "application/json",
    ".wasm": "application/wasm",
    ".svg": "image/svg+xml",
}
MAX_LAYERS = 8  # as model.js
MIN_STROKE, MAX_STROKE = 12e-3, 60e-3  # [m] depth to which the page inserts a needle by itself


def page_files(core: Path = CORE) -> dict[str, bytes]:
    """Every file of the page by its name, such as ``index.html`` or ``core/needleforce.wasm``.

    Parameters
    ----------
    core : Path
        Folder with the core as WebAssembly, as ``make wasm`` writes it.

    Raises
    ------
    InputError
        If the core was not compiled for WebAssembly when this installation was made.
    """
    if missing := [name for name in CORE_FILES if not (core / name).is_file()]:
        limit = "this installation was made without the core for WebAssembly"
        step = "Install a wheel, or run make wasm in the folder with README.md."
        raise InputError("studio", f"without {missing[0]}", limit, next_step=step)
    files = {path.name: read_bytes(path, "page") for path in sorted(PAGE.iterdir()) if path.suffix in TYPES}
    files |= {f"core/{name}": read_bytes(core / name, "core") for name in CORE_FILES}
    return files | {TABLES: json.dumps(json_safe(tables()), separators=(",", ":")).encode()}


def write_static(folder: str | os.PathLike, core: Path = CORE) -> list[Path]:
    """Write the page into a folder, from which any web server serves it.

    Parameters
    ----------
    folder : str or path
        Folder to write to; made if it does not exist.
    core : Path
        Folder with the core as WebAssembly.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    InputError
        As ``page_files``, and if a file cannot be written.
    """
    written = []
    for name, content in (page_files(core) | _solid()).items():
        path = Path(folder, name)
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic_write(path) as file:
            file.buffer.write(content)
        written.append(path)
    return written


def _solid() -> dict[str, bytes]:
    """The solid of the steered needle; nothing without the extra ``fe``, which the page then states."""
    try:
        return {SOLID_FILE: solid_example().text()}
    except InputError:
        return {}


def tables() -> dict[str, Any]:
    """What the page knows of laws, tips and presets, in SI; a limit that is infinite is null."""
    models = {name: preset(name) for name in sorted(presets(), key=lambda name: name != "paper")}
    return {
        "version": __version__,
        "laws": {family: _classes(laws_of(family), _seen(models.values(), _laws)) for family in FAMILIES},
        "tips": _classes(tips(), TIPS | _seen(models.values(), _tips)),
        "equivalences": EQUIVALENCES,
        "presets": {name: shown_model(model) for name, model in models.items()},
        "max_obstacles": MAX_OBSTACLES,
        "solid": {"name": SOLID, "file": SOLID_FILE, "title": SOLID_TITLE},
        "steering": {name: each.entry() for name, each in steering_presets().items()},
    }


def _classes(kinds: list[type], seen: dict[str, Any]) -> dict[str, dict]:
    return {
        kind.name: {
            "type": kind.cpp_name,
            "summary": kind.summary,
            "parts": list(kind.parts),
            "columns": hasattr(kind, "columns"),
            "parameters": [_parameter(row, seen.get(kind.name, {}).get(row["name"])) for row in kind.table()],
        }
        for kind in kinds
    }


def _parameter(row: dict, seen: Any) -> dict:
    """A parameter with where its control begins: the value of a preset, the default, or the middle of its range."""
    start = next((each for each in (seen, row.get("default")) if each is not None), None)
    if start is None:
        low, high = max(row["low"], 1e-9), row["high"]
        start = (low * high) ** 0.5
    factor, shown = scale(start if isinstance(start, float) else None, row["unit"])
    kept = {key: row[key] for key in ("name", "unit", "low", "high", "symbol", "meaning")}
    return kept | {"start": start, "factor": factor, "shown": shown, "key": si_key(row["name"], row["unit"])}


def _seen(models: Any, values: Callable[[Layer], list[Any]]) -> dict[str, dict]:
    """The parameters of the first preset that has a law or tip of each name."""
    found: dict[str, dict] = {}
    for model in models:
        for layer in model.layers:
            for value in values(layer):
                found.setdefault(value.name, value.parameters())
    return found


def _laws(layer: Layer) -> list[Any]:
    return list(layer.parts)


# where the controls of a tip begin, if no preset has it; the radius is that of most presets
_R, _ANGLE = 0.35e-3, math.radians(15.0)
TIPS: dict[str, dict] = {
    "cone": {"half_angle": _ANGLE},
    "paraboloid": {"radius": 0.05e-3},
    "sphere": {"radius": _R},
    "flat": {"radius": _R},
    "power_profile": {"exponent": 1.5, "reference_radius": _R, "reference_height": 1e-3},
    "truncated_cone": {"half_angle": _ANGLE, "flat_radius": 0.1e-3},
    "tangent_ogive": {"radius": _R, "length": 1.3e-3},
    "lancet_bevel": {"half_angle": _ANGLE},
    "profile": {"radii": [0.0, 1e-4, 2e-4, 3.5e-4], "heights": [0.0, 1e-4, 4e-4, 1e-3]},
}


def _tips(layer: Layer) -> list[Any]:
    return [law.tip for law in layer.parts if "tip" in law.parts]


def shown_model(model: Model) -> dict:
    """A model as the page has its presets."""
    needle = model.needle
    deepest = max(layer.top + layer.laws.puncture_depth for layer in model.layers)
    stroke = deepest * 2.0 if deepest < MAX_STROKE else 20e-3
    return {
        **{key: getattr(model, key) for key in ("name", "summary", "reference", "doubts", "unverified")},
        "layers": [
            {"top": layer.top, **{family: by_name(getattr(layer, family)) for family in FAMILIES}}
            for layer in model.layers
        ],
        "needle": None if needle is None else {"radius": needle.radius, "half_angle": _half_angle(needle.tip)},
        "needle_lines": [] if needle is None else needle_lines(needle),
        "stroke": min(max(MIN_STROKE, stroke), MAX_STROKE),
    }


def _half_angle(tip: Any) -> float | None:
    return equivalent_half_angle(tip) if hasattr(tip, "equivalent_cone") else None


def without_form(model: Model) -> str:
    """Why the page has no form for a model; empty if it has one."""
    for layer in model.layers:
        for family in FAMILIES:
            law = getattr(layer, family)
            if law.name not in {kind.name for kind in laws_of(family)}:
                return f"The page has no form for the {family} by {law.name}."
    return "" if len(model.layers) <= MAX_LAYERS else f"The page has a form for {MAX_LAYERS} layers, not more."
