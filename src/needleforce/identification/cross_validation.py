# SPDX-License-Identifier: Apache-2.0
"""Each repeat predicted from the others, beside how well the experiment repeats itself."""

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from .one_layer.fit_recording import Single
from .pooling import student
from .repeatability import Cycle, cycle_of, mean_of_others
from .result import Fit


@dataclass(frozen=True, eq=False)
class Unseen:
    """Rms errors over the peak (repeats, 4) on repeats left out: whole cycle, insertion, hold, withdrawal.

    ``prediction`` has the mean puncture depths, ``replay`` the punctures of the repeat itself, ``floor`` is the mean of
    the other repeats. NaN where nothing answers; ``refused`` says why, of repeats that the model cannot foretell.
    """

    prediction: np.ndarray
    replay: np.ndarray
    floor: np.ndarray
    refused: tuple[str, ...] = ()

    def over_floor(self, errors: np.ndarray) -> np.ndarray:
        """Rms over the repeats of the errors over that of the floor, (4,): those repeats alone that have both."""
        both = np.isfinite(errors) & np.isfinite(self.floor)
        squares = [np.where(both, values, 0.0) ** 2 for values in (errors, self.floor)]
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.sqrt(squares[0].sum(axis=0) / squares[1].sum(axis=0))

    def tells_from(self, other: "Unseen") -> bool:
        """True if the prediction errors have another ratio than 1, by Student's t on its logarithm over the repeats."""
        difference = np.log(self.prediction[:, 0] / other.prediction[:, 0])
        difference = difference[np.isfinite(difference)]
        if len(difference) < 2:
            return False
        error = difference.std(ddof=1) / np.sqrt(len(difference))
        return bool(abs(difference.mean()) > student(len(difference)) * error)


def predict_unseen(singles: list[Single], identified: Callable[[list[Single]], Fit], watched=iter) -> Unseen:
    """Leaves out each of the recordings in turn; ``identified`` makes a fit from the others alone, from cold.

    Recordings without contact are left away. ``watched(list)`` may show progress.
    """
    usable = [single for single in singles if single.events.contact is not None]
    cycles = [cycle_of(single) for single in usable]
    refused: list[str] = []
    rows = [_left_out(usable, cycles, k, identified, refused) for k in watched(list(range(len(usable))))]
    prediction, replay, floor = np.array(rows).reshape(len(rows), 3, 4).transpose(1, 0, 2)
    return Unseen(prediction, replay, floor, tuple(refused))


def _left_out(usable: list[Single], cycles: list[Cycle], k: int, identified, refused: list[str]) -> list[np.ndarray]:
    """Errors on one repeat: predicted, replayed, and of the mean of the others; why it is not foretold goes to
    ``refused``."""
    others = identified(usable[:k] + usable[k + 1 :]) if len(usable) > 1 else None
    floor = cycles[k].errors(mean_of_others(cycles, k))
    if others is None or others.model is None:
        return [np.full(4, np.nan), np.full(4, np.nan), floor]
    left, cycle = usable[k], cycles[k]
    # its punctures are given, and nothing else: neither its contact nor its exit
    events = dataclasses.replace(left.events, contact=None, exit=None)
    try:
        forces = others.predict(left.recording), others.predict(left.recording, events=events)
    except InputError as error:
        refused.append(f"{left.recording.card.source}: the model of the others does not foretell it: {error}")
        return [np.full(4, np.nan), np.full(4, np.nan), floor]
    return [*(cycle.errors(force[cycle.span]) for force in forces), floor]
