# SPDX-License-Identifier: Apache-2.0
"""The live recording as a file: MCAP with standard ROS 2 messages, written as it happens, read whole or cut short."""

from .messages import Log, Mark, Messages
from .reader import read_log
from .writer import LogWriter, write_log

__all__ = ["Log", "LogWriter", "Mark", "Messages", "read_log", "write_log"]
