# SPDX-License-Identifier: Apache-2.0
"""A fit as JSON, in the form of ``needleforce identify --json``."""

import dataclasses
import json
import tomllib

from ..files import json_safe
from ..preset_files.writing import as_toml
from ..segmentation import Events
from .result import Fit, RecordingFit


def as_json(fit: Fit) -> str:
    """The whole outcome; numbers that are not finite become null."""
    document = {
        "recordings": [_recording(each) for each in fit.recordings],
        "parameters": _estimates(fit.parameters),
        "quality": _quality(fit.quality),
        "model": None if fit.model is None else fit.model.name,
        "preset": _preset(fit.model),
        "choice": [{"model": name, "bic": bic} for name, bic in fit.choice],
        "warnings": list(fit.warnings),
        "held_fixed": list(fit.held_fixed),
        "unknown": list(fit.unknown),
        "settings": fit.settings,
        "correlations": _correlations(fit.correlations),
        "two_pass": _two_pass(fit.two_pass),
        "ruptures": _ruptures(fit.ruptures),
        "population": _population(fit),
    }
    return json.dumps(json_safe(document), indent=2, allow_nan=False)


def _ruptures(found) -> dict | None:
    """Of a layered fit: where its layers give way, in the recordings' zero."""
    if found is None:
        return None
    return {"depth_m": found.depth, "past_peak_m": found.past_peak, "contact_depth_m": found.contact}


def _population(fit: Fit) -> dict | None:
    """Of a layered fit: the law for an insertion not seen yet."""
    if fit.population is None:
        return None
    return {"contact_depth_m": fit.population_contact, "preset": _preset(fit.population)}


def _preset(model) -> dict | None:
    """The whole model in the form of a preset file, what ``needleforce export`` reads."""
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


def _two_pass(two_pass) -> dict | None:
    """Each site's numbers, without its curves, and what the procedure cannot separate."""
    if two_pass is None:
        return None
    sites = [
        {name: value for name, value in vars(site).items() if not hasattr(value, "shape")} for site in two_pass.sites
    ]
    return {
        "upper_bound": two_pass.upper_bound,
        "biases": list(two_pass.biases),
        "terms": [dataclasses.asdict(term) for term in two_pass.terms],
        "cutting_range": list(two_pass.cutting_range),
        "sites": sites,
    }


def _correlations(found) -> dict | None:
    return None if found is None else {"names": list(found.names), "matrix": found.matrix.tolist()}


def _estimates(parameters: dict) -> list[dict]:
    return [dataclasses.asdict(estimate) for estimate in parameters.values()]


def _quality(quality) -> dict | None:
    return None if quality is None else dataclasses.asdict(quality)
