# SPDX-License-Identifier: Apache-2.0
"""Estimates, draws and fits as CSV, JSON and ArviZ inference data."""

import csv
import dataclasses
import json
import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..files import atomic_write, csv_text
from ..models.model import Model
from ..preset_files.build import as_toml
from ..segmentation import Events
from .estimates import Estimate, Quality
from .recording_fit import RecordingFit
from .result import Fit
from .statistics.draws import Draws
from .two_pass.result import TwoPass

COLUMNS = (
    *("recording", "quantity", "value", "low", "high", "unit", "between_repeats_sd", "within_run_sd"),
    *("random", "systematic_below", "systematic_above", "identifiable", "source"),
)
POOLED = "pooled"
ENDINGS = (".csv", ".json")
CHAINS = 4


def write_estimates(fit: Fit, path: str | Path) -> None:
    """Write one row for each estimate with ``COLUMNS``, the pooled ones first; a missing or infinite value is empty."""
    blocks = [(POOLED, fit.parameters), *((each.file, each.parameters) for each in fit.recordings)]
    with atomic_write(path) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for name, parameters in blocks:
            writer.writerows(_row(name, estimate) for estimate in parameters.values())


def _row(recording: str, e: Estimate) -> list:
    numbers = [_cell(number) for number in (e.value, e.low, e.high)]
    spreads = [_cell(number) for number in (e.between_repeats_sd, e.within_run_sd, e.random, *e.systematic)]
    return [csv_text(recording), e.name, *numbers, e.unit, *spreads, str(e.identifiable).lower(), e.source]


def _cell(number: float | None) -> str:
    return "" if number is None or not math.isfinite(number) else repr(float(number))


def check_draws_target(path: str | Path) -> None:
    """Raises InputError for a file ending in which draws cannot be written."""
    if Path(path).suffix.lower() not in ENDINGS:
        limit = f"it must end in {' or '.join(ENDINGS)}"
        raise InputError("file of draws", str(path), limit, next_step="Give a name with such an ending.")


def write_draws(draws: Draws, path: str | Path) -> None:
    """Write draws as CSV or JSON, by the ending of ``path``.

    ``.csv``: one row per draw, the pooled draws first; a column ``recording``, then one per quantity, empty where it is
    missing in a recording. ``.json``: ``pooled`` and ``recordings`` with their ``draws``. Raises InputError for another
    ending.
    """
    check_draws_target(path)
    with atomic_write(path) as file:
        if Path(path).suffix.lower() == ".json":
            json.dump(_document(draws), file, allow_nan=False)
        else:
            _write_table(draws, file)


def _write_table(draws: Draws, file: Any) -> None:
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(("recording", *draws))
    own = [{name: values[k] for name, values in draws.own.items()} for k in range(len(draws.files))]
    for recording, columns in zip((POOLED, *draws.files), (draws, *own)):
        count = len(next(iter(columns.values())))
        listed = [columns[name].tolist() if name in columns else [None] * count for name in draws]
        writer.writerows((csv_text(recording), *map(_cell, row)) for row in zip(*listed))


def _document(draws: Draws) -> dict:
    own = [{name: _numbers(values[k]) for name, values in draws.own.items()} for k in range(len(draws.files))]
    recordings = [
        {"file": file, "method": method, "draws": each} for file, method, each in zip(draws.files, draws.methods, own)
    ]
    return {POOLED: {name: _numbers(values) for name, values in draws.items()}, "recordings": recordings}


def _numbers(values: np.ndarray) -> list:
    return [value if math.isfinite(value) else None for value in values.tolist()]


def inference_data(draws: Draws) -> Any:
    """The draws for ArviZ: an InferenceData, or a DataTree from ArviZ 1 on, with the group posterior.

    Quantities are the pooled ones; ``<name>_of_recording`` has the dimension recording. Independent draws have no
    chains: they are split into four, so that the diagnostics work. Raises InputError without ArviZ.
    """
    try:
        import arviz
    except ImportError:
        step = "Run: pip install 'needleforce[arviz]'"
        raise InputError("package arviz", "not installed", "it is needed for inference data", next_step=step) from None
    chains = CHAINS if len(next(iter(draws.values()))) % CHAINS == 0 else 1
    posterior = {name: values.reshape(chains, -1) for name, values in draws.items()}
    of_recording = {f"{name}_of_recording": values for name, values in draws.own.items()}
    dims = {name: ["recording"] for name in of_recording}
    posterior |= {
        name: np.moveaxis(values.reshape(len(values), chains, -1), 0, -1) for name, values in of_recording.items()
    }
    named = {"coords": {"recording": _distinguishable(draws.files)}, "dims": dims}
    if arviz.__version__.startswith("0."):
        return arviz.from_dict(posterior=posterior, **named)
    return arviz.from_dict({"posterior": posterior}, **named)


def _distinguishable(files: tuple[str, ...]) -> list[str]:
    """The names, repeated ones with a number, because ArviZ uses them as an index."""
    return [name if files.count(name) == 1 else f"{name} ({files[:k].count(name) + 1})" for k, name in enumerate(files)]


def fit_document(fit: Fit) -> dict:
    """The complete fit as a document for JSON."""
    found = fit.correlations
    return {
        "recordings": [_recording(each) for each in fit.recordings],
        "parameters": _estimates(fit.parameters),
        "quality": _quality(fit.quality),
        "model": None if fit.identified_model is None else fit.model.name,
        "preset": preset_document(fit.identified_model),
        "choice": [{"model": name, "bic": bic, "puncture_ratio": ratio} for name, bic, ratio in fit.choice],
        "warnings": list(fit.warnings),
        "held_fixed": list(fit.held_fixed),
        "unknown": list(fit.unknown),
        "settings": {} if fit.settings is None else dataclasses.asdict(fit.settings),
        "correlations": None if found is None else {"names": list(found.names), "matrix": found.matrix.tolist()},
        "two_pass": _two_pass(fit.two_pass),
        "ruptures": None,
        "population": None,
    }


def preset_document(model: Model | None) -> dict | None:
    """The complete model in the form of a preset file, as ``needleforce export`` reads it."""
    return None if model is None else tomllib.loads(as_toml(model))


def _recording(each: RecordingFit) -> dict:
    card = None if each.recording is None else each.recording.card
    return {
        "file": each.file,
        "status": str(each.status),
        "sha256": "" if card is None else card.sha256,
        "events": _events(each.events),
        "phases": [{"phase": str(span.phase), "start_s": span.start, "end_s": span.end} for span in each.events.phases],
        "parameters": _estimates(each.parameters),
        "quality": _quality(each.quality),
        "notes": list(each.notes),
        "assumptions": [] if card is None else list(card.assumptions),
    }


def _events(events: Events) -> dict:
    return {
        "contact_depth_m": None if events.contact is None else events.contact.depth,
        "punctures": [
            {"depth_m": p.depth, "indentation_m": p.indentation, "force_N": p.force, "drop_N": p.drop, "time_s": p.time}
            for p in events.punctures
        ],
        "exit_depth_m": None if events.exit is None else events.exit.depth,
    }


def _two_pass(two_pass: TwoPass | None) -> dict | None:
    """The values of each site, without its curves, and the bias terms."""
    if two_pass is None:
        return None
    sites = [
        {name: value for name, value in vars(site).items() if not hasattr(value, "shape")}
        | {"forms": [dataclasses.asdict(form) for form in site.forms]}
        for site in two_pass.sites
    ]
    return {
        "upper_bound": two_pass.upper_bound,
        "biases": list(two_pass.biases),
        "terms": [dataclasses.asdict(term) for term in two_pass.terms],
        "cutting_range": list(two_pass.cutting_range),
        "sites": sites,
    }


def _estimates(parameters: dict) -> list[dict]:
    return [estimate.document() for estimate in parameters.values()]


def _quality(quality: Quality | None) -> dict | None:
    return None if quality is None else dataclasses.asdict(quality)
