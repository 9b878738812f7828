# SPDX-License-Identifier: Apache-2.0
"""The virtual rig: the source paper's experiment on a specimen with effects that the fitted model omits."""

from .bench_tests import BendingTest, TensionTest
from .experiment import Experiment, Truth, example_recording, paper_experiment
from .run import RigRun, SpeedClock
from .sensor import Sensor
from .specimen import CUTTING_OSCILLATION, NOTHING_UNMODELLED, PAPER, PhantomSite, Scatter, Specimen, Unmodelled
from .steering import RigInsertion, SteeringPhantom, steering_insertion, write_steering

__all__ = [
    "CUTTING_OSCILLATION",
    "NOTHING_UNMODELLED",
    "PAPER",
    "BendingTest",
    "Experiment",
    "PhantomSite",
    "RigInsertion",
    "RigRun",
    "Scatter",
    "Sensor",
    "Specimen",
    "SpeedClock",
    "SteeringPhantom",
    "TensionTest",
    "Truth",
    "Unmodelled",
    "example_recording",
    "paper_experiment",
    "steering_insertion",
    "write_steering",
]
