# SPDX-License-Identifier: Apache-2.0
"""The bibliography, the works that a source string or a model names, and published values as cited data."""

import csv
import re
import tomllib
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

BIBLIOGRAPHY = Path(__file__).parent / "bibliography.toml"
SOURCE_PAPER = "source paper"
_OF_THE_PAPER = re.compile(r"(eqs?|sec)\. ")
PUBLISHED = Path(__file__).parent / "published.csv"
VERIFIED = ("original", "abstract")  # values read in the work itself or in its abstract


@dataclass(frozen=True)
class Work:
    """A published work: its key in source strings, the full reference, and which of its details are unconfirmed."""

    key: str
    reference: str
    unconfirmed: str = ""

    def __str__(self) -> str:
        return f"{self.reference} [unconfirmed: {self.unconfirmed}]" if self.unconfirmed else self.reference


@lru_cache
def works() -> dict[str, Work]:
    """Every work by its key."""
    entries = tomllib.loads(BIBLIOGRAPHY.read_text(encoding="utf-8"))
    return {key: Work(key, **entry) for key, entry in entries.items()}


def keys_in(source: str) -> tuple[str, ...]:
    """The keys that a source string names, in its order; a section or equation without a key is the source paper's.

    A source string has one or more parts separated by semicolons; a part may begin with ``free`` or ``by definition``.
    """
    return tuple(dict.fromkeys(key for part in source.split(";") for key in _keys_in_part(part.strip())))


def _keys_in_part(part: str) -> list[str]:
    if _OF_THE_PAPER.match(part):
        return [SOURCE_PAPER]
    return sorted((key for key in works() if key in part), key=part.index)


def sources_of(model: Any) -> list[str]:
    """The source strings of a model: its own reference, its laws and their parameters, layer by layer."""
    owners = [law for layer in model.layers for law in layer.parts]
    owners += [value for value in (model.needle, model.tissue) if value is not None]
    owners += [owner.tip for owner in owners if getattr(owner, "tip", None) is not None]
    texts = [text for owner in owners for text in (getattr(owner, "source", ""), *(r["source"] for r in owner.table()))]
    return [model.reference, *texts]


def citations(model: Any) -> tuple[str, ...]:
    """Full references of the works that a model uses; a reference that names no known work is returned unchanged."""
    own = [model.reference] if model.reference and not keys_in(model.reference) else []
    named = dict.fromkeys(key for source in sources_of(model) for key in keys_in(source))
    return (*own, *(str(works()[key]) for key in named))


@dataclass(frozen=True)
class PublishedValue:
    """One value as published, in the published unit.

    ``source`` is a key of the bibliography. ``read_in`` is where the value was read: the original, its abstract, an
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
        """``verified`` if the value was read in the work itself or its abstract, otherwise ``secondary``."""
        return "verified" if self.read_in in VERIFIED else "secondary"


@lru_cache
def published_values() -> tuple[PublishedValue, ...]:
    """Every published value of the table that is shipped with needleforce."""
    with PUBLISHED.open(encoding="utf-8", newline="") as file:
        return tuple(PublishedValue(**row) for row in csv.DictReader(file))
