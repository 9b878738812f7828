# SPDX-License-Identifier: Apache-2.0
"""Tissue as a solid: finite elements around the needle, and what they condense to (extra ``fe``)."""

from .block_mesh import axisymmetric_block, block, grid
from .condensed import CondensedInsertion, CondensedTissue, load_condensed
from .cylinder_mesh import cylinder
from .dynamic_insertion import DynamicInsertion, stroke
from .dynamics import DynamicSystem, EnergyBalance, MotionState, Newmark, Rayleigh
from .force_distribution import ForceDistribution, force_distribution
from .hyperelastic import HyperelasticSolution, HyperelasticTissue
from .hyperelastic_fit import HyperelasticFit, fit_hyperelastic
from .hyperelastic_materials import MooneyRivlin, NeoHookean
from .insertion_fit import InsertionFit, fit_insertion
from .insertion_run import InsertionEnergy, InsertionRun, InsertionState
from .lateral_foundation import LateralFoundation, lateral_foundation
from .materials import Elastic
from .mesh import Mesh
from .mesh_file import read_mesh
from .modulus_fit import ModulusFit, fit_modulus
from .needle_path import NeedlePath
from .picture import picture
from .section import Section, section
from .shaft_stiffness import modulus_of_shaft_stiffness, shaft_stiffness
from .solid_report import report
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
    "HyperelasticFit",
    "HyperelasticSolution",
    "HyperelasticTissue",
    "InsertionEnergy",
    "InsertionFit",
    "InsertionRun",
    "InsertionState",
    "LateralFoundation",
    "Mesh",
    "ModulusFit",
    "MooneyRivlin",
    "MotionState",
    "NeedlePath",
    "NeoHookean",
    "Newmark",
    "Rayleigh",
    "ReducedTissue",
    "Section",
    "Stress",
    "SurfaceContact",
    "Tissue",
    "TissueDynamics",
    "axisymmetric_block",
    "block",
    "cylinder",
    "fit_hyperelastic",
    "fit_insertion",
    "fit_modulus",
    "force_distribution",
    "grid",
    "lateral_foundation",
    "load_condensed",
    "modulus_of_shaft_stiffness",
    "picture",
    "plan_entry",
    "press",
    "read_mesh",
    "report",
    "section",
    "shaft_stiffness",
    "stress",
    "stroke",
    "write_vtk",
]
