# SPDX-License-Identifier: Apache-2.0
"""The virtual rig: the paper's experiment with a specimen that knows more than the identified model."""

from .bench_tests import Bending, Tension
from .experiment import Experiment, Truth, example_recording, paper_experiment
from .paper import PAPER, SWING
from .run import Run, SpeedClock
from .sensor import Sensor
from .specimen import NOTHING_UNMODELLED, Scatter, Site, Specimen, Unmodelled

__all__ = [
    "NOTHING_UNMODELLED",
    "PAPER",
    "SWING",
    "Bending",
    "Experiment",
    "Run",
    "Scatter",
    "Sensor",
    "Site",
    "Specimen",
    "SpeedClock",
    "Tension",
    "Truth",
    "Unmodelled",
    "example_recording",
    "paper_experiment",
]
