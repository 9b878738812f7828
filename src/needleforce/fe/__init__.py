# SPDX-License-Identifier: Apache-2.0
"""Tissue as a solid: finite elements around the needle, and what they condense to (extra ``fe``)."""

from .elastic.condensed import CondensedInsertion, CondensedTissue, load_condensed
from .elastic.lateral_foundation import LateralFoundation, lateral_foundation
from .elastic.needle_path import NeedlePath
from .elastic.shaft_stiffness import modulus_of_shaft_stiffness, shaft_stiffness
from .elastic.stress import Stress, stress
from .elastic.surface_contact import SurfaceContact, press
from .elastic.tissue import Tissue
from .fits.force_distribution import ForceDistribution, force_distribution
from .fits.hyperelastic_fit import HyperelasticFit, fit_hyperelastic
from .fits.insertion_fit import InsertionFit, fit_insertion
from .fits.modulus_fit import ModulusFit, fit_modulus
from .hyperelastic.tissue import HyperelasticSolution, HyperelasticTissue
from .materials import Elastic, MooneyRivlin, NeoHookean
from .mesh.block import axisymmetric_block, block, grid
from .mesh.cylinder import cylinder
from .mesh.mesh import Mesh
from .mesh.mesh_file import read_mesh
from .moving.dynamic_insertion import DynamicInsertion, stroke
from .moving.dynamics import DynamicSystem, EnergyBalance, MotionState, Newmark, Rayleigh
from .moving.insertion_run import InsertionEnergy, InsertionRun, InsertionState
from .moving.target_motion import EntryPlan, plan_entry
from .moving.tissue_dynamics import ReducedTissue, TissueDynamics
from .picture import picture
from .section import Section, section
from .solid_report import report
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
