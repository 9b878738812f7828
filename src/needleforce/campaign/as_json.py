# SPDX-License-Identifier: Apache-2.0
"""A campaign as JSON, in the form of ``needleforce campaign --json``."""

import dataclasses
import json

from ..files import json_safe
from ..identification.estimates import Estimate
from .result import Campaign, Condition, Outcome


def as_json(campaign: Campaign) -> str:
    """The whole outcome; numbers that are not finite become null."""
    document = {
        "conditions": [_condition(each) for each in campaign.conditions],
        "others": [_recording(each) for each in campaign.others],
        "notes": list(campaign.notes),
    }
    return json.dumps(json_safe(document), indent=2, allow_nan=False)


def _condition(condition: Condition) -> dict:
    return {
        "name": condition.name,
        "fields": condition.fields,
        "model": None if condition.model is None else condition.model.name,
        "why": condition.why,
        "parameters": _estimates(condition.parameters),
        "quality": _plain(condition.quality),
        "warnings": list(condition.warnings),
        "recordings": [_recording(each) for each in condition.recordings],
    }


def _recording(one: Outcome) -> dict:
    return {
        "file": one.file,
        "fields": one.fields,
        "status": str(one.status),
        "pooled": one.pooled,
        "oddities": [dataclasses.asdict(odd) for odd in one.oddities],
        "seen": _estimates(one.seen),
        "parameters": _estimates(one.parameters),
        "quality": _plain(one.quality),
        "notes": list(one.notes),
        "reading": list(one.reading),
    }


def _estimates(estimates: dict[str, Estimate]) -> list[dict]:
    return [dataclasses.asdict(each) for each in estimates.values()]


def _plain(value) -> dict | None:
    return None if value is None else dataclasses.asdict(value)
