# SPDX-License-Identifier: Apache-2.0
"""An insertion whose model other threads replace while the loop runs."""

from .. import core
from ..errors import InputError
from ..models.model import Model


class LiveInsertion(core.LiveInsertion):
    """An insertion whose model other threads may replace while one thread, the loop, steps it.

    ``step(depth, velocity, dt) -> Sample`` and ``reset()`` as of an ``Insertion``; ``replace(model)`` from any thread.
    The memory of the hole goes on; the force goes evenly from the old model's to the new one's over ``blend_time`` [s],
    0 to 1, and the next model is taken when that is over. ``max_speed`` [m/s], ``hold_time`` [s] and ``bevel`` as of an
    ``Insertion``. ``taken``, ``refused``, ``last_refused`` and ``blending`` say what became of the models. Raises
    InputError for what is no model, and for times and speeds outside their limits.
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
            raise InputError("blend_time", blend_time, f"must be 0 to {core.longest_blend:g} s")
        limits = core.Limits(max_speed=max_speed, hold_time=hold_time)
        super().__init__(_layers(model), blend_time, limits, bevel or core.Bevel())

    def replace(self, model: Model) -> None:
        """Offers a model to the loop, which takes the newest over with its next step, or after a blend.

        It is checked and prepared in the calling thread, without the interpreter's lock. Raises InputError for what is
        no model; then the model before it goes on.
        """
        self.replace_layers(_layers(model))


def _layers(model: Model) -> list:
    if not isinstance(model, Model):
        raise InputError("model", type(model).__name__, "not a Model", next_step="Give nf.preset(…) or nf.Model(…).")
    return model.stack
