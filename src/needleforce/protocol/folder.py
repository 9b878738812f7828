# SPDX-License-Identifier: Apache-2.0
"""The folder of a protocol: its recordings, a lock for one session, the campaign's table, and the commands that read
them."""

import csv
import os
import re
import shlex
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..acquisition.motion_sequence import EndReason
from ..acquisition.settings import Settings
from ..errors import InputError
from ..files import atomic_write, csv_text
from ..recording.log.reader import card_and_end
from ..wire.axis_lines import MAX_SILENCE_S
from .protocol import ENDING, Protocol, RunPlan, passes_at, slots

SURFACE_MARGIN_M = 1e-3  # above the nominal surface, which may be tissue: surfaces vary by tenths of a millimetre
MAX_UNRECORDED_S = Settings.flush_every + MAX_SILENCE_S  # since the last flush, until an axis without client stops
_INTERRUPTED_NAME = re.compile(r"(.+)_interrupted(\d+)")
_RUN_NAME = re.compile(r"mm_s_(?:[\d.e-]+mm_)?site\d+_pass\d+$")  # of a file that was cut off before its card
TABLE = "campaign.csv"
_FIELDS = {"specimen": "tissue", "speed_mm_s": "speed_mm_s", "depth_mm": "depth_mm", "hold_s": "hold_s",
           "pass": "pass", "repeat": "site", "date": "date"}  # fmt: skip


@dataclass(frozen=True)
class KeptRecording:
    """One recording of the folder: ``run`` is the name of its run, ``complete`` whether the run was completed,
    ``touched`` whether the needle may have been in the tissue.
    """

    path: Path
    run: str
    card: dict[str, str]
    complete: bool
    touched: bool


@dataclass(frozen=True)
class Folder:
    """The recordings of a protocol in their folder, by the names of their runs."""

    kept: tuple[KeptRecording, ...]

    def complete(self, run: RunPlan) -> bool:
        """Whether there is a complete recording of a run."""
        return any(each.complete and each.run == run.name for each in self.kept)

    def interrupted_in_tissue(self, run: RunPlan) -> bool:
        """Whether a run was interrupted while the needle may have been in the tissue."""
        return any(not each.complete and each.touched and each.run == run.name for each in self.kept)

    def replaced_by(self, spare: int) -> int | None:
        """The planned site that a spare one replaced; None for an unused spare site."""
        cards = (each.card for each in self.kept if each.card.get("site") == str(spare))
        return next((int(card["replaces"]) for card in cards if card.get("replaces", "").isdecimal()), None)


@dataclass(frozen=True)
class NextStep:
    """The next ``run`` for a planned site, and the ``reason`` if it is not the planned one.

    ``needs_same_site``: the run is possible only in the existing hole of its site.
    """

    run: RunPlan
    reason: str = ""
    needs_same_site: bool = False


def present(protocol: Protocol, folder: Folder) -> int:
    """Number of planned runs that are complete, at their sites or at the spare ones that replaced them."""
    runs = (run for slot in slots(protocol) for run in _runs_at(protocol, folder, *slot))
    return sum(folder.complete(run) for run in runs)


def next_steps(protocol: Protocol, folder: Folder) -> Iterator[NextStep]:
    """A step for every planned site that is not complete, in their order."""
    unused = [site for site in protocol.spares if folder.replaced_by(site) is None]
    for series, depth, planned in slots(protocol):
        runs = _runs_at(protocol, folder, series, depth, planned)
        open_runs = [run for run in runs if not folder.complete(run)]
        if open_runs:
            spare = passes_at(protocol, series, depth, planned, unused[0])[0] if unused else None
            yield _step(open_runs[0], folder, spare)


def _runs_at(protocol: Protocol, folder: Folder, series: int, depth: int, planned: int) -> list[RunPlan]:
    """The runs of a planned site, at the spare site that has replaced it if there is one."""
    used = [site for site in protocol.spares if folder.replaced_by(site) == planned]
    return passes_at(protocol, series, depth, planned, used[-1] if used else planned)


def _step(run: RunPlan, folder: Folder, spare: RunPlan | None) -> NextStep:
    if not folder.interrupted_in_tissue(run):
        return NextStep(run)
    interrupted = f"pass {run.pass_number} at site {run.site} was interrupted in the tissue"
    if spare:
        return NextStep(spare, f"{interrupted}: it is replaced by site {spare.site}")
    reason = f"{interrupted} and no spare site is left"
    if run.pass_number > 1:
        reason += f": site {run.site} remains without a pair"
    return NextStep(run, reason, needs_same_site=True)


def read_folder(path: Path, protocol: Protocol) -> Folder:
    """The recordings in the folder. Raises InputError if one of them belongs to another protocol."""
    kept = []
    for file in sorted(path.glob("*" + ENDING)):
        card, end = card_and_end(file)
        other = card.get("protocol_sha256", protocol.sha256) != protocol.sha256
        if other:
            limit = (
                f"it has recordings of another protocol file, '{card.get('protocol', '')[:80]}', such as {file.name}"
            )
            raise InputError("folder", str(path), limit, next_step="Use one folder for each protocol file.")
        if card.get("protocol_sha256"):
            kept.append(_kept(file, card, end, protocol))
    return Folder(tuple(kept))


def set_aside(path: Path, protocol: Protocol) -> list[str]:
    """Rename interrupted recordings to ``…_interrupted1.mcap``, without overwriting; a sentence for each."""
    sentences = []
    for file in sorted(path.glob("*" + ENDING)):
        card, end = card_and_end(file)
        ours = card.get("protocol_sha256") == protocol.sha256 or (not card and _RUN_NAME.search(file.stem))
        if ours and not _INTERRUPTED_NAME.fullmatch(file.stem) and not _completed(end):
            target = _free_name(file)
            os.rename(file, target)
            sentences.append(f"{file.name} was interrupted: kept as {target.name}")
    return sentences


def _kept(file: Path, card: dict, end: dict | None, protocol: Protocol) -> KeptRecording:
    interrupted = _INTERRUPTED_NAME.fullmatch(file.stem)
    complete = not interrupted and _completed(end)
    run = (interrupted[1] if interrupted else file.stem) + ENDING
    touched = complete or _may_have_touched(file, protocol)
    return KeptRecording(path=file, run=run, card=card, complete=complete, touched=touched)


def _completed(end: dict | None) -> bool:
    return end is not None and end.get("ended") == EndReason.DONE


def _may_have_touched(file: Path, protocol: Protocol) -> bool:
    """Whether the largest recorded depth, plus the travel that may not be recorded, comes near the surface."""
    from ..recording.log import read_log

    depth = read_log(file).axis.values[:, 0]
    speed = max((series.speed for series in protocol.series), default=0.0)
    return bool(np.max(depth, initial=protocol.start) + speed * MAX_UNRECORDED_S > -SURFACE_MARGIN_M)


def _free_name(file: Path) -> Path:
    number = 1
    while (target := file.with_name(f"{file.stem}_interrupted{number}{ENDING}")).exists():
        number += 1
    return target


def write_table(path: Path, folder: Folder) -> Path:
    """Write ``campaign.csv`` for ``needleforce campaign --mapping``: a row for each complete recording.

    Sites are repeats of one condition, so their column is ``repeat``.
    """
    target = path / TABLE
    with atomic_write(target) as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["file", *_FIELDS])
        for each in folder.kept:
            if each.complete:
                fields = (" ".join(each.card.get(key, "").split()) for key in _FIELDS.values())
                rows.writerow(map(csv_text, [each.path.name, *fields]))
    return target


def commands(path: Path, protocol: Protocol, folder: Folder) -> list[str]:
    """One ``needleforce identify`` for each speed and depth, with the complete pairs in order; then the campaign."""
    groups: dict[tuple[int, int], list[list[RunPlan]]] = {}
    for series, depth, planned in slots(protocol):
        for site in (planned, *protocol.spares):
            if site == planned or folder.replaced_by(site) == planned:
                runs = passes_at(protocol, series, depth, planned, site)
                if all(folder.complete(run) for run in runs[:2]):
                    groups.setdefault((series, depth), []).append(runs)
    lines = [_identify(path, group) for group in groups.values()]
    files = " ".join(shlex.quote(str(each.path)) for each in folder.kept if each.complete)
    table = shlex.quote(str(path / TABLE))
    return [*lines, f"needleforce campaign {files} --mapping {table}"] if files else lines


def _identify(path: Path, group: list[list[RunPlan]]) -> str:
    firsts = [str(path / runs[0].name) for runs in group]
    seconds = [word for runs in group if len(runs) > 1 for word in ("--second-pass", str(path / runs[1].name))]
    return shlex.join(["needleforce", "identify", *firsts, *seconds])


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Lock the folder until the block, or the program, ends. Raises InputError if another session has locked it.

    The lock is that of the system and leaves no file; on systems without locks for folders there is none.
    """
    try:
        import fcntl
    except ImportError:
        yield
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            limit = "another session records into it"
            raise InputError("folder", str(folder), limit, next_step="Wait for its end, or end it.") from None
        yield
    finally:
        os.close(handle)
