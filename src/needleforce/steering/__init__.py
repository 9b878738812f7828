# SPDX-License-Identifier: Apache-2.0
"""Steering a needle: kinematic models of a bevel-tip needle."""

from .kinematics import Bicycle, KinematicSample, Unicycle

__all__ = ["Bicycle", "KinematicSample", "Unicycle"]
