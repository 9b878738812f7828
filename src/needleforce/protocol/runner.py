# SPDX-License-Identifier: Apache-2.0
"""A protocol run to its end, over as many sessions as it takes: what is there is not done again."""

import dataclasses
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from ..acquisition.settings import Settings
from ..errors import InputError
from .checks import check_axis
from .folder import Folder, look, set_aside
from .next_run import into_its_hole, next_steps
from .outputs import commands, write_table
from .places import go_to_site, withdraw
from .plan import RunPlan, plan
from .protocol import Protocol

RESUME = "The same command goes on from here."
_STEP = 0.1  # [s] of a pause


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
        return self.ended == "done"

    def to_json(self) -> dict:
        """The same as a document."""
        return dataclasses.asdict(self) | {"complete": self.complete}


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

    Raises InputError for an axis that cannot do what the protocol asks, for a folder of another protocol, and for
    what prevents a run.
    """
    path = _made(folder)
    session = _Session(protocol, path, open_sources, _settings(protocol, settings), view, ask, say, same_site)
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


class _Session:
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
                ended = self._record(run)
                write_table(self._path, self._look())
                if ended != "done":
                    self._say(f"{run.name}: {ended}. {RESUME}")
                    return ended
        except KeyboardInterrupt:
            self._say(f"Stopped. {RESUME}")
            return "interrupted"
        return "sites spoiled" if self._left_out else "done"

    def outcome(self, ended: str) -> CampaignOutcome:
        """What stands in the folder now."""
        folder, planned = self._look(), len(plan(self._protocol))
        write_table(self._path, folder)
        told = commands(self._path, self._protocol, folder)
        present = planned - sum(1 for step in next_steps(self._protocol, folder) for _ in [step])
        for line in told:
            self._say(line)
        return CampaignOutcome(ended, tuple(self._recorded), present, planned, tuple(self._notes), tuple(told))

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

    def _record(self, run: RunPlan) -> str:
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
        return outcome.ended

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
            self._pause(axis, run.pause)
        self._site = run.site

    def _pause(self, axis, seconds: float) -> None:
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            axis.receive()
            axis.alive()
            time.sleep(min(_STEP, max(0.0, until - time.monotonic())))
