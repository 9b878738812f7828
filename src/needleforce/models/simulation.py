# SPDX-License-Identifier: Apache-2.0
"""Runs a model along a motion: a recording without sensor, filter or noise."""

import numpy as np

from ..errors import InputError
from ..mechanics.validity import crossed_by_depth
from ..recording import Card, Note, Recording
from ..vocabulary import Status
from .model import Insertion, Model
from .motion import Motion

MOST_SAMPLES = 50_000_000
PARTS = ("stiffness", "friction", "cutting")


def simulate(model: Model, motion: Motion, rate: float = 1000.0) -> Recording:
    """The force of ``model`` along ``motion``, sampled at ``rate`` [Hz]; the force's parts are in ``axes``.

    Depth is in the model's zero: the undeformed surface. The card assumes the limits the model crosses, and ``notes``
    tell how many samples are not ok. The virtual rig adds sensor, filter and clocks.
    """
    if not (np.isfinite(rate) and 0.0 < rate <= 1e6):
        raise InputError("rate", rate, "outside 0 to 1e6 Hz")
    count = int(np.floor(motion.duration * rate)) + 1
    if not 2 <= count <= MOST_SAMPLES:
        raise InputError("samples", count, f"outside 2 to {MOST_SAMPLES}", "simulation", "Change rate, speed or hold.")
    time = np.arange(count) / rate
    depth, velocity = motion.at(time)
    columns = Insertion(model).run(depth, velocity, np.full(len(time), 1.0 / rate))
    card = Card(
        source=f"simulated: {model.name}",
        needle=repr(model.needle or ""),
        tissue=repr(model.tissue or ""),
        assumptions=(*model.warnings, *crossed_by_depth(model, depth.max())),
    )
    axes = {part: columns[part] for part in PARTS}
    return Recording(time, depth, velocity, columns["force"], axes, card, _not_ok(columns["status"]))


WORDS = {
    Status.outside_range: "samples outside the range of the model, beyond a law's reach or faster than a step may be",
    Status.invalid_parameter: "samples without force, as the model's parameters are impossible",
    Status.not_finite: "samples with a depth, velocity or time that is not finite",
}


def _not_ok(status: np.ndarray) -> tuple[Note, ...]:
    """One note for each status but ok, with its count."""
    counts = {word: int(np.count_nonzero(status == number)) for number, word in enumerate(Status)}
    return tuple(Note(word, f"{counts[word]} {said}", counts[word]) for word, said in WORDS.items() if counts[word])
