# SPDX-License-Identifier: Apache-2.0
"""The virtual rig: the paper's experiment with a specimen that knows more than the identified model."""

from .bench_tests import Bending, Tension
from .clocks import SpeedClock
from .example import example_recording
from .experiment import Experiment, paper_experiment
from .paper import PAPER, SWING
from .run import Run
from .sensor import Sensor
from .site import Scatter, Site
from .specimen import NOTHING_UNMODELLED, Specimen, Unmodelled
from .truth import Truth

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
