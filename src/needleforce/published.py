# SPDX-License-Identifier: Apache-2.0
"""Published values that make no complete model, as cited data."""

import csv
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

FILE = Path(__file__).parent / "published.csv"
VERIFIED = ("original", "abstract")  # where the work itself was read, if only its abstract


@dataclass(frozen=True)
class PublishedValue:
    """One value as it was published, in the unit it was published in.

    ``source`` is a key of the bibliography. ``read_in`` says where the value was read: the original, its abstract, an
    excerpt, a review, a re-implementation, or not stated.
    """

    source: str
    tissue: str
    needle: str
    method: str
    quantity: str
    value: str
    unit: str
    read_in: str
    note: str

    @property
    def status(self) -> str:
        """``verified`` where the value was read in the work itself or its abstract, else ``secondary``."""
        return "verified" if self.read_in in VERIFIED else "secondary"


@lru_cache
def published_values() -> tuple[PublishedValue, ...]:
    """Every published value of the table that comes with needleforce."""
    with FILE.open(encoding="utf-8", newline="") as file:
        return tuple(PublishedValue(**row) for row in csv.DictReader(file))
