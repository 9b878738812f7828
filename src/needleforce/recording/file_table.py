# SPDX-License-Identifier: Apache-2.0
"""The name under which the modules of formats make a table."""

from .table import Table as FileTable

__all__ = ["FileTable"]
