# SPDX-License-Identifier: Apache-2.0
"""The result of an identification: estimates with intervals, what was held fixed, and the model with its residual."""

import dataclasses
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..display.axes import FORCE, INDENTATION
from ..display.canvas import MEASURED, MODEL
from ..display.quantities import percent
from ..errors import InputError
from ..models.model import Model
from ..recording import Recording
from ..segmentation import Events, segment
from ..vocabulary import Status
from .estimates import Correlations, EstimateResult, Parameters, Quality, correlations_of, not_identifiable
from .models import run_model
from .one_layer.machine_stiffness import at_tip
from .recording_fit import RecordingFit
from .replay import replayed
from .settings import Choice, FitSettings
from .two_pass.result import TwoPass

if TYPE_CHECKING:
    from ..display.page import Page


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Fit(EstimateResult):
    """The identification of one condition from one or more repeats.

    Attributes
    ----------
    recordings : tuple of RecordingFit
        The result of each recording.
    parameters : Parameters
        Pooled estimates by name, also as attributes: ``fit.parameters.puncture_force``.
    identified_model : Model or None
        The model; None where no recording could be identified. ``fit.model`` is the same, or an error with the reason.
    quality : Quality or None
        Residual over all recordings with a model.
    warnings : tuple of str
        Limits that the recordings or the model exceed.
    held_fixed : tuple of str
        What was assumed and not identified.
    unknown : tuple of str
        What these recordings cannot identify.
    choice : tuple of Choice
        The stiffness laws compared, the chosen one first, then by their BIC.
    settings : FitSettings or None
        How the identification was run; None where nothing could be read.
    two_pass : TwoPass or None
        Friction and cutting force from second passes; None without them.
    """

    recordings: tuple[RecordingFit, ...] = ()
    parameters: Parameters = field(default_factory=Parameters)
    identified_model: Model | None = None
    quality: Quality | None = None
    warnings: tuple[str, ...] = ()
    held_fixed: tuple[str, ...] = ()
    unknown: tuple[str, ...] = ()
    choice: tuple[Choice, ...] = ()
    settings: FitSettings | None = None
    two_pass: TwoPass | None = None

    def __post_init__(self):
        object.__setattr__(self, "parameters", Parameters(self.parameters))

    def predict(self, recording: Recording, events: Events | None = None) -> np.ndarray:
        """The force of the identified model along the motion of a recording.

        Parameters
        ----------
        recording : Recording
            Its time and depth are used, not its force; where the fit has a ``machine_stiffness``, the force too, for
            the depth of the tip.
        events : Events, optional
            As from ``segment(recording)``: contact, punctures, and the stiffness by the forces at these are then the
            recording's own where they were found (a replay), the depths as the fit's recordings have them by the same
            events. Without it they are the means of the fit.

        Returns
        -------
        numpy.ndarray
            Force (n,) [N] at the recording's samples.

        Raises
        ------
        InputError
            For a fit without a model.
        """
        if "machine_stiffness" not in self.parameters:
            return self._predicted(recording, events)
        tip = at_tip(recording, self.parameters["machine_stiffness"].value)
        events = None if events is None else segment(tip)
        return self._predicted(tip, events)

    def _predicted(self, tip: Recording, events: Events | None) -> np.ndarray:
        """The force (n,) [N] along the motion of the tip."""
        model, surface = self.placed(tip, events)
        return run_model(model, tip, surface)

    def placed(self, recording: Recording, events: Events | None = None) -> tuple[Model, float]:
        """The model that ``predict`` runs along a recording, and the depth of its surface; for a control loop.

        Parameters
        ----------
        recording : Recording
            The motion.
        events : Events, optional
            As in ``predict``.

        Returns
        -------
        tuple of Model and float
            The model, and the depth [m] of its surface in the recording's zero: give ``nf.Insertion(model)`` the
            recording's depth minus this depth.

        Raises
        ------
        InputError
            For a fit without a model.
        """
        model, contact = self.model, self.parameters["contact_depth"].value
        if events is None:
            return model, contact
        return replayed(model, self.parameters, self.recordings, events, recording)

    @property
    def shared_contact(self) -> float | None:
        """Depth [m] of the surface where all recordings share it; None where each has its own."""
        return None

    def new_insertion(self, recording: Recording) -> np.ndarray | None:
        """Force (n,) [N] expected of an insertion that was not recorded, along the motion of a recording; None where no
        scatter between repeats is known."""
        return None

    @property
    def residuals(self) -> tuple[np.ndarray, ...]:
        """Measured minus modelled force (n,) [N] of each recording; empty for one without a model."""
        return tuple(each.residuals for each in self.recordings)

    @property
    def correlations(self) -> Correlations | None:
        """Correlations of the estimates within a recording; None where no recording was identified."""
        return correlations_of(self.recordings)

    def draws(self, count: int = 4000, seed: int = 0) -> Any:
        """Independent draws of the identified parameters.

        Parameters
        ----------
        count : int
            Number of draws, from 1 to 10 million.
        seed : int
            The same seed gives the same draws.

        Returns
        -------
        Draws
            See ``draws_of``.

        Raises
        ------
        InputError
            For a count out of range, and where no recording has a one-layer fit.
        """
        from .statistics.draws import draws_of

        passes = len(self.two_pass.sites) if self.two_pass else 1
        return draws_of(self.recordings, self.parameters, count, seed, passes=passes)

    def to_arviz(self, draws: int = 4000, seed: int = 0) -> Any:
        """The draws as ArviZ inference data; see ``inference_data``. Raises InputError without ArviZ."""
        from .export import inference_data

        return inference_data(self.draws(draws, seed))

    def to_csv(self, path: Any) -> None:
        """Write every estimate, pooled and of each recording, as a CSV table; see ``write_estimates``."""
        from .export import write_estimates

        write_estimates(self, path)

    def document(self) -> dict:
        """The complete fit as dicts and lists, in the form of ``needleforce identify --json``."""
        from .export import fit_document

        return fit_document(self)

    def _page(self, table: Sequence[dict[str, Any]] = ()) -> "Page":
        """The report, with a comparison with known true values: rows of ``table`` with the keys quantity, unit, paper,
        paper_sd, true, identified, low and high, in SI units, None, or text such as "not yet"."""
        from .report.page import fit_page

        return fit_page(self, table)

    def save(self, path: Any) -> None:
        """Write the identified model as a preset file. Raises InputError for a fit without a model."""
        from ..preset_files.build import save

        save(self.model, path)

    def _draw(self, axes: Any) -> tuple[str, ...]:
        """Force over indentation, measured and modelled, of every recording; one with a model names both."""
        drawn = [each for each in self.recordings if each.recording is not None]
        for k, each in enumerate(sorted(drawn, key=lambda each: not len(each.predicted))):
            surface = each.surface if self.shared_contact is None else self.shared_contact
            indentation = 1e3 * (each.recording.depth - surface)
            axes.plot(indentation, each.recording.force, color=MEASURED, lw=0.8, label="" if k else "measured")
            if len(each.predicted):
                axes.plot(indentation, each.predicted, color=MODEL, lw=1.2, label="" if k else "model")
        return INDENTATION, FORCE

    @property
    def model(self) -> Model:
        """The identified model. Raises InputError with the reason where ``identified_model`` is None."""
        if self.identified_model is None:
            stated = [each for each in self.warnings if each.startswith("No model")]
            stated = stated or [note for each in self.recordings for note in each.notes[:1]]
            reason = "; ".join(stated) or "there was no recording"
            step = "See fit.warnings and the notes of each of fit.recordings."
            raise InputError("model of the fit", "missing", reason, next_step=step)
        return self.identified_model

    def _heading(self) -> str:
        answering = sum(bool(each.parameters) for each in self.recordings)
        name = "no model" if self.identified_model is None else f"model {self.model.name}"
        rms = "" if self.quality is None else f", residual {1e3 * self.quality.rmse_N:.3g} mN rms"
        share = ""
        if self.quality is not None:
            share = f" ({percent(self.quality.nrmse)} of the peak, R² {self.quality.r2:.3f})"
        return f"{type(self).__name__}: {name}, {answering} of {len(self.recordings)} recordings identified{rms}{share}"

    def _remarks(self) -> Iterable[tuple[str, tuple[str, ...]]]:
        """Titles with their sentences."""
        without_parameters = tuple(
            f"{each.file}: {each.status}" + "".join(f": {note}" for note in each.notes[:1])
            for each in self.recordings
            if not each.parameters
        )
        sources = {each.source for each in self.parameters.values()}
        yield "Not identified", without_parameters
        yield "Warnings", self.warnings
        yield "How obtained", tuple(sources) if len(sources) == 1 else ()
        yield "Held fixed", self.held_fixed
        yield "Cannot be identified", self.unknown


def with_not_identifiable(fit: Fit, names: Iterable[str]) -> Fit:
    """The fit, of which the parameters with these ``names`` are not identifiable, pooled or of a recording."""
    names = tuple(names)
    recordings = tuple(
        dataclasses.replace(each, parameters=not_identifiable(each.parameters, names)) for each in fit.recordings
    )
    return dataclasses.replace(fit, parameters=not_identifiable(fit.parameters, names), recordings=recordings)


def with_unreadable(fit: Fit | None, unreadable: list[tuple[str, InputError]]) -> Fit:
    """``fit`` with an entry for each (file, error) that could not be read; None is an empty fit."""
    fit = fit or Fit()
    none = {"status": Status.unreadable, "recording": None, "events": Events(status=Status.unreadable)}
    entries = tuple(RecordingFit(file=file, notes=(str(error),), **none) for file, error in unreadable)
    return dataclasses.replace(fit, recordings=fit.recordings + entries)
