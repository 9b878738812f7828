# SPDX-License-Identifier: Apache-2.0
"""Parameters of a tissue while the needle moves, and the force ahead of it."""

import copy
import math
from typing import Any

import numpy as np

from .. import core
from ..checks import within
from ..display.result import Printed
from ..errors import InputError
from ..identification.estimates import Estimate, Parameters
from ..identification.statistics.noise import TWO_SIDED
from ..models.model import Model
from .force_ahead import ForceAhead
from .lugre_model import LuGreModel
from .prior import GENERIC, Prior, core_identifier, prior_of

MAX_VARIANCE_RATIO = 0.5  # of the prior's; below, the motion informs at least as much as the prior
MAX_SHARE = 0.5  # half width over value, where there was no prior
LONGEST = 0.1  # [m]
MODELS = ("layered", "lugre")
LONGEST_FORESEEN = 0.5  # [m]: a puncture that is likelier beyond may never come


class OnlineIdentifier(Printed):
    """Parameters and force ahead, one sample at a time.

    Parameters
    ----------
    prior : Model, Fit, sequence of Recording, mapping of these, or None
        What is expected of the tissue: a model, such as ``nf.preset("paper")``, within a factor of three for each
        parameter; a fit or recordings of the same tissue, with the scatter between them; recordings of other specimens
        of a population, ``{specimen: recordings}``, with the scatter between and within these; or nothing. A prior that
        the motion contradicts is given up.
    model : str
        ``"layered"``, the law of layers in the core, or ``"lugre"``, which has the same contact and events, and behind
        the first puncture the LuGre filters for one friction along the shaft; a step takes up to 1 ms there, in Python.
    **settings
        Of ``core.OnlineSettings`` and ``core.EventSettings``, such as ``memory`` or ``false_alarms``.

    Attributes
    ----------
    prior : Prior
        What was expected.

    Raises
    ------
    InputError
        If the prior or the model is none of these, or a setting is outside its range.
    """

    def __init__(self, prior: Any = None, *, model: str = "layered", **settings: float):
        if model not in MODELS:
            raise InputError("model", model, f"not one of {', '.join(MODELS)}", next_step="Give one of these.")
        self.prior = prior_of(prior)
        self._core = core_identifier(self.prior, **settings)
        start = getattr(self.prior.model, "friction", None)
        start = start if isinstance(start, core.laws.Lugre) else None
        self._lugre = LuGreModel(start, self._core.settings.roughness) if model == "lugre" else None

    def step(self, force: float, depth: float, dt: float) -> core.Detection | None:
        """One sample; it never raises for a number.

        Parameters
        ----------
        force : float
            Force [N], positive against insertion.
        depth : float
            Depth [m] in the stream's own zero.
        dt : float
            Time since the sample before [s].

        Returns
        -------
        Detection or None
            An event, as ``EventDetector.step`` returns it.
        """
        event = self._core.step(force, depth, dt)
        if self._lugre is not None:
            self._lugre.see(self._core, depth, dt)
        return event

    def copy(self) -> "OnlineIdentifier":
        """Another one that has seen the same."""
        other = object.__new__(type(self))
        other.prior, other._core, other._lugre = self.prior, self._core.copy(), copy.deepcopy(self._lugre)
        return other

    def save(self) -> bytes:
        """What it has seen, as bytes for ``restore`` of any ``OnlineIdentifier`` with this prior and these settings."""
        return self._core.save()

    def restore(self, snapshot: bytes) -> None:
        """Back to what ``save`` returned; it then continues to the bit.

        Parameters
        ----------
        snapshot : bytes
            What ``save`` returned.

        Raises
        ------
        InputError
            If they are of another version, prior or settings, altered, or of a state that no stream can leave; nothing
            changes then.
        """
        self._core.restore(snapshot)

    def reset(self) -> None:
        """Back to before the first sample."""
        self._core.reset()
        if self._lugre is not None:
            self._lugre.reset()

    @property
    def status(self) -> str:
        """What the last sample was worth, as of ``EventDetector``."""
        return self._core.status

    @property
    def regime(self) -> str:
        """What the needle does: unknown, free, contact, rupture, sliding, reversing, withdrawal or rest."""
        return self._core.regime

    @property
    def innovation(self) -> float:
        """Normalised innovation squared of the last readings: near 1 where intervals keep what they promise."""
        return self._core.innovation

    @property
    def parameters(self) -> Parameters:
        """What is known of each layer that was touched, with 95 % intervals, under the names of ``fit.parameters``."""
        found: list[Estimate] = []
        for k in range(8):
            layer = self._core.layer(k)
            if layer["touched"]:
                found += self._of_layer(k, layer)
        if self._lugre is not None and self._lugre.filter is not None:
            found = [each for each in found if not each.name.endswith(("friction_per_length", "cutting_force"))]
            found += self._lugre.estimates()
        return Parameters({each.name: each for each in found})

    def _of_layer(self, k: int, layer: dict) -> list[Estimate]:
        prefix = "" if k == 0 else f"layer_{k + 1}_"
        name, unit, factor = self._stiffness
        found = [] if k else [_estimate("contact_depth", self._core.surface, "m")]
        found.append(_estimate(prefix + name, layer["modulus"], unit, factor))
        if layer["pierced"]:
            found.append(_measured(prefix + "puncture_depth", layer["puncture_depth"], "m"))
            found.append(_measured(prefix + "puncture_force", layer["puncture_force"], "N"))
            found.append(_estimate(prefix + "friction_per_length", layer["friction"], "N/m"))
            found.append(_estimate(prefix + "cutting_force", layer["cutting"], "N"))
        return found

    @property
    def _stiffness(self) -> tuple[str, str, float]:
        """Name, unit and factor to the core's modulus: without a tip only its coefficient is known."""
        if self.prior.tip_known:
            return "reduced_modulus", "Pa", 1.0
        half_angle = getattr(self.prior.tip, "half_angle", GENERIC.half_angle)
        return "stiffness_coefficient", "N/m²", 2.0 / math.pi * math.tan(half_angle)

    @property
    def model(self) -> Model:
        """The one-layer model with the parameters so far, for ``nf.Insertion`` and ``LiveInsertion``: values that are
        not known yet are those of the prior, or none."""
        layer = self._core.layer(0)
        contact = core.laws.TipContact(max(layer["modulus"][0], 1.0), self.prior.radius, self.prior.tip)
        depth = layer["puncture_depth"] - self._core.surface[0] if layer["pierced"] else self._expected_puncture()
        friction = core.laws.Coulomb(max(layer["friction"][0], 0.0))
        cutting = core.laws.ConstantCutting(max(layer["cutting"][0], 0.0))
        model = Model(contact, core.laws.PunctureDepth(depth), friction, cutting, name="online")
        return model

    def _expected_puncture(self) -> float:
        known = self.prior.layers[0].get("puncture") if self.prior.layers else None
        return known[0] if known else 0.1

    def ahead(self, distance: float) -> ForceAhead:
        """The force over the next ``distance`` in the direction of the last motion.

        Parameters
        ----------
        distance : float
            Travel [m], above 0 to 0.1.

        Returns
        -------
        ForceAhead

        Raises
        ------
        InputError
            If the distance is not in this range.
        """
        distance = within("distance", distance, 1e-6, LONGEST, "m", next_step="Give the travel ahead in m.")
        found = self._core.ahead(distance)
        if self._lugre is not None and self._lugre.follows(self._core):
            found = self._lugre.ahead(self._core, found, distance)
        depth, low, high = found["puncture"]
        foreseen = 0.0 < depth - found["depth"][0] < LONGEST_FORESEEN
        puncture = Estimate("next_puncture", depth, "m", low, high, source=self.prior.source) if foreseen else None
        arrays = {name: np.array(found[name]) for name in ("depth", "force", "low", "high")}
        return ForceAhead(
            **arrays,
            puncture_probability=found["puncture_probability"],
            next_puncture=puncture,
            layers=self._layers(),
            regime=self.regime,
            status=self.status,
        )

    def _layers(self) -> tuple[float, ...]:
        """Probability of each layer that the tip is in it: by the punctures counted, and by how like the last is
        to that of each layer of the prior."""
        pierced = self._core.pierced
        if pierced == 0:
            return ()
        last = self._core.layer(pierced - 1)
        counted = np.zeros(max(pierced, self.prior.punctures) + 1)
        counted[pierced - 1 : pierced + 1] = 1.0 - last["probability"], last["probability"]
        counted = 0.9 * counted + 0.1 / len(counted)  # an event may have been missed
        depth = last["puncture_depth"] - self._core.layer(0)["top"]
        likely = counted[1:] * [_density(depth, self.prior, k) for k in range(len(counted) - 1)]
        return tuple((likely / (likely.sum() + counted[0])).tolist())

    def _heading(self) -> str:
        return f"OnlineIdentifier: {self.regime}, {self.status}, prior: {self.prior.source}"

    def _cells(self):
        return self.parameters.cells()

    def __repr__(self) -> str:
        return f"<{self._heading()}>"


def _measured(name: str, value: float, unit: str) -> Estimate:
    return Estimate(name, value, unit, value, value, source="event")


def _estimate(name: str, learnt: tuple[float, float, float], unit: str, factor: float = 1.0) -> Estimate:
    value, sd, before = (factor * each for each in learnt)
    half = TWO_SIDED * sd
    if name == "contact_depth":
        return Estimate(name, value, unit, value - half, value + half, source="event and contact")
    informed = sd * sd < MAX_VARIANCE_RATIO * before * before if before else half < MAX_SHARE * abs(value)
    source = "online least squares"
    return Estimate(name, value, unit, value - half, value + half, identifiable=bool(informed), source=source)


def _density(depth: float, prior: Prior, k: int) -> float:
    """How likely a puncture at this depth [m] is of layer k, over that of one at any depth of 100 mm."""
    mean, sd = prior.layers[k].get("puncture", (0.0, 0.0)) if k < len(prior.layers) else (0.0, 0.0)
    normal = 0.1 / (sd * math.sqrt(2.0 * math.pi)) * math.exp(-0.5 * ((depth - mean) / sd) ** 2) if sd else 0.0
    return 0.1 + 0.9 * normal if sd else 1.0
