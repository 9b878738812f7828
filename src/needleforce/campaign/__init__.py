# SPDX-License-Identifier: Apache-2.0
"""Campaigns: many recordings of several conditions, identified together, with a result for every recording."""

from .campaign import campaign
from .recording_result import Anomaly, RecordingResult
from .result import Campaign, Condition

__all__ = ["Anomaly", "Campaign", "Condition", "RecordingResult", "campaign"]
