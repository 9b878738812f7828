# SPDX-License-Identifier: Apache-2.0
"""What is odd in each of several repeats, by itself and beside the others."""

from collections.abc import Mapping, Sequence

import numpy as np

from ..recording import Recording
from ..segmentation import Events, segment
from .anomaly import SPOILED, Oddity
from .checks import oddities_alone
from .repeat_checks import Repeat, oddities_beside
from .summary import observe

NO_FIELDS: Mapping[str, str] = {}


def odd_recordings(named: Sequence[tuple[str, Recording]]) -> dict[str, list[Oddity]]:
    """The oddities of recordings that are repeats of one another, by name; none for one in which nothing moves."""
    return odd_repeats(moving_repeats([(name, recording, segment(recording)) for name, recording in named]))


def moving_repeats(seen: Sequence[tuple[str, Recording, Events]]) -> list[Repeat]:
    """Those in which the needle moves, with what is seen of them."""
    contacts = [events.contact.depth for _, _, events in seen if events.contact is not None]
    usual = float(np.median(contacts)) if contacts else None
    with np.errstate(all="ignore"):  # numbers too large for a force are told by their status
        observed = [observe(recording, events, usual) for _, recording, events in seen]
    return [Repeat(*each, what) for each, what in zip(seen, observed) if what is not None]


def odd_repeats(repeats: Sequence[Repeat], fields: Mapping[str, Mapping[str, str]] = {}) -> dict[str, list[Oddity]]:
    """The oddities by name; ``fields`` are what the label of each says of it."""
    with np.errstate(all="ignore"):
        beside = oddities_beside(repeats)
        return {
            each.name: _first_causes(
                [
                    *oddities_alone(each.recording, each.events, each.seen, fields.get(each.name, NO_FIELDS)),
                    *beside[each.name],
                ]
            )
            for each in repeats
        }


def _first_causes(odd: list[Oddity]) -> list[Oddity]:
    """Without the missing puncture where the numbers themselves are wrong: that is why none is seen."""
    spoiled = any(each.kind in SPOILED for each in odd)
    return [each for each in odd if not (spoiled and each.kind == "no_puncture")]
