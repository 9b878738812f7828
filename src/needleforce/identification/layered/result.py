# SPDX-License-Identifier: Apache-2.0
"""The result of a layered fit: in addition the rupture depths, the uncertainty of the parameters, and the model for an
insertion that was not recorded."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...models.model import Model
from ...recording import Recording
from ...segmentation import Events
from ...segmentation.strokes import cycles
from ..estimates import Correlations
from ..models import with_ruptures
from ..result import Fit
from ..settings import LayeredSettings
from ..strokes import stroke_speed
from .binned_cycle import recorded_punctures
from .prediction import Expectation, Ruptures
from .uncertainty import Uncertainty


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class LayeredFit(Fit):
    """A layered model identified from complete cycles of repeats; all attributes of ``Fit``, and in addition:

    Attributes
    ----------
    ruptures : Ruptures
        Mean depths at which the layers rupture, and their scatter.
    expectation : Expectation or None
        The mean force over that scatter; None without a model.
    uncertainty : Uncertainty
        Covariance of the parameters and their scatter between repeats.
    population : Model or None
        The model for an insertion that was not recorded, with the scatter of the ruptures in its rupture length; None
        from one recording.
    population_contact : float
        Depth [m] of its surface in the recordings' zero.
    """

    settings: LayeredSettings
    ruptures: Ruptures
    expectation: Expectation | None = None
    uncertainty: Uncertainty | None = None
    population: Model | None = None
    population_contact: float = 0.0

    def predict(self, recording: Recording, events: Events | None = None) -> np.ndarray:
        """As ``Fit.predict``: the mean force over the scatter of the rupture depths, which errs least.

        With ``events`` a layer ruptures at the puncture that plausibly is its own, by depth and drop; a layer without
        one keeps its scatter. Forces change with the power ``speed_exponent`` of the insertion's speed if it was
        identified.
        """
        self.identified_model()
        if self.expectation is None:
            return self._speed_factor(recording) * super().predict(recording, events)
        shift = self.ruptures.shift(events)
        own = () if events is None else self.ruptures.assigned(recorded_punctures(events, recording), shift)
        dt = np.diff(recording.time, prepend=recording.time[0] - 1.0 / recording.rate)
        force = self.expectation.force(np.ascontiguousarray(recording.depth, float), dt, own, shift)
        return self._speed_factor(recording) * force

    def new_insertion(self, recording: Recording) -> np.ndarray | None:
        """As ``predict``; None from one recording."""
        return None if self.population is None else self.predict(recording)

    def placed(self, recording: Recording, events: Events | None = None) -> tuple[Model, float]:
        """As ``Fit.placed``; without ``events`` the population model. Forces at another speed are not scaled."""
        model, contact = self.identified_model(), self.parameters["contact_depth"].value
        if self.population is not None and (events is None or not events.punctures):
            return self.population, self.population_contact + self.ruptures.shift(events)
        if events is None:
            return model, contact
        shift, depths = self.ruptures.of(events, recording)
        return with_ruptures(model, depths - contact - shift), contact + shift

    def document(self) -> dict:
        """As of a ``Fit``, with the rupture depths in the recordings' zero and the population model."""
        from ..export import preset_document

        found, model = self.ruptures, self.population
        ruptures = {"depth_m": found.depth, "past_peak_m": found.past_peak, "contact_depth_m": found.contact}
        population = {"contact_depth_m": self.population_contact, "preset": preset_document(model)}
        return super().document() | {"ruptures": ruptures, "population": None if model is None else population}

    @property
    def shared_contact(self) -> float | None:
        """Depth [m] of the surface, which all recordings share."""
        return self.parameters["contact_depth"].value if "contact_depth" in self.parameters else None

    @property
    def correlations(self) -> Correlations | None:
        """Correlations of the errors within the runs."""
        return None if self.uncertainty is None else self.uncertainty.correlations()

    def draws(self, count: int = 4000, seed: int = 0) -> Any:
        """Draws of the parameters that the repeats share, not of single recordings. See ``Uncertainty.draws``."""
        from ..statistics.draws import Draws, checked_count

        random = np.random.default_rng(seed)
        return Draws(self.uncertainty.draws(checked_count(count), random), {}, (), ("layered fit",))

    def _speed_factor(self, recording: Recording) -> float:
        """Factor of the model's forces at the speed of a recording's insertion."""
        exponent, strokes = self.parameters.get("speed_exponent"), cycles(recording.time, recording.depth)
        if exponent is None or not strokes:
            return 1.0
        inwards = slice(strokes[0].start, strokes[0].stop)
        speed = stroke_speed(recording.time[inwards], recording.depth[inwards])
        return (speed / self.settings.speed_m_s) ** exponent.value
