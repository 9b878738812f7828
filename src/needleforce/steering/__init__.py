# SPDX-License-Identifier: Apache-2.0
"""Steering a needle: tip paths read and identified, kinematic models of a bevel-tip needle."""

from .deflection_model import SteeringModel
from .kinematics import Bicycle, KinematicSample, Unicycle
from .tip_path_fit import SteeringEstimate, SteeringFit, identify
from .tip_paths import TipPath, read

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
