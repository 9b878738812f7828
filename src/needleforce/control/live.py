# SPDX-License-Identifier: Apache-2.0
"""An insertion whose model can be replaced by other threads while the loop runs."""

from .. import core
from ..errors import InputError
from ..models.model import Model


class LiveInsertion(core.LiveInsertion):
    """An insertion whose model other threads may replace while one thread, the loop, steps it.

    ``step(depth, velocity, dt) -> Sample`` and ``reset()`` are those of an ``Insertion``. After ``replace`` the memory
    of the hole is kept, and the force changes linearly from the old to the new model during the blend; a further model
    is accepted when the blend is complete. ``taken`` and ``refused`` count models, ``last_refused`` and ``blending``
    are flags.

    Parameters
    ----------
    model : Model
        The first model.
    blend_time : float
        Duration of the blend from one model to the next [s], 0 to 1.
    max_speed, hold_time, bevel
        As for ``Insertion``.

    Raises
    ------
    InputError
        If the model is not a ``Model``, or a time or speed is outside its range.
    """

    def __init__(
        self,
        model: Model,
        *,
        blend_time: float = 10e-3,
        max_speed: float = 1.0,
        hold_time: float = 0.0,
        bevel: core.Bevel | None = None,
    ):
        if not 0.0 <= blend_time <= core.longest_blend:
            raise InputError("blend_time", f"{blend_time} s", f"outside 0 to {core.longest_blend:g} s")
        limits = core.Limits(max_speed=max_speed, hold_time=hold_time)
        super().__init__(_layers(model), blend_time, limits, bevel or core.Bevel())

    def replace(self, model: Model) -> None:
        """Offer a model to the loop, which uses the newest one from its next step on, or after the present blend.

        The model is checked and prepared in the calling thread, without the interpreter's lock.

        Parameters
        ----------
        model : Model
            The new model.

        Raises
        ------
        InputError
            If the model is invalid; the loop then continues with the previous one.
        """
        self.replace_layers(_layers(model))


def _layers(model: Model) -> list[tuple[float, core.Laws]]:
    if not isinstance(model, Model):
        raise InputError("model", type(model).__name__, "not a Model", next_step="Give nf.preset(…) or nf.Model(…).")
    return model.stack
