# SPDX-License-Identifier: Apache-2.0
"""A protocol run to its end, over as many sessions as it takes: run after run, the needle withdrawn between sites."""

import dataclasses
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

from ..acquisition.motion_sequence import DONE, REACHED
from ..acquisition.run import EVERY
from ..acquisition.settings import Settings
from ..errors import InputError
from .folder import Folder, alone, commands, look, set_aside, write_table
from .protocol import Protocol, RunPlan, passes_at, plan, slots
from .reading import check_axis

RESUME = "The same command goes on from here."
_PATIENCE = 5.0  # [s] beyond twice what the way takes


@dataclass(frozen=True)
class CampaignOutcome:
    """What a session came to. ``ended`` is ``done``, ``sites spoiled``, ``interrupted``, or why a run ended early.

    ``recorded`` are the files of this session, ``present`` of ``planned`` runs are there, ``notes`` what is odd,
    ``commands`` what reads the recordings.
    """

    ended: str
    recorded: tuple[str, ...]
    present: int
    planned: int
    notes: tuple[str, ...]
    commands: tuple[str, ...]

    @property
    def complete(self) -> bool:
        """Whether everything is there."""
        return self.ended == DONE

    def to_json(self) -> dict:
        """The same as a document."""
        return dataclasses.asdict(self) | {"complete": self.complete}


class Session:
    """One call of the command."""

    def __init__(self, protocol, path, open_sources, settings, view, ask, say, same_site):
        self._protocol, self._path, self._open_sources, self._settings = protocol, path, open_sources, settings
        self._view, self._ask, self._say, self._same_site = view, ask, say, same_site
        self._recorded: list[str] = []
        self._notes: list[str] = []
        self._left_out: set[int] = set()  # planned sites at which nothing more can be done
        self._site: int | None = None

    def set_aside(self) -> None:
        """What was interrupted gets its own name."""
        for sentence in set_aside(self._path, self._protocol):
            self._say(sentence)

    def run(self) -> str:
        """Run after run, until all are there or one ends early; why it ended."""
        try:
            while (run := self._next()) is not None:
                outcome = self._record(run)
                write_table(self._path, self._look())
                if outcome.ended != DONE:
                    why = f": {outcome.detail.rstrip('.')}" if outcome.detail else ""
                    self._say(f"{run.name}: {outcome.ended}{why}. {RESUME}")
                    return outcome.ended
        except KeyboardInterrupt:
            self._say(f"Stopped. {RESUME}")
            return "interrupted"
        return "sites spoiled" if self._left_out else DONE

    def outcome(self, ended: str) -> CampaignOutcome:
        """What stands in the folder now."""
        folder, planned = self._look(), len(plan(self._protocol))
        write_table(self._path, folder)
        told = commands(self._path, self._protocol, folder)
        for line in told:
            self._say(line)
        counts = present(self._protocol, folder), planned
        return CampaignOutcome(ended, tuple(self._recorded), *counts, tuple(self._notes), tuple(told))

    def _look(self) -> Folder:
        return look(self._path, self._protocol)

    def _next(self) -> RunPlan | None:
        for step in next_steps(self._protocol, self._look()):
            if step.run.planned_site in self._left_out:
                continue
            if step.why:
                self._note(step.why)
            if not step.blocked:
                return step.run
            if self._same_site or (self._ask and self._ask(f"{step.why}. Insert at the same site, into its hole?")):
                return into_its_hole(step.run)
            self._left_out.add(step.run.planned_site)
            self._note(f"site {step.run.planned_site} is left out; --same-site inserts into its hole all the same")
        return None

    def _note(self, sentence: str) -> None:
        if sentence not in self._notes:
            self._notes.append(sentence)
            self._say(sentence)

    def _record(self, run: RunPlan):
        from ..acquisition.recorder import record_run

        force, axis = self._opened()
        try:
            self._place(axis, run)
        except BaseException:
            axis.close()
            force.stop()
            raise
        self._say(f"{run.name}: site {run.site}, pass {run.pass_number}, {1e3 * run.speed:g} mm/s")
        card = run.card | {"date": datetime.now(UTC).isoformat(timespec="seconds")}
        outcome = record_run(self._path / run.name, force, axis, run.moves, card, self._settings, view=self._view)
        self._recorded.append(run.name)
        return outcome

    def _opened(self) -> tuple:
        force, axis = self._open_sources()
        if axis is None or axis.limits is None:
            force.stop()
            raise InputError("axis", "none", "a protocol moves one", next_step="Give --axis.")
        return force, axis

    def _place(self, axis, run: RunPlan) -> None:
        check_axis(self._protocol, axis.limits, "the axis")
        withdraw(axis, self._protocol.start, run.speed)
        if run.site != self._site:
            go_to_site(axis, run.site, self._ask)
        elif run.pass_number > 1:
            pause(axis, run.pause)
        self._site = run.site


def run_protocol(
    protocol: Protocol,
    folder,
    open_sources: Callable,
    settings: Settings,
    *,
    view: Callable | None = None,
    ask: Callable[[str], bool] | None = None,
    say: Callable[[str], None] = print,
    same_site: bool = False,
) -> CampaignOutcome:
    """Record every run of ``protocol`` that is not yet in ``folder``, made if absent.

    ``open_sources()`` gives a force source and an axis, anew for every run. The protocol's words on sensor and bias
    count before those of ``settings``, and the lower force limit. ``ask`` puts a yes-no question to the operator, None
    where nobody is there; ``same_site``, or a yes, lets a run go into the hole of one that was broken off when no spare
    site is left. Ctrl-C ends cleanly, with the needle where it is; the next session withdraws it first.

    Raises InputError for an axis that cannot do what the protocol asks, for a folder of another protocol or in use by
    another session, and for what prevents a run.
    """
    path = _made(folder)
    session = Session(protocol, path, open_sources, _settings(protocol, settings), view, ask, say, same_site)
    with alone(path):
        look(path, protocol)  # another protocol's folder is refused before anything in it is touched
        session.set_aside()
        ended = session.run()
        session.set_aside()
        return session.outcome(ended)


def _made(folder) -> Path:
    path = Path(folder)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError("folder", "not made", error.strerror or "", str(path), "Give another one.") from None
    return path


def _settings(protocol: Protocol, settings: Settings) -> Settings:
    return dataclasses.replace(
        settings,
        force_limit=min(protocol.force_limit, settings.force_limit),
        bias_time=protocol.bias_time,
        axial=protocol.axial,
        filter_length=protocol.filter_length,
        duration=None,
    )


@dataclass(frozen=True)
class NextStep:
    """What is to be done for a planned site: the ``run``, None where nothing can be; ``why`` in words if it is odd.

    ``blocked``: only at the same site, into its hole, could the run be made.
    """

    run: RunPlan | None
    why: str = ""
    blocked: bool = False


def present(protocol: Protocol, folder: Folder) -> int:
    """How many of the planned runs are there, at their sites or at the spare ones that took their place."""
    runs = (run for slot in slots(protocol) for run in _runs_at(protocol, folder, *slot))
    return sum(folder.complete(run) for run in runs)


def next_steps(protocol: Protocol, folder: Folder) -> Iterator[NextStep]:
    """A step for every planned site that is not done, in their order."""
    fresh = [site for site in protocol.spares if folder.replaced_by(site) is None]
    for series, depth, planned in slots(protocol):
        runs = _runs_at(protocol, folder, series, depth, planned)
        open_runs = [run for run in runs if not folder.complete(run)]
        if open_runs:
            spare = passes_at(protocol, series, depth, planned, fresh[0])[0] if fresh else None
            yield _step(open_runs[0], folder, spare)


def _runs_at(protocol: Protocol, folder: Folder, series: int, depth: int, planned: int) -> list[RunPlan]:
    """The runs of a planned site, where they are to be made by now."""
    used = [site for site in protocol.spares if folder.replaced_by(site) == planned]
    return passes_at(protocol, series, depth, planned, used[-1] if used else planned)


def _step(run: RunPlan, folder: Folder, spare: RunPlan | None) -> NextStep:
    if not folder.spoiled(run):
        return NextStep(run)
    broken = f"pass {run.pass_number} at site {run.site} was broken off in the tissue"
    if spare:
        return NextStep(spare, f"{broken}: site {spare.site} takes its place")
    if run.pass_number > 1:
        return NextStep(run, f"{broken} and no spare site is left: site {run.site} stays without a pair", blocked=True)
    return NextStep(run, f"{broken} and no spare site is left", blocked=True)


def into_its_hole(run: RunPlan) -> RunPlan:
    """The same run where its site is pierced already, which its card says."""
    return replace(run, card=run.card | {"same_site": "pierced before by an insertion that was broken off"})


def withdraw(axis, start: float, speed: float) -> None:
    """Bring the tip to ``start`` [m] at ``speed`` [m/s], wherever it was left, and wait until it rests there.

    Raises InputError where it does not arrive; the axis is told to stop then.
    """
    state = _state(axis, time.monotonic() + _PATIENCE)
    if abs(state.depth - start) <= REACHED and state.condition == "idle":
        return
    try:
        axis.move(start, speed)
        until = time.monotonic() + _PATIENCE + 2.0 * abs(state.depth - start) / speed
        before = state.number
        while abs(state.depth - start) > REACHED or state.condition != "idle" or state.number <= before:
            if state.condition in ("stalled", "fault"):
                raise InputError("axis", state.condition, f"at {state.depth:g} m on the way to {start:g} m")
            state = _state(axis, until)
    except BaseException:
        axis.stop()
        raise


def go_to_site(axis, site: int, ask: Callable[[str], bool] | None) -> None:
    """Put the needle over ``site``: the axis does it, or the operator does and says so.

    Raises InputError where neither can.
    """
    try:
        axis.site(site)
    except InputError as refused:
        if ask is None:
            advice = "Run it in a terminal, where somebody can move the phantom and say so."
            raise InputError("site", site, f"the axis does not go there: {refused}", next_step=advice) from None
        if not ask(f"Move the phantom so that the needle is over site {site}. Is it there?"):
            raise KeyboardInterrupt from None


def pause(axis, seconds: float) -> None:
    """Wait with the needle where it is, so that the axis stays connected."""
    until = time.monotonic() + seconds
    while (left := until - time.monotonic()) > 0.0:
        axis.receive()
        axis.alive()
        time.sleep(min(EVERY, left))


def _state(axis, until: float):
    """The newest state, awaited."""
    while not (states := axis.receive()):
        if time.monotonic() > until:
            raise InputError("axis", "silent, or not there in time", "no state says that it rests at the start")
        axis.alive()
        time.sleep(EVERY)
    if time.monotonic() > until:
        raise InputError("axis", f"at {states[-1][0].depth:g} m", "it does not arrive at the start")
    axis.alive()
    return states[-1][0]
