# SPDX-License-Identifier: Apache-2.0
"""Campaigns: many recordings of many conditions, identified together, each accounted for."""

from .anomaly import Oddity
from .campaign import campaign
from .result import Campaign, Condition, Outcome

__all__ = ["Campaign", "Condition", "Oddity", "Outcome", "campaign"]
