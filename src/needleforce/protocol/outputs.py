# SPDX-License-Identifier: Apache-2.0
"""What goes on from a folder of recordings: the table of a campaign, and the commands that read it."""

import csv
import shlex
from pathlib import Path

from ..files import atomic_write
from .folder import Folder
from .plan import RunPlan, passes_at, slots
from .protocol import Protocol

TABLE = "campaign.csv"
_FIELDS = {"specimen": "tissue", "speed_mm_s": "speed_mm_s", "depth_mm": "depth_mm", "hold_s": "hold_s",
           "pass": "pass", "repeat": "site", "date": "date"}  # fmt: skip


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
