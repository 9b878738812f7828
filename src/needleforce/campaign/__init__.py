# SPDX-License-Identifier: Apache-2.0
"""Campaigns: many recordings of many conditions, identified together, each accounted for."""

from .anomaly import Anomaly
from .campaign import campaign
from .result import Campaign, Condition, RecordingResult

__all__ = ["Anomaly", "Campaign", "Condition", "RecordingResult", "campaign"]
