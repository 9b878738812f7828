# SPDX-License-Identifier: Apache-2.0
"""Which run comes next, by what is there: a spoiled site gives way to a spare one.

An insertion that was broken off in the tissue leaves a hole: a first pass there would not cut what it is to cut, so
the whole site moves to a spare one. A second pass that was broken off spoils the pair, not the first pass: the pair is
made again at a spare site, and without one the first pass stands alone, for a force of insertion is still good by
itself and half a pair is not.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from .folder import Folder
from .plan import RunPlan, passes_at, slots
from .protocol import Protocol


@dataclass(frozen=True)
class Step:
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


def next_steps(protocol: Protocol, folder: Folder) -> Iterator[Step]:
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


def _step(run: RunPlan, folder: Folder, spare: RunPlan | None) -> Step:
    if not folder.spoiled(run):
        return Step(run)
    broken = f"pass {run.pass_number} at site {run.site} was broken off in the tissue"
    if spare:
        return Step(spare, f"{broken}: site {spare.site} takes its place")
    if run.pass_number > 1:
        return Step(run, f"{broken} and no spare site is left: site {run.site} stays without a pair", blocked=True)
    return Step(run, f"{broken} and no spare site is left", blocked=True)


def into_its_hole(run: RunPlan) -> RunPlan:
    """The same run where its site is pierced already, which its card says."""
    return replace(run, card=run.card | {"same_site": "pierced before by an insertion that was broken off"})
