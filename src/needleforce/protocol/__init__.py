# SPDX-License-Identifier: Apache-2.0
"""An experiment as a file (sites, speeds, depths, holds, passes) and the runner that records it."""

from .protocol import Protocol, RunPlan, Series, plan
from .reading import protocols, read_protocol
from .session import CampaignOutcome, run_protocol

__all__ = ["CampaignOutcome", "Protocol", "RunPlan", "Series", "plan", "protocols", "read_protocol", "run_protocol"]
