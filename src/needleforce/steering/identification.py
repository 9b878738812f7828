# SPDX-License-Identifier: Apache-2.0
"""Identification of a steered needle from whatever was measured: tip paths, base wrenches or shapes."""

import inspect
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from .. import core
from ..errors import InputError
from .needle_shapes import NeedleShape
from .shape_fit import ShapeFit, identify_shapes
from .steering_parameters import NEAREST_GUIDE
from .tip_path_fit import SteeringFit, identify_paths
from .tip_paths import TipPath
from .wrench_fit import BaseWrench, WrenchFit, identify_wrenches

_KINDS: dict[type, Any] = {TipPath: identify_paths, BaseWrench: identify_wrenches, NeedleShape: identify_shapes}


def identify(
    insertions: Sequence[TipPath] | Sequence[BaseWrench] | Sequence[NeedleShape], needle: core.Needle, **options: Any
) -> SteeringFit | WrenchFit | ShapeFit:
    """Identify tissue, tip and guide of a steered needle.

    Parameters
    ----------
    insertions : sequence of TipPath, BaseWrench or NeedleShape
        Measurements of one kind, of one tissue: of ``nf.steering.read``, ``base_wrench`` or ``read_shapes``. Steered
        and unsteered insertions together.
    needle : Needle
        Its bending stiffness scales all forces and stiffnesses that follow from tip paths and shapes.
    **options : object
        ``model``: ``"yielding"`` (the default for tip paths) or ``"linear"``; ``held``: ``"guide"`` or ``"hub"``;
        ``prior``: what other tissues showed, of ``nf.steering.prior``, for tip paths; ``progress``: called with the
        number of evaluations and the cost.

    Returns
    -------
    SteeringFit, WrenchFit or ShapeFit
        Each with ``model``, ``parameters``, ``trade_offs``, ``rms`` and ``predict``.

    Raises
    ------
    InputError
        If there is nothing, or the measurements are of several kinds, too short, or deeper than the needle is long; if
        an option is unknown.

    Notes
    -----
    Insertions of the same name get numbers.
    """
    kinds = {type(each) for each in insertions}
    if len(kinds) != 1 or not kinds <= set(_KINDS):
        given = ", ".join(sorted(kind.__name__ for kind in kinds)) or "nothing"
        limit = "one of TipPath, BaseWrench, NeedleShape is needed, in at least three rows each"
        raise InputError("insertions", given, limit, next_step="Give nf.steering.read(file).")
    method = _KINDS[kinds.pop()]
    known = set(inspect.signature(method).parameters) - {"insertions", "shapes", "needle"}
    if unknown := set(options) - known:
        raise InputError("option", ", ".join(unknown), "unknown", next_step=f"Known are {', '.join(sorted(known))}.")
    for each in insertions:
        deepest = float(np.max(each.depth))
        if not deepest + NEAREST_GUIDE <= needle.length:
            limit = f"the needle is {1e3 * needle.length:g} mm long, and must be {1e3 * NEAREST_GUIDE:g} mm longer"
            step = "Give the whole length of the needle, from its tip to where it is held."
            raise InputError(f"depth of {each.name}", f"{1e3 * deepest:.4g} mm", limit, next_step=step)
    return method(_named_apart(insertions), needle, **options)


def _named_apart(insertions: Sequence[Any]) -> list[Any]:
    """The same insertions; those with the name of an earlier one with a number behind it."""
    counts: Counter[str] = Counter()
    named = []
    for each in insertions:
        counts[each.name] += 1
        number = counts[each.name]
        named.append(each if number == 1 else replace(each, name=f"{each.name} ({number})"))
    return named
