# SPDX-License-Identifier: Apache-2.0
"""What ``identify`` is given, checked: recordings with their second passes, needle, bench tests."""

from ..core import Needle
from ..errors import InputError
from ..models.model import Model
from ..recording import Recording
from .bench_tests import needle_estimate, tissue_estimate
from .estimates import Estimate


def paired(recordings, seconds) -> tuple[list[Recording], list]:
    """Both as lists; the second empty, or as long as the first.

    Raises InputError for what is no recording, for none, for lists that do not pair and for a file given twice.
    """
    recordings = [recordings] if isinstance(recordings, Recording) else list(recordings)
    seconds = [seconds] if isinstance(seconds, Recording) else list(seconds)
    for each in [*recordings, *(second for second in seconds if second is not None)]:
        if not isinstance(each, Recording):
            raise InputError("recording", repr(each), "not a Recording", next_step="Give what nf.read(path) returns.")
    if not recordings:
        raise InputError("recordings", "none", "nothing to identify", next_step="Give at least one recording.")
    if seconds and len(seconds) != len(recordings):
        raise InputError(
            "second passes",
            len(seconds),
            f"do not pair with {len(recordings)} recordings",
            next_step="Give one second pass for each recording, in the same order.",
        )
    _different([*recordings, *(second for second in seconds if second is not None)])
    return recordings, seconds


def bench_estimates(bending, tension, needle: Needle | None) -> dict[str, Estimate]:
    """What the bench tests that there are tell, by name. Raises InputError for a bending test without a needle."""
    if bending is not None and needle is None:
        raise InputError(
            "needle", "missing", "the bending test needs its section and length", next_step="Give the needle."
        )
    found = [needle_estimate(bending, needle)] if bending is not None else []
    found += [tissue_estimate(tension)] if tension is not None else []
    return {estimate.name: estimate for estimate in found}


def needle_of(needle) -> Needle | None:
    """The needle itself, or that of a model. Raises InputError for anything else."""
    found = needle.needle if isinstance(needle, Model) else needle
    if not isinstance(found, Needle | None):
        raise InputError("needle", repr(found), "not a Needle", next_step="Give nf.Needle(...) or a preset's .needle.")
    return found


def _different(recordings: list[Recording]) -> None:
    """A file counted twice would pass for a repeat and narrow the intervals."""
    seen: dict[str, str] = {}
    for card in (recording.card for recording in recordings if recording.card.sha256):
        if card.sha256 in seen:
            twice = f"the same bytes as {seen[card.sha256]}"
            raise InputError("recording", twice, "given twice", card.source, "Give each file once.")
        seen[card.sha256] = card.source
