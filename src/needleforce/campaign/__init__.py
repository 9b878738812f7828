# SPDX-License-Identifier: Apache-2.0
"""Campaigns: many recordings of several conditions, identified together, with a result for every recording."""

from .anomaly import Anomaly
from .campaign import campaign
from .result import Campaign, Condition, RecordingResult

__all__ = ["Anomaly", "Campaign", "Condition", "RecordingResult", "campaign"]
