# SPDX-License-Identifier: Apache-2.0
"""The files of a command: read one by one, a bad one reported and left out; anomalies reported, and left out where
the rest can be used without them."""

from collections.abc import Sequence
from pathlib import Path

from ..errors import InputError
from .output import pairs, progress, say

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
    check_usage(options)
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


def check_usage(options: dict) -> None:
    """What is wrong for every file is wrong usage, not an unreadable file."""
    from ..recording.columns import QUANTITIES, dimension
    from ..units import parse

    known = {*QUANTITIES, *(f"motion.{quantity}" for quantity in ("time", "depth", "velocity"))}
    for option in ("columns", "units"):
        for quantity in options[option]:
            if quantity not in known:
                limit = f"known are {', '.join(sorted(known))}"
                raise InputError(f"--{option.removesuffix('s')}", repr(quantity), limit)
    for quantity, unit in options["units"].items():
        parse(unit, dimension(quantity.removeprefix("motion.")), quantity)
    if options["inwards"] not in ("increasing", "decreasing"):
        raise InputError("--depth-inwards", repr(options["inwards"]), "known are increasing and decreasing")
    if options.get("filter_length") is not None and options["filter_length"] < 1:
        raise InputError("--filter-length", options["filter_length"], "must be at least 1")


def good(done) -> list:
    """The recordings that could be read."""
    return [recording for _, recording in done if not isinstance(recording, InputError)]


def screen_recordings(done: list) -> list:
    """(file, Recording or InputError) for each file as before, with an InputError for one left out.

    Left out are forces that are not what was measured (wrong sign, another unit, saturated up to the puncture), as long
    as another file stays. Other anomalies are told: another motion is no fault for a model that runs along it.
    """
    from ..campaign.anomaly import INVALIDATING
    from ..campaign.checks import check_recordings
    from ..campaign.repeat_checks import OWN_FIELD

    named = [(str(file), each) for file, each in done if not isinstance(each, InputError)]
    bad = {}
    for name, found in check_recordings(named).items():
        for oddity in found:
            if oddity.left_out and oddity.kind in INVALIDATING:
                bad.setdefault(name, oddity)
            elif oddity.kind != "no_puncture":  # its status says so
                say(f"{name}: {oddity.sentence.removesuffix(OWN_FIELD).rstrip()}")
    if len(bad) == len(named):
        return done
    return [(file, _left_out(str(file), bad[str(file)]) if str(file) in bad else each) for file, each in done]


def _left_out(file: str, oddity) -> InputError:
    sentence = oddity.sentence.removesuffix(".")
    return InputError("recording", "left out of the fit", sentence[0].lower() + sentence[1:], file)
