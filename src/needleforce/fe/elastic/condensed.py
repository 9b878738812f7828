# SPDX-License-Identifier: Apache-2.0
"""A solid condensed onto the needle's path, as a table and as a file, and the insertion that runs on it in the loop."""

import hashlib
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from ... import core
from ...checks import instance_of, within
from ...errors import InputError
from ...files import MAX_RESULT_BYTES, as_type, atomic_write, decode_toml, read_bytes, toml_value
from ...models.model import Model
from ...models.validity import contact_warnings
from .needle_path import Body, NeedlePath, check_resolved, check_thickness

MAX_NODES = 64
_NEXT = "Give a file that CondensedTissue.save wrote."


class CondensedFile(msgspec.Struct, forbid_unknown_fields=True):
    """The keys of a file of condensed tissue, all in SI units."""

    condensed_tissue: str
    spacing: float
    radius: float
    fingerprint: str
    unknowns: int
    compliance: list[list[float]]


@dataclass(frozen=True, eq=False)
class CondensedTissue:
    """Displacements along a path for forces along it: all that the loop needs of a solid.

    Attributes
    ----------
    spacing : float
        Between the nodes of the path, the first at the surface [m].
    compliance : ndarray, shape (n, n)
        Displacement along the path at each node for a unit force at each node, both spread over a spacing to either
        side and around the needle [m/N]; symmetric, n is 2 to 64.
    radius : float
        Of the needle [m].
    summary : str
        What was condensed.
    fingerprint : str
        Of mesh, materials and supports.
    unknowns : int
        Of the solid.
    """

    spacing: float
    compliance: np.ndarray
    radius: float = 0.0
    summary: str = ""
    fingerprint: str = ""
    unknowns: int = 0

    def __post_init__(self) -> None:
        compliance = np.ascontiguousarray(self.compliance, dtype=float)
        if compliance.ndim != 2 or compliance.shape[0] != compliance.shape[1]:
            raise InputError("compliance", f"of shape {compliance.shape}", "must be square")
        within("radius", self.radius, 0.0, 1.0, "m", next_step="Give that of the needle, or 0 if none is known.")
        object.__setattr__(self, "compliance", compliance)

    @property
    def nodes(self) -> np.ndarray:
        """Distances of the nodes along the path (n,) [m]."""
        return self.spacing * np.arange(len(self.compliance))

    def displacement(self, forces: ArrayLike) -> np.ndarray:
        """Displacement along the path at each node for forces at the nodes (n,) [N], (n,) [m]."""
        return self.compliance @ np.asarray(forces, dtype=float)

    def bonded_stiffness(self, length: float) -> float:
        """Force per displacement [N/m] of a rigid shaft that sticks along a length from the surface [m]."""
        if not length <= self.nodes[-1] * (1.0 + 1e-9):
            limit = f"the path is {1e3 * self.nodes[-1]:g} mm long"
            raise InputError("length", f"{1e3 * length:g} mm", limit, next_step="Condense onto a longer path.")
        count = int(np.searchsorted(self.nodes, length * (1.0 + 1e-9), side="right"))
        if count < 2:
            raise InputError("length", f"{1e3 * length:g} mm", f"must be {1e3 * self.spacing:g} mm or more")
        return float(np.linalg.solve(self.compliance[:count, :count], np.ones(count)).sum())

    def save(self, path: str | os.PathLike) -> None:
        """Write a file that ``load_condensed`` reads. Raises InputError if it cannot be written."""
        numbers = "\n".join(f"  [{', '.join(map(repr, map(float, row)))}]," for row in self.compliance)
        with atomic_write(path) as file:
            file.write(f"condensed_tissue = {toml_value(self.summary)}\n")
            file.write(f"spacing = {float(self.spacing)!r}  # m\nradius = {float(self.radius)!r}  # m\n")
            file.write(f'fingerprint = "{self.fingerprint}"\nunknowns = {self.unknowns}\n')
            file.write(f"compliance = [  # m/N\n{numbers}\n]\n")


def load_condensed(path: str | os.PathLike) -> CondensedTissue:
    """Read a condensed tissue.

    Raises
    ------
    InputError
        If the file is missing, not one of ``CondensedTissue.save``, or its table is no compliance.
    """
    text = read_bytes(Path(path), "condensed tissue", MAX_RESULT_BYTES)
    try:
        file = as_type(decode_toml(text, "condensed tissue"), CondensedFile, "condensed tissue", _NEXT)
        rows = [len(row) for row in file.compliance]
        if not rows or set(rows) != {len(rows)}:
            raise InputError("compliance", f"{len(rows)} rows of {rows[:1]}", "must be square", next_step=_NEXT)
        found = CondensedTissue(
            file.spacing, np.array(file.compliance), file.radius, file.condensed_tissue,
            fingerprint=file.fingerprint, unknowns=file.unknowns,
        )  # fmt: skip
        core.check_condensed(found.spacing, found.compliance)
    except InputError as error:
        raise error.at(str(path)) from None
    return found


def condensed(tissue: Body, path: NeedlePath) -> CondensedTissue:
    """The compliance of a tissue between the nodes of a path. Raises InputError if the path has more than 64 nodes or
    leaves the mesh, or a layer on it is thinner than the needle."""
    count = len(path.nodes)
    if count > MAX_NODES:
        step = f"Use a spacing of at least {1e3 * path.depth / (MAX_NODES - 1):.3g} mm."
        raise InputError("nodes of the path", count, f"must be at most {MAX_NODES}", next_step=step)
    loads = path.loads(tissue)
    check_thickness(tissue, path)
    dense = loads.toarray()
    compliance = loads.T @ tissue.solve(dense)
    compliance = 0.5 * (compliance + compliance.T)
    check_resolved(compliance, path)
    mesh = tissue.mesh
    summary = f"{tissue.symmetry}, {len(mesh.cells)} cells of shape {mesh.shape}, order {tissue.elements.order}"
    return CondensedTissue(
        float(path.nodes[1]), compliance, path.radius, summary,
        fingerprint=fingerprint(tissue), unknowns=tissue.unknowns,
    )  # fmt: skip


def fingerprint(tissue: Body) -> str:
    """A number that distinguishes solids by mesh, materials, supports and elements."""
    parts: Sequence[Any] = (
        tissue.mesh.points.tobytes(), tissue.mesh.cells.tobytes(), "\n".join(map(str, tissue.mesh.labels)).encode(),
        repr(sorted(tissue.materials.items())).encode(), repr(sorted(tissue.supports.items())).encode(),
        repr((str(tissue.symmetry), tissue.elements.order, tissue.elements.thickness)).encode(),
    )  # fmt: skip
    sums = hashlib.sha256()
    for part in parts:
        sums.update(hashlib.sha256(part).digest())
    return sums.hexdigest()


class CondensedInsertion(core.CondensedInsertion):
    """A rigid needle in a condensed solid, stepped one cycle at a time: friction and tip drag the tissue.

    Methods: ``step(depth, velocity, dt) -> Sample``, ``run(depth, dt)`` over arrays, ``reset()``, ``snapshot()``,
    ``restore(snapshot)``, ``save()``; ``shaft_force`` [N] and ``displacement`` [m] at the nodes of the path, ``tip``
    [m]. A step never raises; the ``status`` of its sample reports invalid input, and ``warnings`` states what does not
    fit together.

    Parameters
    ----------
    tissue : CondensedTissue
        Of ``Tissue.condense`` or ``load_condensed``.
    model : Model
        Friction per length, cutting and puncture in each layer; friction has a sliding force per length without memory
        (``coulomb``, ``karnopp``, ``lugre``). A ``prony``, the same in each layer, is that of solid, contact and tip.
    max_speed : float
        Largest speed between two steps [m/s]; a faster step is refused.
    hold_time : float
        How long a refused step keeps the last force before it becomes 0 [s], 0 to 1.
    depth_noise : float
        As for ``Insertion``.
    bevel : core.Bevel, optional
        For the lateral force on the tip per cutting force.

    Raises
    ------
    InputError
        If the table is no compliance, or a law does not fit.
    """

    def __init__(
        self,
        tissue: CondensedTissue,
        model: Model,
        *,
        max_speed: float = 1.0,
        hold_time: float = 0.0,
        depth_noise: float = 0.0,
        bevel: core.Bevel | None = None,
    ):
        instance_of("model", model, Model, "Give nf.preset(…) or nf.Model(…).")
        instance_of("tissue", tissue, CondensedTissue, "Give tissue.condense(path), or load_condensed(file).")
        limits = core.Limits(max_speed=max_speed, hold_time=hold_time, depth_noise=depth_noise)
        super().__init__(tissue.spacing, tissue.compliance, model.stack, limits, bevel or core.Bevel())
        self.model, self.tissue = model, tissue

    @property
    def warnings(self) -> tuple[str, ...]:
        """What does not fit together in model and tissue, as sentences."""
        return contact_warnings(self)

    def snapshot(self) -> "CondensedInsertion":
        """A copy with its state, which can be stepped independently or passed to ``restore``."""
        copy = CondensedInsertion(self.tissue, self.model)
        copy.restore(self)
        return copy
