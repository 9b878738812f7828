# SPDX-License-Identifier: Apache-2.0
"""What is odd among the files of a command: told, and left out where the rest can go on without it."""

from ..errors import InputError
from .output import say


def sound(done: list) -> list:
    """(file, Recording or InputError) for each file as before, with an InputError for one left out.

    Left out are forces that are not what was measured (wrong sign, another unit, saturated up to the puncture), as long
    as another file stays. Other oddities are told: another motion is no fault for a model that runs along it.
    """
    from ..campaign.anomaly import SPOILED
    from ..campaign.checks import odd_recordings
    from ..campaign.repeat_checks import OWN_FIELD

    named = [(str(file), each) for file, each in done if not isinstance(each, InputError)]
    bad = {}
    for name, found in odd_recordings(named).items():
        for oddity in found:
            if oddity.left_out and oddity.kind in SPOILED:
                bad.setdefault(name, oddity)
            elif oddity.kind != "no_puncture":  # its status says so
                say(f"{name}: {oddity.sentence.removesuffix(OWN_FIELD).rstrip()}")
    if len(bad) == len(named):
        return done
    return [(file, _left_out(str(file), bad[str(file)]) if str(file) in bad else each) for file, each in done]


def _left_out(file: str, oddity) -> InputError:
    sentence = oddity.sentence.removesuffix(".")
    return InputError("recording", "left out of the fit", sentence[0].lower() + sentence[1:], file)
