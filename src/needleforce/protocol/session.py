# SPDX-License-Identifier: Apache-2.0
"""One session of a protocol: run after run, and what it came to."""

import dataclasses
from dataclasses import dataclass
from datetime import UTC, datetime

from ..acquisition.motion_sequence import DONE
from ..errors import InputError
from .checks import check_axis
from .folder import Folder, look, set_aside
from .next_run import into_its_hole, next_steps, present
from .outputs import commands, write_table
from .places import go_to_site, pause, withdraw
from .plan import RunPlan, plan

RESUME = "The same command goes on from here."


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
