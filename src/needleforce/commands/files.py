# SPDX-License-Identifier: Apache-2.0
"""Reading of the files of a command: an unreadable file is reported and left out, as is a recording with invalid values
if others remain."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError
from ..recording.options import ReadOptions
from .output import progress, say

if TYPE_CHECKING:
    from ..campaign import Anomaly
    from ..recording import Recording
    from ..recording.reader import RecordingFile

PRESET_HELP = "Model: name of a preset, a preset file (TOML), or the JSON of a fit."
NEEDLE_HELP = "Needle: name of a preset, a preset or needle file (TOML), or the JSON of a fit."
MACHINE_HELP = (
    "Stiffness [N/mm] of sensor, holder and drive in series with the needle: the depth is then that of the tip."
)
MOTION_HELP = (
    "File with velocity or depth on its own clock; repeated once for each recording, those of second passes last."
)

ReadFiles = list[tuple[Path, "Recording | InputError"]]


def read_all(files: Sequence[Path], reading: ReadOptions, motion: Sequence[Path] = ()) -> ReadFiles:
    """(file, Recording or InputError) for each file, in order; ``motion`` has one file for each, or none."""
    from ..recording.reader import open_file

    motions = list(motion) or [reading.motion] * len(files)
    if len(motions) != len(files):
        raise InputError("number of --motion files", len(motions), f"there are {len(files)} recordings",
                         next_step="Give one for each recording, in the same order.")  # fmt: skip
    done: ReadFiles = []
    for file, its_motion in progress(list(zip(files, motions)), "reading"):
        try:
            opened = open_file(file, replace(reading, motion=its_motion))
            parts = [None] if reading.part is None else [part for part, _ in opened.chosen()]
        except InputError as error:
            done.append((file, error))
            continue
        done += [(file, _read(opened, part)) for part in parts]
    return done


def _read(opened: "RecordingFile", part: str | int | None) -> "Recording | InputError":
    try:
        return opened.read(part)[0]
    except InputError as error:
        return error


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
