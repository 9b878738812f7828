# SPDX-License-Identifier: Apache-2.0
"""The insertion of a needle that bends: the base's motion in; tip, shape, axial force and base wrench out."""

import math
from collections.abc import Sequence
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import core
from ..checks import instance_of
from ..errors import InputError
from ..mechanics.foundation import foundation_modulus
from .model import Model, solid_engine
from .validity import coupling_warnings, tip_force_warnings

LateralLayer = core.LateralLayer

# an axial law without force: for a needle whose deflection alone is of interest
_NO_FORCE = core.Laws(
    core.laws.Polynomial(linear=1.0, quadratic=0.0),
    core.laws.PunctureDepth(depth=0.0),
    core.laws.Coulomb(per_length=0.0),
    core.laws.NoCutting(),
)

MAX_RADIUS_RATIO = 1.5
"""Largest ratio of the radii of a needle and of the path for which its tissue was condensed: stiffness goes with their
logarithm."""

# by planar, in a solid
_ENGINES = {
    (False, False): core.SpatialInsertion,
    (True, False): core.PlanarInsertion,
    (False, True): core.SpatialInSolid,
    (True, True): core.PlanarInSolid,
}


class FlexibleInsertion:
    """An ``Insertion`` whose needle bends, on a foundation that is attached to the path that its tip has cut.

    The frame is that of the tissue: its undeformed surface at z = 0, z along the insertion, x and y across. A ``roll``
    of 0 is a bevel whose lateral force points along +x.

    Parameters
    ----------
    model : Model, optional
        Laws of the axial force; it compresses the needle and its cutting force drives the bevel. Default: no axial
        force.
    needle : Needle
        Bending stiffness and length [m] from hub to tip.
    lateral : float or sequence of LateralLayer, optional
        Foundation modulus [Pa] of one linear layer, or layers from the surface down. Default: Vesic's modulus of the
        model's tissue. ``nf.fe.lateral_foundation`` has layers that stand for a solid.
    tissue : nf.fe.CondensedTissue, optional
        The solid that the needle drags along its axis; friction and cutting of the model act on it. Default: tissue
        that does not give along the axis.
    guide_distance : float, optional
        Distance of the guide's exit above the surface [m]; the default is a needle held at its hub.
    lateral_compliance, rotational_compliance : float
        Of the guide or hub [m/N], [rad/(N m)]; 0 is clamped.
    pivot_stiffness : float
        Lateral stiffness of the surface at the point of entry [N/m].
    bevel : core.Bevel, optional
        Half angle [rad], friction coefficient and face share of a bevel: the lateral force on the tip per cutting
        force. A layer's ``tip_force`` adds to it.
    bevel_length : float, optional
        Travel over which the tip's lateral force builds up [m]. Default: length of the needle's lancet bevel, else 0.
    sections : sequence of (float, float, float), optional
        End as distance from the tip [m], bending stiffness [N m^2] and unloaded curvature [1/m] of up to four sections
        from the tip on, for a needle that is stepped or bent before. Default: the needle's own.
    planar : bool
        Whether everything stays in the plane of x and z, which takes about two thirds of the time.
    elements : int
        Elements along the embedded needle, 1 to 100.
    small_slopes : bool
        Whether tip and shape leave out the second order of the slopes. Otherwise bending shortens the needle and its
        axial laws feel that, unless no cutting pays for a ``tip_force`` or a bevel: see ``warnings``.
    max_speed, hold_time, depth_noise : float
        As for ``Insertion``.
    **lengths : float
        Of ``core.Bending``: ``hole_radius``, ``unloading``, ``pressure_friction``, ``presliding``, ``path_spacing``,
        ``max_travel``, ``max_slope``.

    Raises
    ------
    InputError
        If a value is outside its range, or nothing states the foundation.

    Notes
    -----
    E I y'''' + N y'' + p(y - Y) = q with the cut path Y, which the tip writes; axial forces follow the tangent. The
    shape is that of a beam whose offset from its path is small; the path itself may turn far. A snapshot is a copy.
    """

    def __init__(
        self,
        model: Model | None,
        needle: core.Needle,
        *,
        lateral: float | Sequence[core.LateralLayer] | None = None,
        tissue: Any = None,
        guide_distance: float = np.inf,
        lateral_compliance: float = 0.0,
        rotational_compliance: float = 0.0,
        pivot_stiffness: float = 0.0,
        bevel: core.Bevel | None = None,
        bevel_length: float | None = None,
        sections: Sequence[tuple[float, float, float]] | None = None,
        planar: bool = False,
        elements: int = 40,
        small_slopes: bool = False,
        max_speed: float = 1.0,
        hold_time: float = 0.0,
        depth_noise: float = 0.0,
        **lengths: float,
    ):
        instance_of("needle", needle, core.Needle, "Give nf.Needle(…).")
        if model is not None:
            instance_of("model", model, Model, "Give nf.preset(…) or None.")
        self.model, self.needle, self.planar, self.guide_distance = model, needle, planar, guide_distance
        self.small_slopes = small_slopes
        self.lateral = _lateral_layers(lateral, model, needle)
        support = core.Support(
            guide_distance=guide_distance,
            needle_length=needle.length,
            lateral_compliance=lateral_compliance,
            rotational_compliance=rotational_compliance,
            pivot_stiffness=pivot_stiffness,
        )
        limits = core.Limits(max_speed=max_speed, hold_time=hold_time, depth_noise=depth_noise)
        length = _bevel_length(needle) if bevel_length is None else bevel_length
        if tissue is not None:
            axial = solid_engine(model, tissue, limits, bevel)
            _check_radius(tissue, needle)
        else:
            axial = core.Insertion(model.stack if model else [(0.0, _NO_FORCE)], limits, bevel or core.Bevel())
        self._core = _ENGINES[planar, tissue is not None](
            axial=axial,
            lateral=self.lateral,
            sections=list(sections) if sections is not None else [(np.inf, needle.bending_stiffness, 0.0)],
            support=support,
            lengths=core.Bending(bevel_length=length, **lengths),
            elements=elements,
            small_slopes=small_slopes,
        )

    def step(
        self,
        depth: float,
        lateral: tuple[float, float] = (0.0, 0.0),
        *,
        roll: float = 0.0,
        tilt: tuple[float, float] = (0.0, 0.0),
        dt: float,
    ) -> core.BentSample:
        """Move the base; never raises.

        Parameters
        ----------
        depth : float
            Travel of the needle along its axis [m], 0 with the tip at the undeformed surface.
        lateral, tilt : (float, float)
            Position of the base across [m] and its slope [rad], in x and y.
        roll : float
            Rotation of the needle about its axis [rad], not wrapped: a step turns it by half a turn at most.
        dt : float
            Time since the last call [s].

        Returns
        -------
        BentSample
            ``tip`` (3,) [m], ``tangent`` (3,), ``force`` [N] along the axis, ``wrench`` (6,) [N] and [N m] of the
            tissue on the needle at the base, ``axial`` with the parts of the force, ``buckled``, ``status``.
        """
        return self._core.step(depth, lateral, tilt, roll, dt)

    def run(
        self,
        depth: ArrayLike,
        lateral: ArrayLike = (0.0, 0.0),
        *,
        roll: ArrayLike = 0.0,
        tilt: ArrayLike = (0.0, 0.0),
        dt: ArrayLike = 1.0,
    ) -> dict[str, np.ndarray]:
        """Move the base along a series of places.

        Parameters
        ----------
        depth, roll, dt : array_like, shape (n,) or scalar
            As for ``step``.
        lateral, tilt : array_like, shape (n, 2) or (2,)
            As for ``step``.

        Returns
        -------
        dict of ndarray
            ``tip`` (n, 3), ``tangent`` (n, 3), ``wrench`` (n, 6), ``force`` (n,), ``status`` (n,) as indices into
            ``Status``, ``buckled`` (n,) of 0 and 1.
        """
        depth = np.ascontiguousarray(depth, dtype=float)
        n = len(depth)
        spread = lambda value, shape: np.ascontiguousarray(np.broadcast_to(np.asarray(value, float), shape))  # noqa: E731
        return self._core.run(
            depth, spread(lateral, (n, 2)), spread(tilt, (n, 2)), spread(roll, (n,)), spread(dt, (n,))
        )

    def shape(self) -> np.ndarray:
        """The needle's centre line from the base to the tip, (n, 3) [m]."""
        return self._core.shape()

    @property
    def path(self) -> np.ndarray:
        """The path that the tip has cut, (n, 3): lateral position over the travel in tissue [m]."""
        return self._core.path()

    @property
    def warnings(self) -> tuple[str, ...]:
        """What keeps bending and axial force of this needle apart, and each ``tip_force`` that does not act in full, as
        sentences; none with ``small_slopes``."""
        if self.small_slopes or self.model is None or not self._core.shortens:
            return () if self.small_slopes or self._core.shortens else coupling_warnings(self.model)
        return tip_force_warnings(self.model, self.lateral)

    def reset(self) -> None:
        """Back to before the first contact."""
        self._core.reset()

    def snapshot(self) -> Any:
        """A copy of state, model and settings, for ``restore`` in this process."""
        return self._core.copy()

    def save(self) -> bytes:
        """The state alone, as bytes for ``restore`` of any ``FlexibleInsertion`` with this model and these settings."""
        return self._core.save()

    def restore(self, snapshot: Any) -> None:
        """Back to a snapshot, or to the bytes of ``save``; the insertion then continues to the bit.

        Parameters
        ----------
        snapshot : object or bytes
            What ``snapshot`` or ``save`` returned.

        Raises
        ------
        InputError
            If the bytes are of another version, model or settings, or altered; then nothing changes.
        """
        self._core.restore(snapshot)

    def __repr__(self) -> str:
        layers = f"{len(self.lateral)} lateral layer{'s' if len(self.lateral) > 1 else ''}"
        return f"<FlexibleInsertion, {layers}, axial force: {self.model.name if self.model else 'none'}>"


def _check_radius(tissue: Any, needle: core.Needle) -> None:
    """Raise InputError for a solid that was condensed for another needle."""
    given, own = tissue.radius, 0.5 * needle.outer_diameter
    if given > 0.0 and not 1.0 / MAX_RADIUS_RATIO <= own / given <= MAX_RADIUS_RATIO:
        limit = f"the tissue is condensed for {1e3 * given:.3g} mm"
        step = "Condense it onto a NeedlePath with the needle's radius."
        raise InputError("radius of the needle", f"{1e3 * own:.3g} mm", limit, next_step=step)


def _lateral_layers(lateral: Any, model: Model | None, needle: core.Needle) -> list[core.LateralLayer]:
    if lateral is None:
        if model is None or model.tissue is None:
            raise InputError(
                "lateral", "missing", "needed where the model has no tissue", next_step="Give a modulus in Pa."
            )
        lateral = foundation_modulus(needle, model.tissue)
    if isinstance(lateral, Real) and not isinstance(lateral, bool):
        return [core.LateralLayer(modulus=float(lateral))]
    layers = getattr(lateral, "layers", lateral)  # of nf.fe.lateral_foundation
    if isinstance(layers, (str, bytes)) or not isinstance(layers, Sequence):
        step = "Give a modulus in Pa, or nf.LateralLayer(…) from the surface down."
        raise InputError("lateral", repr(lateral)[:60], "neither a number nor layers", next_step=step)
    layers = list(layers)
    for number, layer in enumerate(layers, 1):
        if not isinstance(layer, core.LateralLayer):
            raise InputError(
                f"lateral layer {number}", repr(layer), "not a LateralLayer", next_step="Give nf.LateralLayer(…)."
            )
    return layers


def _bevel_length(needle: core.Needle) -> float:
    """Length of a lancet bevel [m], 0 for another tip or none."""
    if not isinstance(needle.tip, core.tips.LancetBevel):
        return 0.0
    return needle.outer_diameter / math.tan(needle.tip.half_angle)
