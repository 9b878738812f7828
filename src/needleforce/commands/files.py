# SPDX-License-Identifier: Apache-2.0
"""Reading of the files of a command: an unreadable file is reported and left out, as is a recording with invalid values
if others remain."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from .output import pairs, progress, say

if TYPE_CHECKING:
    from ..campaign import Anomaly
    from ..recording import Recording

COLUMN_HELP = "Column of a quantity, such as force=fz; may be repeated."
UNIT_HELP = "Unit of a quantity, such as time=us; may be repeated."
PRESET_HELP = "Model: name of a preset, a preset file (TOML), or the JSON of a fit."
NEEDLE_HELP = "Needle: name of a preset, a preset or needle file (TOML), or the JSON of a fit."
MOTION_HELP = (
    "File with velocity or depth on its own clock; repeated once for each recording, those of second passes last."
)
START_DEPTH_HELP = "Depth at the first sample of a motion file with velocity."
FILTER_HELP = "Samples in the average filter of the force."

ReadFiles = list[tuple[Path, "Recording | InputError"]]


def read_all(
    files: Sequence[Path], column: list[str], unit: list[str], motion: Sequence[Path] = (), **options: Any
) -> ReadFiles:
    """(file, Recording or InputError) for each file, in order; ``options`` are passed to ``nf.read``."""
    options |= {"columns": pairs(column, "column"), "units": pairs(unit, "unit")}
    check_usage(options)
    motions = list(motion) or [None] * len(files)
    if len(motions) != len(files):
        raise InputError("number of --motion files", len(motions), f"there are {len(files)} recordings",
                         next_step="Give one for each recording, in the same order.")  # fmt: skip
    done: ReadFiles = []
    for file, its_motion in progress(list(zip(files, motions)), "reading"):
        try:
            parts = _parts(file, options)
        except InputError as error:
            done.append((file, error))
            continue
        done += [(file, _read(file, options | {"motion": its_motion, "part": part})) for part in parts]
    return done


def _read(file: Path, options: dict[str, Any]) -> "Recording | InputError":
    import needleforce as nf

    try:
        return nf.read(file, **options)
    except InputError as error:
        return error


def _parts(file: Path, options: dict) -> Sequence[str | int | None]:
    """The recordings of a file that were chosen: all, those whose names fit a pattern with ``*``, or one."""
    from ..recording.several import chosen_parts

    wanted = options.get("part")
    if wanted is None:
        return [None]
    return [part for part, _ in chosen_parts(file, wanted, **{k: v for k, v in options.items() if k != "part"})]


def check_usage(options: dict) -> None:
    """Check the options that apply to every file; an error is wrong usage, not an unreadable file."""
    from ..recording.quantities import QUANTITIES, dimension
    from ..units import parse

    known = {*QUANTITIES, *(f"motion.{quantity}" for quantity in ("time", "depth", "velocity"))}
    for option in ("columns", "units"):
        for quantity in options[option]:
            if quantity not in known:
                limit = f"known are {', '.join(sorted(known))}"
                raise InputError(f"quantity of --{option.removesuffix('s')}", repr(quantity), limit)
    for quantity, unit in options["units"].items():
        parse(unit, dimension(quantity.removeprefix("motion.")), quantity)
    if options.get("inwards") not in (None, "increasing", "decreasing"):
        raise InputError("--depth-inwards", repr(options["inwards"]), "known are increasing and decreasing")
    if options.get("filter_length") is not None and options["filter_length"] < 1:
        raise InputError("--filter-length", options["filter_length"], "must be at least 1")


def readable(done: ReadFiles) -> list["Recording"]:
    """The recordings that could be read."""
    return [recording for _, recording in done if not isinstance(recording, InputError)]


def screen_recordings(done: ReadFiles) -> ReadFiles:
    """(file, Recording or InputError) for each file, with an InputError for each recording that is left out.

    Recordings with an invalid force (wrong sign, another unit, saturated up to the puncture) are left out if another
    file remains. Other anomalies are printed only: a different motion is not a fault for a model that follows it.
    """
    from ..campaign.checks import check_recordings
    from ..campaign.recording_result import INVALIDATING, Anomaly
    from ..campaign.repeat_checks import OWN_FIELD

    names = [_name(file, each) for file, each in done]
    named = [(name, each) for name, (_, each) in zip(names, done) if not isinstance(each, InputError)]
    invalid: dict[str, Anomaly] = {}
    for name, found in check_recordings(named).items():
        for anomaly in found:
            if anomaly.left_out and anomaly.kind in INVALIDATING:
                invalid.setdefault(name, anomaly)
            elif anomaly.kind != "no_puncture":  # reported by the status
                say(f"{name}: {anomaly.sentence.removesuffix(OWN_FIELD).rstrip()}")
    if len(invalid) == len(named):
        return done
    return [
        (file, _left_out(name, invalid[name]) if name in invalid else each) for name, (file, each) in zip(names, done)
    ]


def _name(file: Path, found: "Recording | InputError") -> str:
    """The name of a file, and of the recording in it if it has several."""
    part = "" if isinstance(found, InputError) else found.card.part
    return f"{file}: {part}" if part else str(file)


def _left_out(file: str, anomaly: "Anomaly") -> InputError:
    sentence = anomaly.sentence.removesuffix(".")
    return InputError("recording", "left out of the fit", sentence[0].lower() + sentence[1:], file)
