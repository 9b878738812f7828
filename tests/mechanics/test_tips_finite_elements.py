# SPDX-License-Identifier: Apache-2.0
"""Tips against finite elements: a rigid profile pressed into the surface of an axisymmetric elastic block.

The solution is independent of needleforce's contact: quadratic quadrilaterals, graded towards the contact, and an
active set of the surface nodes in contact. The block is finite, so the error decreases with its size; the rest
decreases with the mesh size.
"""

import numpy as np
import pytest
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementQuad2, ElementVector, MeshQuad, asm

import needleforce as nf


def graded(radius: float, size: float, n: int) -> np.ndarray:
    """Coordinates from 0: n equal cells over 1.5 radii, then cells that grow by an eighth each until `size`."""
    ends = list(np.linspace(0, 1.5 * radius, n + 1))
    step = ends[-1] - ends[-2]
    while ends[-1] < size:
        step *= 1.125
        ends.append(ends[-1] + step)
    return np.array(ends)


@BilinearForm
def stiffness(u, v, w):
    """Axisymmetric linear elasticity, x = (r, z)."""
    r, lame, shear = w.x[0], w.lame, w.shear
    er, ez, et, g = u.grad[0, 0], u.grad[1, 1], u[0] / r, u.grad[0, 1] + u.grad[1, 0]
    dr, dz, dt, k = v.grad[0, 0], v.grad[1, 1], v[0] / r, v.grad[0, 1] + v.grad[1, 0]
    volume = er + ez + et
    return 2 * np.pi * r * (lame * volume * (dr + dz + dt) + 2 * shear * (er * dr + ez * dz + et * dt) + shear * g * k)


class Block:
    """A block of a given size [m], frictionless at the surface, fixed at bottom and side; its surface compliance."""

    def __init__(self, radius: float, size: float, n: int, ratio: float = 0.3):
        x = graded(radius, size, n)
        mesh = MeshQuad.init_tensor(x, -x[::-1])
        basis = Basis(mesh, ElementVector(ElementQuad2()), intorder=4)
        young = 1 - ratio**2  # reduced modulus 1
        lame, shear = young * ratio / ((1 + ratio) * (1 - 2 * ratio)), young / (2 * (1 + ratio))
        matrix = asm(stiffness, basis, lame=lame, shear=shear).tocsc()
        places = basis.doflocs
        held = (places[1] < -size * 0.999) | (places[0] > size * 0.999)
        axial = np.zeros(basis.N, bool)
        axial[np.unique(np.concatenate([basis.nodal_dofs[1], basis.facet_dofs[1], basis.interior_dofs[1]]))] = True
        held |= (places[0] < 1e-12) & ~axial
        free = np.flatnonzero(~held)
        surface = np.flatnonzero((places[1] > -1e-12) & axial & (places[0] < 1.4 * radius) & ~held)
        self.radii = places[0, surface]
        order = np.argsort(self.radii)
        surface, self.radii = surface[order], self.radii[order]
        right = np.zeros((basis.N, len(surface)))
        right[surface, np.arange(len(surface))] = 1.0
        self.compliance = splu(matrix[free][:, free]).solve(right[free])[np.searchsorted(free, surface)]
        self.unknowns = len(free)

    def force(self, height, depth: float) -> float:
        """Force over reduced modulus [m^2] of a profile at a depth: pressing forces only, no penetration."""
        wanted = height(self.radii) - depth  # displacement of a node in contact
        touching = wanted < 0
        for _ in range(60):
            at = np.flatnonzero(touching)
            forces = np.zeros(len(self.radii))
            forces[at] = np.linalg.solve(self.compliance[np.ix_(at, at)], wanted[at])
            moved = self.compliance @ forces
            new = np.where(touching, forces < 0, moved > wanted + 1e-15)
            if (new == touching).all():
                return -forces.sum()
            touching = new
        raise RuntimeError("the active set does not converge")


RADIUS = 0.2e-3  # of the contact [m]; blocks of 10, 20 and 40 radii
SHANK = 0.35e-3


@pytest.fixture(scope="module")
def blocks():
    return {size: Block(RADIUS, size * RADIUS, 16) for size in (10, 20, 40)}


@pytest.mark.parametrize(
    "tip", [nf.tips.TangentOgive(SHANK, 1.3e-3), nf.tips.BluntedCone(1.0, 1e-4), nf.tips.Flat(RADIUS)], ids=repr
)
def test_the_force_of_the_block_converges_to_sneddon_with_its_size(blocks, tip):
    state = {"depth": 1e-4} if tip.name == "flat" else {"contact_radius": RADIUS}
    contact = nf.contact(tip, reduced_modulus=1.0, **state)
    height = tip.height if tip.name != "flat" else lambda r: np.where(r <= RADIUS * 1.001, 0.0, 1.0)
    error = {size: block.force(height, contact.depth) / contact.force - 1 for size, block in blocks.items()}
    print({size: f"{100 * value:.2f} %" for size, value in error.items()})
    # a block fixed at a distance is stiffer, in inverse proportion to the distance: twice the distance, half the error
    assert 0 < error[40] < 0.03
    assert 1.8 < error[10] / error[20] < 2.3 and 1.8 < error[20] / error[40] < 2.3
    # extrapolated to an infinite block
    assert abs(2 * error[40] - error[20]) < 0.005
