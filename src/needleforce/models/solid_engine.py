# SPDX-License-Identifier: Apache-2.0
"""The engine of a model in a condensed solid."""

from typing import Any

from .. import core
from ..errors import InputError
from .model import Model


def solid_engine(
    model: Model | None, tissue: Any, limits: core.Limits | None = None, bevel: core.Bevel | None = None
) -> core.CondensedInsertion:
    """An insertion of a model, whose friction and cutting drag the solid, into an ``nf.fe.CondensedTissue``. ``bevel``
    is for the lateral force on the tip. Raises InputError if there is no model, the tissue is not condensed, or a law
    does not fit."""
    if model is None:
        step = "Give a model: its friction and cutting drag the solid."
        raise InputError("model", None, "needed with a tissue", next_step=step)
    if not hasattr(tissue, "bonded_stiffness"):
        step = "Give tissue.condense(path), or nf.fe.load_condensed(file)."
        raise InputError("tissue", type(tissue).__name__, "not a CondensedTissue", next_step=step)
    return core.CondensedInsertion(
        tissue.spacing, tissue.compliance, model.stack, limits or core.Limits(), bevel or core.Bevel()
    )


def contact_warnings(engine: core.CondensedInsertion) -> tuple[str, ...]:
    """A sentence where the contact law presses the surface deeper than the tip is, if the solid bears its force."""
    depth, force = engine.puncture
    pressed = force * engine.surface_compliance
    if not pressed > depth:
        return ()
    return (
        f"The contact law is stiffer than the solid: its force at the puncture, {force:.3g} N, would press the surface "
        f"{1e3 * pressed:.3g} mm down where the tip is {1e3 * depth:.3g} mm deep. Forces are the law's; displacements "
        "before the puncture are too large by as much.",
    )
