# SPDX-License-Identifier: Apache-2.0
"""Tissue as a solid: finite elements around the needle, and what they condense to (extra ``fe``)."""

from .block_mesh import axisymmetric_block, block, grid
from .condensed import CondensedInsertion, CondensedTissue, load_condensed
from .force_distribution import ForceDistribution, force_distribution
from .materials import Elastic
from .mesh import Mesh
from .modulus_fit import ModulusFit, fit_modulus
from .needle_path import NeedlePath
from .shaft_stiffness import modulus_of_shaft_stiffness, shaft_stiffness
from .surface_contact import SurfaceContact, press
from .tissue import Tissue

__all__ = [
    "CondensedInsertion",
    "CondensedTissue",
    "Elastic",
    "ForceDistribution",
    "Mesh",
    "ModulusFit",
    "NeedlePath",
    "SurfaceContact",
    "Tissue",
    "axisymmetric_block",
    "block",
    "fit_modulus",
    "force_distribution",
    "grid",
    "load_condensed",
    "modulus_of_shaft_stiffness",
    "press",
    "shaft_stiffness",
]
