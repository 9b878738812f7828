# SPDX-License-Identifier: Apache-2.0
"""Recording of a protocol in one or more sessions, run by run; the needle is withdrawn between sites."""

import dataclasses
import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path

from ..acquisition.axis_check import stop_distance
from ..acquisition.motion_sequence import EndReason
from ..acquisition.settings import Progress, RunResult, Settings
from ..acquisition.sources.source import ForceSource, MotionAxis
from ..errors import InputError
from .folder import Folder, commands, locked, next_steps, present, read_folder, set_aside, write_table
from .protocol import Protocol, RunPlan, plan
from .reading import check_axis

RESUME = "Run the same command again to continue."

Sources = tuple[ForceSource, MotionAxis | None]


class SessionEnd(StrEnum):
    """Why a session ended if no run ended early."""

    DONE = "done"
    INTERRUPTED = "interrupted"
    SITES_UNUSABLE = "sites unusable"


@dataclass(frozen=True, kw_only=True)
class CampaignOutcome:
    """Result of a session.

    ``ended`` is why the session, or a run of it, ended, and ``rest_confirmed`` whether the axis was seen to stop.
    ``recorded`` are the files of this session; ``present`` and ``planned`` count complete and planned runs; ``notes``
    are the sites that were replaced or left out; ``commands`` are command lines that evaluate the recordings.
    """

    ended: SessionEnd | EndReason
    rest_confirmed: bool
    recorded: tuple[str, ...]
    present: int
    planned: int
    notes: tuple[str, ...]
    commands: tuple[str, ...]

    @property
    def complete(self) -> bool:
        """Whether all planned runs are complete."""
        return self.ended == SessionEnd.DONE

    def to_json(self) -> dict:
        """The result as a document for JSON."""
        return dataclasses.asdict(self) | {"complete": self.complete}


@dataclass(kw_only=True)
class Session:
    """One session of a protocol in its folder; the parameters are those of ``run_protocol``."""

    protocol: Protocol
    path: Path
    open_sources: Callable[[], Sources]
    settings: Settings
    view: Callable[[Progress], None] | None
    ask: Callable[[str], bool] | None
    say: Callable[[str], None]
    same_site: bool
    recorded: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    left_out: set[int] = field(default_factory=set)  # planned sites without further runs
    site: int | None = None
    rest_confirmed: bool = True

    def set_aside(self) -> None:
        """Rename interrupted recordings."""
        for sentence in set_aside(self.path, self.protocol):
            self.say(sentence)

    def run(self) -> SessionEnd | EndReason:
        """Record run by run until all are complete or one ends early; the reason of the end."""
        try:
            while (run := self._next()) is not None:
                result = self._record(run)
                self.rest_confirmed = self.rest_confirmed and result.rest_confirmed
                write_table(self.path, self._folder())
                if result.ended != EndReason.DONE or not result.rest_confirmed:
                    detail = f": {result.detail.rstrip('.')}" if result.detail else ""
                    self.say(f"{run.name}: {result.ended}{detail}. {RESUME}")
                    return result.ended if result.rest_confirmed else EndReason.AXIS_NOT_STOPPED
        except KeyboardInterrupt:
            self.say(f"Stopped. {RESUME}")
            return SessionEnd.INTERRUPTED
        return SessionEnd.SITES_UNUSABLE if self.left_out else SessionEnd.DONE

    def outcome(self, ended: SessionEnd | EndReason) -> CampaignOutcome:
        """The result of the session, from the content of the folder."""
        folder = self._folder()
        write_table(self.path, folder)
        lines = commands(self.path, self.protocol, folder)
        for line in lines:
            self.say(line)
        return CampaignOutcome(
            ended=ended,
            rest_confirmed=self.rest_confirmed,
            recorded=tuple(self.recorded),
            present=present(self.protocol, folder),
            planned=len(plan(self.protocol)),
            notes=tuple(self.notes),
            commands=tuple(lines),
        )

    def _folder(self) -> Folder:
        return read_folder(self.path, self.protocol)

    def _next(self) -> RunPlan | None:
        for step in next_steps(self.protocol, self._folder()):
            if step.run.planned_site in self.left_out:
                continue
            if step.reason:
                self._note(step.reason)
            if not step.needs_same_site:
                return step.run
            if self.same_site or (self.ask and self.ask(f"{step.reason}. Insert at the same site, into its hole?")):
                return into_its_hole(step.run)
            self.left_out.add(step.run.planned_site)
            self._note(f"site {step.run.planned_site} is left out; with --same-site its hole is used again")
        return None

    def _note(self, sentence: str) -> None:
        if sentence not in self.notes:
            self.notes.append(sentence)
            self.say(sentence)

    def _record(self, run: RunPlan) -> RunResult:
        from ..acquisition.recorder import record_run

        force, axis = self._opened()
        stop = f"a stop takes at most {1e3 * stop_distance(axis.limits, run.speed):.2f} mm"
        self.say(f"{run.name}: site {run.site}, pass {run.pass_number}, {1e3 * run.speed:g} mm/s; {stop}")
        card = run.card | {"date": datetime.now(UTC).isoformat(timespec="seconds")}
        path, settings = self.path / run.name, self.settings
        result = record_run(
            path,
            force,
            axis,
            moves=((self.protocol.start, run.speed), *run.moves),
            card=card,
            settings=settings,
            view=self.view,
            when_withdrawn=lambda: self._prepare(axis, run),
        )
        self.recorded.append(run.name)
        return result

    def _opened(self) -> tuple[ForceSource, MotionAxis]:
        force, axis = self.open_sources()
        try:
            if axis is None or axis.limits is None:
                raise InputError("axis", "none", "a protocol needs one", next_step="Give --axis.")
            check_axis(self.protocol, axis.limits, "the axis")
        except InputError:
            if axis:
                axis.close()
            force.stop()
            raise
        return force, axis

    def _prepare(self, axis: MotionAxis, run: RunPlan) -> None:
        """Go to the site of the run, or wait for the pause between two passes."""
        if run.site != self.site:
            go_to_site(axis, run.site, self.ask)
        elif run.pass_number > 1:
            time.sleep(run.pause)
        self.site = run.site


def run_protocol(
    protocol: Protocol,
    folder: str | os.PathLike,
    open_sources: Callable[[], Sources],
    settings: Settings,
    *,
    view: Callable[[Progress], None] | None = None,
    ask: Callable[[str], bool] | None = None,
    say: Callable[[str], None] = print,
    same_site: bool = False,
) -> CampaignOutcome:
    """Record every run of a protocol that is not yet complete in the folder.

    Ctrl-C ends the session and leaves the needle where it is; the next session withdraws it first.

    Parameters
    ----------
    protocol : Protocol
        The experiment.
    folder : str or path
        Folder of the recordings; it is created if it does not exist.
    open_sources : callable
        Called before every run; returns a force source and an axis.
    settings : Settings
        Settings of the recorder. Sensor and bias of the protocol replace them, and the lower force limit is used.
    view : callable, optional
        Called with a ``Progress`` about eight times a second.
    ask : callable, optional
        Asks the operator a yes-no question; without it there is no operator.
    say : callable
        Prints a sentence.
    same_site : bool
        Whether a run that was interrupted in the tissue is repeated in its hole when no spare site is left.

    Returns
    -------
    CampaignOutcome

    Raises
    ------
    InputError
        If the axis cannot execute the protocol, the folder belongs to another protocol or is in use, or a run cannot
        start.
    """
    path = _created(folder)
    session = Session(
        protocol=protocol,
        path=path,
        open_sources=open_sources,
        settings=_settings(protocol, settings),
        view=view,
        ask=ask,
        say=say,
        same_site=same_site,
    )
    say(f"force limit {session.settings.force_limit:.4g} N ({session.settings.limit_source})")
    with locked(path):
        read_folder(path, protocol)  # refuses the folder of another protocol before anything in it is changed
        session.set_aside()
        ended = session.run()
        session.set_aside()
        return session.outcome(ended)


def _created(folder: str | os.PathLike) -> Path:
    path = Path(folder)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError("folder", "not created", error.strerror or "", str(path), "Give another one.") from None
    return path


def _settings(protocol: Protocol, settings: Settings) -> Settings:
    source = "of the protocol" if protocol.force_limit <= settings.force_limit else settings.limit_source
    return dataclasses.replace(
        settings,
        force_limit=min(protocol.force_limit, settings.force_limit),
        limit_source=source,
        bias_time=protocol.bias_time,
        axial=protocol.axial,
        filter_length=protocol.filter_length,
        duration=None,
    )


def into_its_hole(run: RunPlan) -> RunPlan:
    """The same run in the existing hole of its site, with an entry in its card."""
    return replace(run, card=run.card | {"same_site": "pierced before by an interrupted insertion"})


def go_to_site(axis: MotionAxis, site: int, ask: Callable[[str], bool] | None) -> None:
    """Place the needle above ``site``: by the axis, or by the operator, who confirms it.

    Raises InputError if the axis cannot and there is no operator.
    """
    try:
        axis.site(site)
    except InputError as refused:
        if ask is None:
            advice = "Run the command in a terminal, where an operator can move the phantom and confirm it."
            raise InputError("site", site, f"the axis cannot go there: {refused}", next_step=advice) from None
        if not ask(f"Move the phantom so that the needle is over site {site}. Is it there?"):
            raise KeyboardInterrupt from None
