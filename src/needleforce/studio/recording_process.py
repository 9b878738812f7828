# SPDX-License-Identifier: Apache-2.0
"""A recording identified in a process of its own, which the server can end.

``python -m needleforce.studio.recording_process FILE`` writes ``result.json`` and ``report.html`` into the folder where
it runs, and prints a line for each stage.
"""

import json
import os
import sys
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..files import atomic_write, json_safe
from ..identification import identify
from ..recording import Recording, read
from .recording_jobs import REPORT, RESULT

if TYPE_CHECKING:
    from ..identification import Fit, RecordingFit

MAX_POINTS = 4000  # of a curve that is drawn: lowest and highest force of each stretch


IN_THE_PAGE = "Columns, units and signs cannot be chosen in the page yet: give these options to needleforce identify."


def main(file: str) -> None:
    """Identify the recording as ``needleforce identify`` does; what is wrong with it is written as a sentence."""
    try:
        result = _identified(Path(file))
    except InputError as error:
        text = str(error).replace(f"{Path.cwd()}{os.sep}", "")  # the page names no folder of the server
        result = {"error": f"{text} {IN_THE_PAGE}" if "--" in error.next_step else text}
    except MemoryError:
        result = {"error": "The memory of this computer is not sufficient for this file."}
    with atomic_write(RESULT) as target:
        json.dump(json_safe(result), target)


def _identified(file: Path) -> dict[str, Any]:
    print("reading", flush=True)
    recording = read(file)
    print("identifying", flush=True)
    fit = identify([recording])
    print("writing the report", flush=True)
    fit.report(REPORT)
    return _shown(recording, fit)


def _shown(recording: Recording, fit: "Fit") -> dict[str, Any]:
    """What the page shows of a fit."""
    (each,) = fit.recordings
    predicted = fit.predict(recording) if fit.identified_model is not None else None
    return {
        "status": str(each.status),
        "assumed": recording.card.assumptions,
        "notes": each.notes,
        "warnings": fit.warnings,
        "quality": None if fit.quality is None else str(fit.quality),
        "model": None if fit.identified_model is None else fit.identified_model.name,
        "parameters": [
            {"name": name, "shown": str(one.shown), "known": one.known} for name, one in fit.parameters.items()
        ],
        "events": _events(each),
        "curve": _curve(recording, predicted),
    }


def _events(each: "RecordingFit") -> list[dict]:
    events = each.events
    found = [("contact", events.contact), *(("puncture", one) for one in events.punctures), ("exit", events.exit)]
    return [
        {"kind": kind, "time": one.time, "depth": one.depth, "force": one.force}
        for kind, one in found
        if one is not None
    ]


def _curve(recording: Recording, predicted: np.ndarray | None) -> dict[str, Any]:
    count = len(recording)
    drawn = np.arange(count)
    if count > MAX_POINTS:
        starts = np.linspace(0, count, MAX_POINTS // 2 + 1).astype(int)
        stretches = [recording.force[a:b] for a, b in pairwise(starts)]
        drawn = np.unique([a + k for a, one in zip(starts, stretches) for k in (one.argmin(), one.argmax())])
    columns = {"time": recording.time, "depth": recording.depth, "force": recording.force, "model": predicted}
    return {name: None if values is None else values[drawn] for name, values in columns.items()}


if __name__ == "__main__":
    main(*sys.argv[1:])
