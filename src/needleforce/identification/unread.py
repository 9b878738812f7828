# SPDX-License-Identifier: Apache-2.0
"""Files that could not be read stay in the outcome, with the reason."""

import dataclasses

from ..errors import InputError
from ..segmentation import Events
from ..vocabulary import Status
from .result import Fit, RecordingFit


def with_unread(fit: Fit | None, unread: list[tuple[str, InputError]]) -> Fit:
    """``fit`` with one entry for each (file, error); None is a fit of nothing."""
    fit = fit or Fit((), {}, None, None)
    entries = tuple(
        RecordingFit(file, Status.unreadable, None, Events(status=Status.unreadable), notes=(str(error),))
        for file, error in unread
    )
    return dataclasses.replace(fit, recordings=fit.recordings + entries)
