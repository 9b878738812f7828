# SPDX-License-Identifier: Apache-2.0
"""The virtual rig on the network in real time: axis over TCP, six-axis sensor over UDP, its page over HTTP."""

from .faults import FAULTS, parse_fault
from .servers import VirtualRig
from .simulated import LiveTruth, SimulatedRig

__all__ = ["FAULTS", "LiveTruth", "SimulatedRig", "VirtualRig", "parse_fault"]
