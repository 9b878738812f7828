# SPDX-License-Identifier: Apache-2.0
"""The figures of measured and modelled force with titles and captions."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from ...display.markup import element, join
from ...display.page import Figure
from ...display.quantities import plain
from ...models.model import Model
from ..estimates import Quality
from . import figures
from .curves import FORCE_SHARE, RESIDUAL_FACTOR, DrawnRepeat
from .words import IN_TABLES, spans

_MEASURED = element("b", "Measured", class_="measured")
_POPULATION = "Dashed: prediction for a new insertion, its ruptures distributed over their scatter between repeats. "
_KEY = join([_MEASURED, " thin and grey, ", element("b", "model", class_="model"), " thick and orange. "])


def _figure(name: str, title: str, caption: object, draw: Callable, heights: tuple[float, float]) -> Figure:
    alt = f"{title}. {IN_TABLES}"
    return Figure(name=name, title=title, caption=caption, alt=alt, draw=draw, heights=heights)


def touching(drawn: Sequence[DrawnRepeat]) -> tuple[DrawnRepeat, ...]:
    """The recordings in which the needle touches the tissue."""
    return tuple(one for one in drawn if one.fit.events.contact is not None)


def over_depth(
    drawn: Sequence[DrawnRepeat], one: DrawnRepeat, shared_contact: float | None, population: np.ndarray | None
) -> Figure:
    """Force over depth of every repeat, and of the model along ``one``; ``population`` (n,) [N] is the prediction for a
    new insertion along the same motion, if there is one."""
    shown = touching(drawn) or (one,)
    model = f"The model follows the motion of recording {one.number}. " if len(shown) > 1 and one.has_model else ""
    shared = shared_contact is not None
    identified = shared or "contact_depth" in one.fit.parameters
    contact = f"the {'identified' if identified else 'detected'} contact"
    contact += "" if shared or len(shown) == 1 else " of each recording"
    dashed = "" if population is None else _POPULATION
    words = [_KEY if one.has_model else "", model, dashed, f"Indentation is measured from {contact}."]
    draw = partial(figures.over_depth, drawn=shown, chosen=one, population=population)
    return _figure("depth", "Force over depth, insertion and withdrawal", join(words), draw, (300, 260))


def over_time(one: DrawnRepeat, among: int) -> Figure:
    """Force over time of the recording with the median residual."""
    which = f"Recording {one.number}, the one with the median residual. " if among > 1 and one.has_model else ""
    bands = "Bands are phases; circles are the detected events with their measured force."
    caption = join([which, _KEY if one.has_model else "", bands])
    return _figure("time", "Force over time", caption, partial(figures.over_time, one=one), (280, 240))


def before_puncture(shown: Sequence[DrawnRepeat], model: Model | None, shared: bool, title: str) -> Figure:
    """Force before the puncture of the repeats that touch the tissue, and of the model; ``shared`` is whether they have
    one contact."""
    contact = "the identified" if shared else "its own"
    start = f"Every repeat from {contact} contact; circles are" if len(shown) > 1 else "From contact; the circle is"
    caption = f"{start} the first puncture as measured. {_law(model)}"
    draw = partial(figures.before_puncture, drawn=shown, model=model)
    alt = f"{title}. {IN_TABLES}"
    return Figure(
        name="stiffness", title=title, caption=caption, alt=alt, draw=draw, heights=(250, 230), side_caption=True
    )


def _law(model: Model | None) -> str:
    """What the model's curve before the puncture is."""
    if model is None:
        return ""
    layers_sum = "The model is the sum of the layers that the tip has reached, at the mean speed."
    summary = layers_sum if model.deeper else model.stiffness.summary
    return f"{summary} The model's curve ends at the identified puncture."


def residuals(drawn: Sequence[DrawnRepeat], quality: Quality | None) -> list[Figure]:
    """Residuals over depth; none without a model."""
    shown = tuple(one for one in drawn if one.has_model)
    if not shown or quality is None:
        return []
    rms = quality.rmse_N
    lines = (
        "Lines: mean residual of each repeat at each depth" if len(shown) > 1 else "Line: mean residual at each depth"
    )
    among = " without anomalous recordings" if any(one.anomalous for one in shown) else ""
    band = f"Orange band: ± the rms residual, {plain(rms, 'N', rms)}."
    caption = f"{lines}. Grey: range of all samples{among}. {band}"
    draw = partial(figures.residuals, drawn=shown, rmse=rms)
    return [_figure("residuals", "Residuals over depth", caption, draw, (220, 400))]


def multiples(drawn: Sequence[DrawnRepeat], anomalous: set[int]) -> list[Figure]:
    """Every recording over time; none with fewer than two."""
    if len(drawn) < 2:
        return []
    heights = figures.multiples_height(len(drawn), False), figures.multiples_height(len(drawn), True)
    caption = join([_KEY if any(one.has_model for one in drawn) else "", _anomaly_words(anomalous)])
    draw = partial(figures.multiples, drawn=drawn)
    return [_figure("recordings", "Every recording, on the same axes", caption, draw, heights)]


def _anomaly_words(anomalous: set[int]) -> str:
    """Which recordings are anomalous, and by which rule."""
    rule = f"a residual above {RESIDUAL_FACTOR:g} times the median"
    rule += f", or a puncture force more than {100 * FORCE_SHARE:.0f}\N{NO-BREAK SPACE}% from the median"
    named = f"Anomalous (blue): no. {spans(anomalous)}, with {rule}."
    return named if anomalous else f"No recording is anomalous: none has {rule}."
