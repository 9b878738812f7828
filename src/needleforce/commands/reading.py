# SPDX-License-Identifier: Apache-2.0
"""The files of a command: read one by one, a bad one told and left out."""

from collections.abc import Sequence
from pathlib import Path

from ..errors import InputError
from .output import pairs, progress

COLUMN_HELP = "Which column is which, as force=fz; repeat it."
UNIT_HELP = "The unit of a column, as time=us; repeat it."
INWARDS_HELP = "Whether depth increases or decreases inwards."
MOTION_HELP = (
    "A file with velocity or depth on its own clock, one for each file, second passes after the others; repeat it."
)


def read_all(files: Sequence[Path], column: list[str], unit: list[str], motion: Sequence[Path] = (), **options):
    """(file, Recording or InputError) for each file, in order; ``options`` go to ``nf.read`` as they are."""
    import needleforce as nf

    options |= {"columns": pairs(column, "column"), "units": pairs(unit, "unit")}
    motions = list(motion) or [None] * len(files)
    if len(motions) != len(files):
        raise InputError("--motion", len(motions), f"do not pair with {len(files)} files",
                         next_step="Give one for each file, in the same order.")  # fmt: skip
    done = []
    for file, its_motion in progress(list(zip(files, motions)), "reading"):
        try:
            done.append((file, nf.read(file, motion=its_motion, **options)))
        except InputError as error:
            done.append((file, error))
    return done


def good(done) -> list:
    """The recordings that could be read."""
    return [recording for _, recording in done if not isinstance(recording, InputError)]
