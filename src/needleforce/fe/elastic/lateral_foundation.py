# SPDX-License-Identifier: Apache-2.0
"""What a solid is across a needle: for each layer the foundation modulus that gives the needle the same deflection."""

from dataclasses import dataclass
from numbers import Real

import numpy as np

from ... import core
from ...errors import InputError
from .elements import Symmetry
from .needle_path import NeedlePath, check_resolved, check_thickness, layers_along
from .tissue import Tissue, check_kinds

_MAX_LAYERS = 8
_MAX_STIFFNESS = 1e9  # as a section of a needle that bends
_MIN_NODES = 5  # of a path that a needle bends along
_PER_NODE = 50  # points at which the foundation is averaged around a node
_TURNS = 6  # for modulus and the length over which a lateral load decays, which depend on each other
_PROPORTION = 0.3  # relative error of a row over that of moduli in proportion to Young's moduli: some 0.1 over 0.3
_MAX_SHARE = 0.75  # of the length over which a lateral load decays, in a spacing


@dataclass(frozen=True, eq=False)
class LateralFoundation:
    """Layers of a foundation that stand for a solid across a needle.

    Attributes
    ----------
    layers : tuple of LateralLayer
        From the surface down, for ``nf.FlexibleInsertion(lateral=…)``.
    labels : tuple of str
        Of the tissue in each.
    compliance : ndarray, shape (n, n)
        Displacement across at each node of the path for a unit force across at each [m/N], the mean of both directions.
    tip_depth : ndarray, shape (k,)
        Of the tip along the path [m].
    solid_deflection, deflection : ndarray, shape (k,)
        Of a tip at these depths per lateral force on it, in the solid and on the foundation [m/N]: how well one stands
        for the other.
    """

    layers: tuple[core.LateralLayer, ...]
    labels: tuple[str, ...]
    compliance: np.ndarray
    tip_depth: np.ndarray
    solid_deflection: np.ndarray
    deflection: np.ndarray


def lateral_foundation(tissue: Tissue, path: NeedlePath, bending_stiffness: float) -> LateralFoundation:
    """Find the foundation modulus of each layer from the solid around a needle.

    Parameters
    ----------
    tissue : Tissue
        In space, with cells about as small as the needle's radius along the path.
    path : NeedlePath
        Of the needle, with a spacing below the length over which a lateral load decays.
    bending_stiffness : float
        E I of the needle [N m^2], as ``Needle.bending_stiffness``.

    Returns
    -------
    LateralFoundation
        Layers from the surface down, one for each label on the path.

    Raises
    ------
    InputError
        If the mesh is not in space, the path leaves it or is too coarse, or it crosses more than eight layers.

    Notes
    -----
    A solid has no foundation modulus: what it does to a beam depends on how the beam bends. Here the needle has the
    shape of a long beam with a lateral force on its tip, exp(-b s) cos(b s) at a distance s behind the tip, at each
    node of the path in turn; the moduli are those for which the energy of the foundation is that of the solid, and
    where that does not determine them, in thin layers, in proportion to Young's moduli. Biot and Vesic found theirs
    for a beam on a half-space.

    Good for forces on the tip from a depth of two decay lengths 1/b on. A base that moves aside at the surface meets a
    foundation that is too stiff: the solid is displaced 1.4 to 1.6 times as much there.
    """
    check_kinds(tissue, path)
    if tissue.symmetry is not Symmetry.SOLID:
        step = "Use fe.cylinder(…), fe.block of three sizes, or a mesh of your own in space."
        raise InputError("tissue", str(tissue.symmetry), "a needle bends across it only in space", next_step=step)
    _check(path, bending_stiffness)
    labels, tops = _layers(tissue, path)
    compliance = lateral_compliance(tissue, path)
    young = [tissue.materials[label].young_modulus for label in labels]
    moduli = _moduli(compliance, path, tops, stiffness=bending_stiffness, young=young)
    _check_spacing(path, bending_stiffness, moduli.max())
    tips = _tips(path)
    of_solid = (np.linalg.inv(compliance[: k + 1, : k + 1]) for k in tips)
    of_layers = (_of_foundation(path, tops, moduli, k) for k in tips)
    return LateralFoundation(
        layers=tuple(core.LateralLayer(top=float(z), modulus=float(k)) for z, k in zip(tops, moduli)),
        labels=tuple(labels),
        compliance=compliance,
        tip_depth=path.nodes[tips],
        solid_deflection=np.array([_tip_deflection(each, path, bending_stiffness) for each in of_solid]),
        deflection=np.array([_tip_deflection(each, path, bending_stiffness) for each in of_layers]),
    )


def _moduli(compliance: np.ndarray, path: NeedlePath, tops: list[float], stiffness: float, young: list[float]):  # type: ignore[no-untyped-def]
    """Of each layer [Pa], so that the foundation has the energy of the solid for a needle with its tip at each node."""
    layer, tips = _layer_of_node(path, tops), _tips(path)
    squares, energies = np.zeros((len(tips), len(tops))), np.zeros(len(tips))
    for row, k in enumerate(tips):
        shape, energies[row] = _decaying(np.linalg.inv(compliance[: k + 1, : k + 1]), path.nodes[: k + 1], stiffness)
        np.add.at(squares[row], layer[: k + 1], _lengths(path.nodes[: k + 1]) * shape**2)
    return _solved(squares / energies[:, None], np.asarray(young))


def _solved(shares: np.ndarray, young: np.ndarray) -> np.ndarray:
    """Moduli (k,) [Pa] for which ``shares @ moduli`` is 1 in each row, as far as can be.

    Where the rows do not determine them they are in proportion to Young's moduli.

    A layer that is thinner than a decay length is in all rows with others, and what the solid does there depends on
    its neighbours: alone, the rows would make some moduli 0.
    """
    from scipy.optimize import least_squares

    even = young / np.exp(np.log(shares @ young).mean())

    def residual(logarithms: np.ndarray) -> np.ndarray:
        return np.append(np.log(shares @ (even * np.exp(logarithms))), _PROPORTION * logarithms)

    return even * np.exp(least_squares(residual, np.zeros(len(young))).x)


def _decaying(resistance: np.ndarray, at: np.ndarray, stiffness: float) -> tuple[np.ndarray, float]:
    """Shape of a long beam on a foundation with a force at its tip, and twice the solid's energy for it."""
    decay, above = at[-1], at[-1] - at
    lengths = _lengths(at)
    for _ in range(_TURNS):
        shape = np.exp(-above / decay) * np.cos(above / decay)
        energy = float(shape @ resistance @ shape)
        decay = (4.0 * stiffness * (lengths @ shape**2) / energy) ** 0.25
    return shape, energy


def _lengths(at: np.ndarray) -> np.ndarray:
    """Of the needle, that belong to its nodes [m]."""
    return at[1] * np.where((at == at[0]) | (at == at[-1]), 0.5, 1.0)


def _tips(path: NeedlePath) -> np.ndarray:
    """Nodes at which the tip may be: a load at the last is spread over half as much as at the others."""
    return np.arange(_MIN_NODES - 2, len(path.nodes) - 1)


def lateral_compliance(tissue: Tissue, path: NeedlePath) -> np.ndarray:
    """Displacement across a path at each node for a unit force across at each, (n, n) [m/N], mean of two directions."""
    along = path.along(3)
    first = np.cross(along, np.eye(3)[np.abs(along).argmin()])
    first /= np.linalg.norm(first)
    total = np.zeros((len(path.nodes), len(path.nodes)))
    for direction in (first, np.cross(along, first)):
        loads = path.loads(tissue, direction)
        total += 0.5 * (loads.T @ tissue.solve(loads.toarray()))
    total = 0.5 * (total + total.T)
    check_resolved(total, path)
    return total


def _tip_deflection(resistance: np.ndarray, path: NeedlePath, stiffness: float) -> float:
    """Displacement of the last node of a needle whose nodes are resisted so [N/m], per force on it [m/N]."""
    matrix = _beam(len(resistance), path.nodes[1], stiffness)
    matrix[::2, ::2] += resistance
    load = np.zeros(len(matrix))
    load[-2] = 1.0
    return float(np.linalg.solve(matrix, load)[-2])


def _beam(count: int, h: float, stiffness: float) -> np.ndarray:
    """Stiffness of a free beam of equal elements: displacement and slope times h of each node."""
    element = stiffness / h**3 * np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
    matrix = np.zeros((2 * count, 2 * count))
    for k in range(count - 1):
        matrix[2 * k : 2 * k + 4, 2 * k : 2 * k + 4] += element
    return matrix


def _of_foundation(path: NeedlePath, tops: list[float], moduli: np.ndarray, tip: int) -> np.ndarray:
    """Resistance of layers at the nodes down to the tip's [N/m], diagonal."""
    h = path.nodes[1]
    places = (np.arange(tip + 1)[:, None] + np.linspace(-0.49, 0.49, _PER_NODE)) * h
    inside = (places >= 0.0) & (places <= h * tip)
    at = moduli[np.searchsorted(tops, places, side="right").clip(1) - 1]
    return np.diag((at * inside).mean(axis=1) * h)


def _layers(tissue: Tissue, path: NeedlePath) -> tuple[list[str], list[float]]:
    """Labels along the path and where each begins [m]."""
    check_thickness(tissue, path)
    labels, tops = (list(each) for each in zip(*layers_along(tissue, path)))
    if len(tops) > _MAX_LAYERS:
        step = "Give neighbouring layers one label."
        raise InputError("layers along the path", len(tops), f"must be at most {_MAX_LAYERS}", next_step=step)
    thin = np.setdiff1d(np.arange(len(tops)), _layer_of_node(path, tops)[:-1])
    if len(thin):
        step = "Use a smaller spacing, or join thin layers."
        raise InputError("layer", f"{thin[0] + 1} from the surface", "has no node of the path", next_step=step)
    return labels, tops


def _layer_of_node(path: NeedlePath, tops: list[float]) -> np.ndarray:
    return np.searchsorted(tops, path.nodes + 1e-9, side="right") - 1


def _check(path: NeedlePath, stiffness: float) -> None:
    number = isinstance(stiffness, Real) and not isinstance(stiffness, bool)
    if not (number and 0.0 < stiffness <= _MAX_STIFFNESS):
        limit = f"must be above 0 and at most {_MAX_STIFFNESS:g} N m^2"
        raise InputError("bending_stiffness", stiffness, limit, next_step="Give needle.bending_stiffness.")
    if len(path.nodes) < _MIN_NODES:
        raise InputError("nodes of the path", len(path.nodes), f"must be {_MIN_NODES} or more")


def _check_spacing(path: NeedlePath, stiffness: float, modulus: float) -> None:
    decay = (4.0 * stiffness / modulus) ** 0.25
    if path.nodes[1] > _MAX_SHARE * decay:
        limit = f"a lateral load decays over {1e3 * decay:.3g} mm"
        step = f"Use a spacing of at most {1e3 * _MAX_SHARE * decay:.2g} mm."
        raise InputError("spacing of the path", f"{1e3 * path.nodes[1]:.3g} mm", limit, next_step=step)
