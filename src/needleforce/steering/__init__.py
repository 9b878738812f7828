# SPDX-License-Identifier: Apache-2.0
"""Steering a needle: tip paths read and identified, insertions planned, kinematic models of a bevel-tip needle."""

from .base_motion import BaseMotion
from .kinematics import Bicycle, KinematicSample, Unicycle
from .obstacles import Box, Sphere
from .plan_problem import SteeringLimits
from .planning import Plan, plan
from .steering_model import SteeringModel
from .tip_path_fit import SteeringEstimate, SteeringFit, identify
from .tip_path_tables import read
from .tip_paths import TipPath

__all__ = [
    "BaseMotion",
    "Bicycle",
    "Box",
    "KinematicSample",
    "Plan",
    "Sphere",
    "SteeringEstimate",
    "SteeringFit",
    "SteeringLimits",
    "SteeringModel",
    "TipPath",
    "Unicycle",
    "identify",
    "plan",
    "read",
]
