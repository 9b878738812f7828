# SPDX-License-Identifier: Apache-2.0
"""Many tasks at once: on the processors of this computer, or on a Dask cluster."""

from .tasks import TaskError, outcomes, run_tasks
from .workers import Workers, started

__all__ = ["TaskError", "Workers", "outcomes", "run_tasks", "started"]
