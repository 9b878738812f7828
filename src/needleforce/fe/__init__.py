# SPDX-License-Identifier: Apache-2.0
"""Tissue as a solid: finite elements around the needle, and what they condense to (extra ``fe``)."""

from .block_mesh import axisymmetric_block, block, grid
from .condensed import CondensedInsertion, CondensedTissue, load_condensed
from .dynamic_insertion import DynamicInsertion, stroke
from .dynamics import DynamicSystem, EnergyBalance, MotionState, Newmark, Rayleigh
from .force_distribution import ForceDistribution, force_distribution
from .hyperelastic import HyperelasticSolution, HyperelasticTissue
from .hyperelastic_materials import MooneyRivlin, NeoHookean
from .insertion_run import InsertionEnergy, InsertionRun, InsertionState
from .materials import Elastic
from .mesh import Mesh
from .mesh_file import read_mesh
from .modulus_fit import ModulusFit, fit_modulus
from .needle_path import NeedlePath
from .shaft_stiffness import modulus_of_shaft_stiffness, shaft_stiffness
from .stress import Stress, stress
from .surface_contact import SurfaceContact, press
from .target_motion import EntryPlan, plan_entry
from .tissue import Tissue
from .tissue_dynamics import ReducedTissue, TissueDynamics
from .vtk_file import write_vtk

__all__ = [
    "CondensedInsertion",
    "CondensedTissue",
    "DynamicInsertion",
    "DynamicSystem",
    "Elastic",
    "EnergyBalance",
    "EntryPlan",
    "ForceDistribution",
    "HyperelasticSolution",
    "HyperelasticTissue",
    "InsertionEnergy",
    "InsertionRun",
    "InsertionState",
    "Mesh",
    "ModulusFit",
    "MooneyRivlin",
    "MotionState",
    "NeedlePath",
    "NeoHookean",
    "Newmark",
    "Rayleigh",
    "ReducedTissue",
    "Stress",
    "SurfaceContact",
    "Tissue",
    "TissueDynamics",
    "axisymmetric_block",
    "block",
    "fit_modulus",
    "force_distribution",
    "grid",
    "load_condensed",
    "modulus_of_shaft_stiffness",
    "plan_entry",
    "press",
    "read_mesh",
    "shaft_stiffness",
    "stress",
    "stroke",
    "write_vtk",
]
