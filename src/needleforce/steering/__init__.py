# SPDX-License-Identifier: Apache-2.0
"""Steering a needle: tip paths read and identified, kinematic models of a bevel-tip needle."""

from .kinematics import Bicycle, KinematicSample, Unicycle
from .steering_model import SteeringModel
from .tip_path_fit import SteeringEstimate, SteeringFit, identify
from .tip_path_tables import read
from .tip_paths import TipPath

__all__ = [
    "Bicycle",
    "KinematicSample",
    "SteeringEstimate",
    "SteeringFit",
    "SteeringModel",
    "TipPath",
    "Unicycle",
    "identify",
    "read",
]
