# SPDX-License-Identifier: Apache-2.0
"""An experiment as a file: sites, speeds, depths, holds, passes; and its runner."""

from .plan import RunPlan, plan
from .protocol import Protocol, Series
from .reading import protocols, read_protocol
from .runner import CampaignOutcome, run_protocol

__all__ = ["CampaignOutcome", "Protocol", "RunPlan", "Series", "plan", "protocols", "read_protocol", "run_protocol"]
