# SPDX-License-Identifier: Apache-2.0
"""Steering a needle: tip paths read and identified, insertions planned, kinematic models of a bevel-tip needle."""

from .base_motion import BaseMotion
from .identification import identify
from .kinematics import Bicycle, KinematicSample, Unicycle
from .learnt_prior import prior
from .needle_shapes import NeedleShape, read_shapes
from .obstacles import Box, Sphere
from .plan_problem import SteeringLimits
from .planning import Plan, plan
from .result import SteeringResult
from .shape_fit import ShapeFit, needle_shape
from .steered_run import SteeredRun, simulate
from .steering_files import load
from .steering_model import SteeringModel
from .steering_parameters import SteeringEstimate
from .tip_estimator import TipEstimate, TipEstimator
from .tip_path_fit import SteeringFit
from .tip_path_tables import read
from .tip_paths import TipPath
from .tissue_prior import TissuePrior
from .wrench_fit import BaseWrench, WrenchFit, base_wrench
from .wrench_sensor import WrenchSensor

__all__ = [
    "BaseMotion",
    "BaseWrench",
    "Bicycle",
    "Box",
    "KinematicSample",
    "NeedleShape",
    "Plan",
    "ShapeFit",
    "Sphere",
    "SteeredRun",
    "SteeringEstimate",
    "SteeringFit",
    "SteeringLimits",
    "SteeringModel",
    "SteeringResult",
    "TipEstimate",
    "TipEstimator",
    "TipPath",
    "TissuePrior",
    "Unicycle",
    "WrenchFit",
    "WrenchSensor",
    "base_wrench",
    "identify",
    "load",
    "needle_shape",
    "plan",
    "prior",
    "read",
    "read_shapes",
    "simulate",
]
