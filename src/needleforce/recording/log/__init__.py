# SPDX-License-Identifier: Apache-2.0
"""Live recordings as MCAP files with standard ROS 2 messages: written during the run, readable also if truncated."""

from .messages import Log, Mark, Messages
from .reader import read_log
from .writer import LogWriter, write_log

__all__ = ["Log", "LogWriter", "Mark", "Messages", "read_log", "write_log"]
