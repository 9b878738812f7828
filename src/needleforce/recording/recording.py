# SPDX-License-Identifier: Apache-2.0
"""A recording of one experiment, simulated or measured, with its provenance."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from .. import core
from ..display.markup import Markup
from ..display.quantities import spanned
from ..display.result import Printed, with_drawing
from ..errors import InputError

COLUMNS = ("time", "depth", "velocity", "force")
UNITS = {"time": "s", "depth": "m", "velocity": "m/s", "tx": "N m", "ty": "N m", "tz": "N m"}

_DERIVATIVE_WINDOW_S = 0.05  # s: the change of depth over this time gives the velocity


def derivative(time: np.ndarray, depth: np.ndarray) -> tuple[np.ndarray, float]:
    """Differentiate depth over about 50 ms around each sample.

    Parameters
    ----------
    time : (n,) array
        Times [s], increasing.
    depth : (n,) array
        Depth [m].

    Returns
    -------
    velocity : (n,) array
        Velocity [m/s]. The window is truncated at the ends of the recording and spans at least the two neighbours.
    window : float
        The length of the window [s].
    """
    step = core.median_step(time)
    half = min(max(1, round(0.5 * _DERIVATIVE_WINDOW_S / step)), (len(time) - 1) // 2)
    if half == 0:  # two samples
        return np.full(len(time), (depth[1] - depth[0]) / (time[1] - time[0])), step
    velocity = np.empty(len(time))
    velocity[half:-half] = (depth[2 * half :] - depth[: -2 * half]) / (time[2 * half :] - time[: -2 * half])
    velocity[:half] = (depth[half : 2 * half] - depth[0]) / (time[half : 2 * half] - time[0])
    velocity[-half:] = (depth[-1] - depth[-2 * half : -half]) / (time[-1] - time[-2 * half : -half])
    return velocity, 2 * half * step


@dataclass(frozen=True)
class Note:
    """An observation made while reading a recording.

    Parameters
    ----------
    kind : str
        A short name, such as ``gap``, ``jitter``, ``baseline`` or ``glitch``.
    message : str
        A sentence for the user.
    count : int
        How often it occurs.
    """

    kind: str
    message: str
    count: int = 1


@dataclass(frozen=True, kw_only=True)
class GivenEvents:
    """Events of a recording that were given instead of found, by their times.

    Parameters
    ----------
    contact, exit : float, optional
        Time [s]; None for the event that is found.
    punctures : tuple of float, optional
        Times [s] of the peaks, in their order, none for no puncture; None for those that are found.
    """

    contact: float | None = None
    punctures: tuple[float, ...] | None = None
    exit: float | None = None


@dataclass(frozen=True)
class Card:
    """The provenance of a recording.

    Parameters
    ----------
    source : str
        The file, or the simulation.
    sha256 : str
        SHA-256 of the file.
    part : str
        The name of the recording, of a file with several.
    needle, tissue, rig : str
        Descriptions.
    filter_length : int
        Samples in the average filter of the force, 1 if none is known.
    assumptions : tuple of str
        Sentences on what was assumed while reading.
    given_events : GivenEvents or None
        Events that take the place of those found by ``segment``; see ``Recording.with_events``.
    """

    source: str = ""
    sha256: str = ""
    needle: str = ""
    tissue: str = ""
    rig: str = ""
    filter_length: int = 1
    assumptions: tuple[str, ...] = ()
    part: str = ""
    given_events: GivenEvents | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Recording(Printed):
    """One experiment as arrays of equal length in SI, sorted by time.

    Parameters
    ----------
    time : (n,) array
        Time [s].
    depth : (n,) array
        Depth of the tip [m], positive inwards, in the recording's own zero.
    velocity : (n,) array, optional
        Velocity of the tip [m/s], positive inwards; without it, it is derived from depth over about 50 ms.
    force : (n,) array
        Axial force of the tissue on the needle [N]; positive opposes insertion.
    axes : dict
        Further quantities, (n,) each: fx, fy [N], tx, ty, tz [N m], or the parts of a simulated force [N].
    card : Card
        The provenance.
    notes : tuple of Note
        Observations made while reading.

    Raises
    ------
    InputError
        Arrays of unequal length, or no force.
    """

    time: np.ndarray
    depth: np.ndarray
    velocity: np.ndarray = None  # type: ignore[assignment]  # then derived from the depth
    force: np.ndarray = None  # type: ignore[assignment]  # then refused
    axes: dict[str, np.ndarray] = field(default_factory=dict)
    card: Card = Card()
    notes: tuple[Note, ...] = ()

    def __post_init__(self):
        """Convert the columns to contiguous float64 arrays, check their lengths, and derive a missing velocity."""
        if self.force is None:
            step = "Give Recording(time=…, depth=…, force=…), (n,) each, in s, m and N."
            raise InputError("force", "missing", "time, depth and force are needed", "recording", step)
        columns = {name: getattr(self, name) for name in COLUMNS}
        derived = columns["velocity"] is None
        columns["velocity"] = columns["depth"] if derived else columns["velocity"]
        checked = {name: np.ascontiguousarray(values, dtype=float) for name, values in (columns | self.axes).items()}
        for name, values in checked.items():
            if values.shape != checked["time"].shape or values.ndim != 1:
                raise InputError(f"shape of {name}", values.shape, f"time has {checked['time'].shape}", "recording")
        if derived and len(checked["time"]) > 1:
            checked["velocity"] = derivative(checked["time"], checked["depth"])[0]
        for name in columns:
            object.__setattr__(self, name, checked.pop(name))
        object.__setattr__(self, "axes", checked)

    def __len__(self) -> int:
        return len(self.time)

    @cached_property
    def rate(self) -> float:
        """Median sampling rate [Hz]; of rounded stamps, whose steps alternate between two, by the mean step."""
        steps, middle = np.diff(self.time), core.median_step(self.time)
        near = steps[np.abs(steps - middle) < 0.5 * middle]
        low, high, equal = near.min(), near.max(), 1e-6 * middle
        alternate = high - low > equal and bool(np.all((near - low < equal) | (high - near < equal)))
        return 1.0 / (float(near.mean()) if alternate else middle)

    def between(
        self, *, time: tuple[float, float] | None = None, depth: tuple[float, float] | None = None
    ) -> "Recording":
        """The samples within a range of time or of depth.

        Parameters
        ----------
        time : tuple of float, optional
            First and last time [s].
        depth : tuple of float, optional
            Smallest and largest depth [m], in the recording's own zero; samples of all strokes are kept.

        Returns
        -------
        Recording
            With the same card and notes.

        Raises
        ------
        InputError
            If fewer than two samples are within the ranges.
        """
        keep = np.ones(len(self), bool)
        for values, limits in ((self.time, time), (self.depth, depth)):
            if limits is not None:
                keep &= (values >= limits[0]) & (values <= limits[1])
        if np.count_nonzero(keep) < 2:
            known = f"time is {self.time[0]:g} to {self.time[-1]:g} s"
            known += f", depth {self.depth.min():g} to {self.depth.max():g} m"
            limit, step = f"at least 2 are needed; {known}", "Give a range within these."
            raise InputError("samples within the range", int(np.count_nonzero(keep)), limit, next_step=step)
        columns = {name: getattr(self, name)[keep] for name in COLUMNS}
        axes = {name: values[keep] for name, values in self.axes.items()}
        return Recording(**columns, axes=axes, card=self.card, notes=self.notes)

    def with_events(
        self,
        *,
        contact: float | None = None,
        punctures: Sequence[float] | None = None,
        exit: float | None = None,
    ) -> "Recording":
        """The same recording with events given where those found are wrong; segmentation and fits take them.

        Parameters
        ----------
        contact, exit : float, optional
            Time [s] of the event; by default it is found.
        punctures : sequence of float, optional
            Times [s] of the force peaks; an empty one for no puncture. By default they are found.

        Returns
        -------
        Recording
            With ``card.given_events``; a file that is written does not contain them.

        Raises
        ------
        InputError
            For a time outside the recording, or events that are not in their order.
        """
        own = None if punctures is None else tuple(float(each) for each in punctures)
        times = [("contact", contact), *(("puncture", each) for each in own or ()), ("exit", exit)]
        known = [(name, float(time)) for name, time in times if time is not None]
        first, last = float(self.time[0]), float(self.time[-1])
        for name, time in known:
            if not first <= time <= last:
                limit = f"the recording is from {first:.6g} to {last:.6g} s"
                raise InputError(f"time of the {name}", f"{time:.6g} s", limit, self.name, "Give a time within it.")
        for (name, time), (later, after) in pairwise(known):
            if not time < after:
                limit = f"it must be before the {later} at {after:.6g} s"
                raise InputError(f"time of the {name}", f"{time:.6g} s", limit, self.name, "Give them in their order.")
        given = GivenEvents(contact=contact, punctures=own, exit=exit)
        return replace(self, card=replace(self.card, given_events=None if given == GivenEvents() else given))

    def to_dataframe(self) -> Any:
        """A pandas DataFrame in SI, a column for each quantity with its unit, as ``force [N]``."""
        import pandas

        columns = {name: getattr(self, name) for name in COLUMNS} | self.axes
        return pandas.DataFrame({f"{name} [{UNITS.get(name, 'N')}]": values for name, values in columns.items()})

    def plot(self, axes: Any = None, *, over: str = "depth") -> Any:
        """Draw the force over depth or over time.

        Parameters
        ----------
        axes : matplotlib.axes.Axes, optional
            Where to draw; the default is a new figure.
        over : str
            ``depth`` or ``time``.

        Returns
        -------
        matplotlib.axes.Axes

        Raises
        ------
        InputError
            For another ``over``.
        """
        from ..display.axes import DEPTH, FORCE, TIME, axes_for, finish
        from ..display.canvas import MEASURED

        if over not in ("depth", "time"):
            raise InputError("over", repr(over), "known are depth and time")
        place, label = (1e3 * self.depth, DEPTH) if over == "depth" else (self.time, TIME)
        axes = axes_for(axes)
        axes.plot(place, self.force, color=MEASURED, lw=0.9)
        return finish(axes, label, FORCE, self.name)

    @property
    def name(self) -> str:
        """The last part of the card's source; ``recording`` without one. Of a file with several, its name, too."""
        file = self.card.source.replace("\\", "/").rsplit("/", 1)[-1] or "recording"
        return f"{file}: {self.card.part}" if self.card.part else file

    @property
    def place(self) -> str:
        """The card's source. Of a file with several recordings, its name, too."""
        return f"{self.card.source}: {self.card.part}" if self.card.part else self.card.source

    def _summary(self) -> list[tuple[str, str]]:
        """What the recording spans, as names and texts."""
        if len(self) < 2:
            return [("samples", str(len(self)))]
        known = [("samples", f"{len(self)} at {self.rate:.6g} Hz, {self.time[-1] - self.time[0]:.4g} s")]
        known += [(name, spanned(float(each.min()), float(each.max()), unit))
                  for name, each, unit in (("depth", self.depth, "m"), ("force", self.force, "N"))]  # fmt: skip
        known += [("other quantities", ", ".join(self.axes))] if self.axes else []
        return known

    def __repr__(self) -> str:
        return f"<Recording {self.name}: {'; '.join(f'{name} {text}' for name, text in self._summary())}>"

    def _repr_html_(self) -> Markup:
        shown = super()._repr_html_()
        return with_drawing(shown, self._draw_sheet) if len(self) > 1 else shown

    def _draw_sheet(self, figure: Any, sheet: Any) -> None:
        """Force over depth, for a notebook."""
        from ..display.axes import DEPTH, FORCE
        from ..display.canvas import MEASURED, THIN, axis_names, line, panels

        axes = panels(figure, sheet)[0, 0]
        line(axes, 1e3 * self.depth, self.force, sheet.columns, color=MEASURED, lw=THIN)
        axis_names(axes, DEPTH, FORCE)

    def _heading(self) -> str:
        return f"Recording {self.name}"

    def _cells(self) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
        return ("quantity", "value"), self._summary()

    def _remarks(self) -> Iterable[tuple[str, Iterable[str]]]:
        yield "Assumed", self.card.assumptions
        yield "Notes", [note.message for note in self.notes]
