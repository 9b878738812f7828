# SPDX-License-Identifier: Apache-2.0
"""What the page shows of a fit, and the files that it gives away: JSON, table, header, preset and script."""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..display.quantities import DASH
from ..export import header, identifier, model_source
from ..identification.comparison import MODELS, floor_words, model_rows
from ..recording.options import ReadOptions
from ..recording.recording import GivenEvents, Recording
from ..vocabulary import __version__
from .page_files import shown_model, without_form

if TYPE_CHECKING:
    from ..identification import Fit
    from ..identification.comparison import Comparison
    from ..identification.recording_fit import RecordingFit

MAX_POINTS, ALL_POINTS = 4000, 60_000  # of a curve that is drawn: lowest and highest force of each stretch; of all


def shown_fit(fit: "Fit") -> dict[str, Any]:
    """What the page shows of a fit."""
    model = fit.identified_model
    points = max(400, min(MAX_POINTS, ALL_POINTS // max(len(fit.recordings), 1)))
    why = "No model was identified." if model is None else without_form(model)
    return {
        "recordings": [_shown_recording(each, points) for each in fit.recordings],
        "warnings": fit.warnings,
        "quality": None if fit.quality is None else str(fit.quality),
        "model": None if model is None else model.name,
        "parameters": [
            {"name": name, "shown": str(one.shown), "known": one.known} for name, one in fit.parameters.items()
        ],
        "simulator": {"why": why, "preset": None if why else shown_model(model)},
    }


def _shown_recording(each: "RecordingFit", points: int) -> dict[str, Any]:
    events = [
        {"kind": name, "time": one.time, "depth": one.depth, "force": one.force} for name, one in each.events.named
    ]
    curve = None if each.recording is None else _curve(each.recording, each.predicted, points)
    return {"status": str(each.status), "notes": each.notes, "events": events, "curve": curve}


def _curve(recording: Recording, predicted: np.ndarray, points: int) -> dict[str, Any]:
    """Columns of the samples that are drawn, of which the residual is the force without that of the model."""
    count = len(recording)
    drawn = np.arange(count)
    if count > points:
        starts = np.linspace(0, count, points // 2 + 1).astype(int)
        stretches = [recording.force[a:b] for a, b in pairwise(starts)]
        drawn = np.unique([a + k for a, one in zip(starts, stretches) for k in (one.argmin(), one.argmax())])
    columns = {name: getattr(recording, name)[drawn] for name in ("time", "depth", "force")}
    known = len(predicted) == count
    return columns | {"model": predicted[drawn] if known else None}


def exports_of(fit: "Fit", script: str) -> dict[str, str]:
    """The texts of the files that the page gives away, by their endings; those of a model only if there is one."""
    found = {"json": fit.to_json(), "csv": _written(fit.to_csv, "estimates.csv"), "py": script}
    if fit.identified_model is None:
        return found
    found["toml"] = _written(fit.save, "identified.toml")
    Path("identified.json").write_text(found["json"], encoding="utf-8")
    source = model_source("identified.json")
    return found | {"hpp": header(source.model, "c++", identifier(source.name), source.sources)}


def _written(write: Any, name: str) -> str:
    write(name)
    return Path(name).read_text(encoding="utf-8")


def shown_comparison(rows: "Comparison") -> dict[str, Any]:
    """The table of a comparison as the terminal has it, with its notes."""
    cells = model_rows(rows)
    known = [k for k in range(len(MODELS)) if any(row[k] not in ("", DASH) for row in cells)]
    return {
        "heads": [MODELS[k] for k in known],
        "rows": [[row[k] for k in known] for row in cells],
        "notes": [floor_words(rows), *(f"{row.model}: {sentence}" for row in rows for sentence in row.notes)],
    }


def script_of(
    sources: Sequence[tuple[str, ReadOptions, GivenEvents | None]], verb: str, options: dict[str, Any]
) -> str:
    """A program that reads the same files with the same options and events, and does the same with them."""
    lines = [f"# Made by the studio of needleforce {__version__}: run it in the folder with the recordings."]
    lines += ["import needleforce as nf", "", "recordings = ["]
    lines += [
        f"    nf.read({name!r}{_keywords(_given(reading))}){_events(events)}," for name, reading, events in sources
    ]
    found = "comparison" if verb == "compare" else "fit"
    lines += ["]", f"{found} = nf.{verb}(recordings{_keywords(options)})", f"print({found})",
              f'{found}.report("report.html")', ""]  # fmt: skip
    return "\n".join(lines)


def _given(reading: ReadOptions) -> dict[str, Any]:
    default = ReadOptions()
    return {name: value for name, value in vars(reading).items() if value != getattr(default, name)}


def _keywords(values: dict[str, Any]) -> str:
    return "".join(f", {name}={value!r}" for name, value in values.items() if value)


def _events(given: GivenEvents | None) -> str:
    if given is None:
        return ""
    listed = ", ".join(f"{name}={value!r}" for name, value in vars(given).items() if value is not None)
    return f".with_events({listed})"
