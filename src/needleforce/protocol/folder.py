# SPDX-License-Identifier: Apache-2.0
"""The folder of a protocol: what is recorded already, one session at a time, the campaign's table and the commands
that read it."""

import csv
import os
import re
import shlex
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..acquisition.motion_sequence import DONE
from ..acquisition.settings import Settings
from ..errors import InputError
from ..files import atomic_write
from ..recording.log.reader import card_and_end
from ..wire.axis_lines import SILENCE
from .protocol import ENDING, Protocol, RunPlan, passes_at, slots

SURFACE = 1e-3  # [m] above the nominal surface that may be tissue: surfaces scatter by tenths of a millimetre
UNSEEN = Settings.flush_every + SILENCE  # [s] since the last flush, and until an axis left alone stops by itself
_ASIDE = re.compile(r"(.+)_interrupted(\d+)")
_NAME = re.compile(r"mm_s_(?:[\d.e-]+mm_)?site\d+_pass\d+$")  # of a file cut off before its card
TABLE = "campaign.csv"
_FIELDS = {"specimen": "tissue", "speed_mm_s": "speed_mm_s", "depth_mm": "depth_mm", "hold_s": "hold_s",
           "pass": "pass", "repeat": "site", "date": "date"}  # fmt: skip


@dataclass(frozen=True)
class Kept:
    """One recording of the folder: ``run`` is the name of its run, ``touched`` whether its needle may have been in the
    tissue, ``complete`` whether it went to its end.
    """

    path: Path
    run: str
    card: dict[str, str]
    complete: bool
    touched: bool


@dataclass(frozen=True)
class Folder:
    """The recordings of a protocol in their folder, by the names of their runs."""

    kept: tuple[Kept, ...]

    def complete(self, run: RunPlan) -> bool:
        """Whether a run is there, from its begin to its end."""
        return any(each.complete and each.run == run.name for each in self.kept)

    def spoiled(self, run: RunPlan) -> bool:
        """Whether a run was broken off when its needle may have been in the tissue."""
        return any(not each.complete and each.touched and each.run == run.name for each in self.kept)

    def replaced_by(self, spare: int) -> int | None:
        """The planned site in whose place a spare one was used; None for a fresh one."""
        of_it = (each.card for each in self.kept if each.card.get("site") == str(spare))
        return next((int(card["replaces"]) for card in of_it if card.get("replaces", "").isdecimal()), None)


def look(path: Path, protocol: Protocol) -> Folder:
    """What is in the folder. Raises InputError where a recording there is of another protocol."""
    kept = []
    for file in sorted(path.glob("*" + ENDING)):
        card, end = card_and_end(file)
        other = card.get("protocol_sha256", protocol.sha256) != protocol.sha256
        if other:
            said = f"it holds recordings of '{card.get('protocol', '')[:80]}' by another file, such as {file.name}"
            raise InputError("folder", str(path), said, next_step="Give each protocol a folder of its own.")
        if card.get("protocol_sha256"):
            kept.append(_kept(file, card, end, protocol))
    return Folder(tuple(kept))


def set_aside(path: Path, protocol: Protocol) -> list[str]:
    """Give what was interrupted its own names, ``…_interrupted1.mcap``; nothing is written over. What was done."""
    said = []
    for file in sorted(path.glob("*" + ENDING)):
        card, end = card_and_end(file)
        ours = card.get("protocol_sha256") == protocol.sha256 or (not card and _NAME.search(file.stem))
        if ours and not _ASIDE.fullmatch(file.stem) and not _went_to_its_end(end):
            target = _free_name(file)
            os.rename(file, target)
            said.append(f"{file.name} was interrupted: kept as {target.name}")
    return said


def _kept(file: Path, card: dict, end: dict | None, protocol: Protocol) -> Kept:
    aside = _ASIDE.fullmatch(file.stem)
    complete = not aside and _went_to_its_end(end)
    run = (aside[1] if aside else file.stem) + ENDING
    return Kept(file, run, card, complete, complete or _may_have_touched(file, protocol))


def _went_to_its_end(end: dict | None) -> bool:
    return end is not None and end.get("ended") == DONE


def _may_have_touched(file: Path, protocol: Protocol) -> bool:
    """Whether the deepest place seen, and what could go unseen after it, comes near the surface."""
    from ..recording.log import read_log

    depth = read_log(file).axis.values[:, 0]
    speed = max((series.speed for series in protocol.series), default=0.0)
    return bool(np.max(depth, initial=protocol.start) + speed * UNSEEN > -SURFACE)


def _free_name(file: Path) -> Path:
    number = 1
    while (target := file.with_name(f"{file.stem}_interrupted{number}{ENDING}")).exists():
        number += 1
    return target


def write_table(path: Path, folder: Folder) -> Path:
    """Write ``campaign.csv`` for ``needleforce campaign --mapping``: a row for each complete recording, by name.

    Sites are repeats of one condition, so their column is ``repeat``.
    """
    target = path / TABLE
    with atomic_write(target) as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["file", *_FIELDS])
        for each in folder.kept:
            if each.complete:
                rows.writerow([each.path.name, *(" ".join(each.card.get(key, "").split()) for key in _FIELDS.values())])
    return target


def commands(path: Path, protocol: Protocol, folder: Folder) -> list[str]:
    """One ``needleforce identify`` for each speed and depth, complete pairs in their order; then the campaign."""
    groups: dict[tuple[int, int], list[list[RunPlan]]] = {}
    for series, depth, planned in slots(protocol):
        for site in (planned, *protocol.spares):
            if site == planned or folder.replaced_by(site) == planned:
                runs = passes_at(protocol, series, depth, planned, site)
                if all(folder.complete(run) for run in runs[:2]):
                    groups.setdefault((series, depth), []).append(runs)
    told = [_identify(path, group) for group in groups.values()]
    files = " ".join(shlex.quote(str(each.path)) for each in folder.kept if each.complete)
    table = shlex.quote(str(path / TABLE))
    return [*told, f"needleforce campaign {files} --mapping {table}"] if files else told


def _identify(path: Path, group: list[list[RunPlan]]) -> str:
    firsts = [str(path / runs[0].name) for runs in group]
    seconds = [word for runs in group if len(runs) > 1 for word in ("--second-pass", str(path / runs[1].name))]
    return shlex.join(["needleforce", "identify", *firsts, *seconds])


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Hold the folder until the block, or the program, ends. Raises InputError where another session holds it.

    The lock is the system's and leaves no file; where the system has none for folders, nothing is held.
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
            said = "another session records into it"
            raise InputError("folder", str(folder), said, next_step="Wait for its end, or end it.") from None
        yield
    finally:
        os.close(handle)
