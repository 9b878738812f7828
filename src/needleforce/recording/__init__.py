# SPDX-License-Identifier: Apache-2.0
"""Recordings: files read into SI arrays with their provenance, and written again."""

from .reader import read, read_all
from .recording import Card, Note, Recording
from .writer import write, write_columns

__all__ = ["Card", "Note", "Recording", "read", "read_all", "write", "write_columns"]
