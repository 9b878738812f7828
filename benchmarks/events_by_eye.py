# SPDX-License-Identifier: Apache-2.0
"""Contacts, punctures and exits as the eye read them from plots, beside the detector's, for every real recording.

    python benchmarks/events_by_eye.py [--write] [--csv FILE]

Prints the summary, odd repeats (on which thresholds were set) and even ones apart; ``--write`` makes the page
docs/events_by_eye.md, ``--csv`` a table in millimetres. The recordings were made by others and are not in this
repository; without them it says so and does nothing. Readings: tests/segmentation/eye_readings.csv, which also says how
they were made.
"""

import argparse
import csv
import sys
from pathlib import Path

import numpy as np
from events_page import page

import needleforce as nf

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "segmentation")]
from conftest import RECORDINGS  # noqa: E402  the one place that says where they are
from test_segmentation_real import READING, depths, near, repeat, rows  # noqa: E402  the one reading of the table

PAGE = ROOT / "docs" / "events_by_eye.md"


def events_of(name: str) -> tuple:
    """One recording and the detector's events in it; None twice where it cannot be read."""
    try:
        run = nf.read(RECORDINGS / "needle-insertion-rig" / f"{name}.csv")
    except nf.InputError:
        return None, None
    return run, nf.segment(run)


def beside(row: dict) -> dict:
    """One line of the table: eye, detector and whether they agree, by event; None where there is nothing to compare."""
    run, events = events_of(row["recording"])
    line = {"recording": row["recording"], "half": "odd" if repeat(row["recording"]) % 2 else "even"}
    line |= {"contact_eye": row["contact"], "contact_low": row["contact_low"], "contact_high": row["contact_high"]}
    line |= {"punctures_eye": depths(row["punctures"]), "doubtful_eye": depths(row["doubtful"])}
    line |= {"exit_eye": row["exit"], "last_step_eye": row["last_step"]}
    contact, left = (None if events is None else getattr(events, name) for name in ("contact", "exit"))
    line["contact"] = None if contact is None else 1e3 * contact.depth
    line["contact_held"] = held(run, contact, row)
    line["punctures"] = [] if events is None else [1e3 * each.depth for each in events.punctures]
    line["exit"] = None if left is None else 1e3 * left.depth
    line["unread"] = events is None
    return line | judged(line)


def judged(line: dict) -> dict:
    """Whether contact, punctures and exit agree."""
    if line["unread"]:
        return {"contact_in": None, "punctures_same": None, "exit_in": None, "missed": [], "false": []}
    sharp, soft, found = line["punctures_eye"], line["doubtful_eye"], line["punctures"]
    missed = [depth for depth in sharp if not any(near(each, [depth]) for each in found)]
    false = [each for each in found if not near(each, sharp + [depth + READING for depth in soft])]
    return {
        "contact_in": inside(line["contact"], line["contact_low"], line["contact_high"]),
        "punctures_same": not missed and not false if line["contact_eye"] else not found,
        "exit_in": inside(line["exit"], line["exit_eye"], line["last_step_eye"]),
        "missed": missed,
        "false": false,
    }


def held(run, contact, row: dict) -> bool | None:
    """Whether the samples between which the contact surely lies overlap the eye's range; None without one to read."""
    if contact is None or not row["contact"]:
        return None
    low, high = 1e3 * run.depth[[contact.low, contact.high]]
    return bool(low <= float(row["contact_high"]) and float(row["contact_low"]) <= high)


def inside(found: float | None, *limits: str) -> bool:
    """Whether a depth lies between the readings; without readings, whether there is none."""
    if not all(limits):
        return found is None
    low, high = sorted(map(float, limits))
    return found is not None and low - READING <= found <= high + READING


def summary(lines: list[dict]) -> str:
    """Both halves in Markdown."""
    head = ["", "recordings", "contact in", "held", "median apart mm", "punctures", "found", "false", "exit in"]
    table = ["| " + " | ".join(head) + " |", "|---|" + "---:|" * (len(head) - 1)]
    for half in ("odd", "even", "all"):
        mine = [each for each in lines if not each["unread"] and half in (each["half"], "all")]
        seen = [each for each in mine if each["contact_eye"]]
        apart = [abs(each["contact"] - float(each["contact_eye"])) for each in seen if each["contact"] is not None]
        wanted, missed, false = (sum(len(each[key]) for each in mine) for key in ("punctures_eye", "missed", "false"))
        cells = [half, len(mine), share(seen, "contact_in"), share(seen, "contact_held"), f"{np.median(apart):.2f}"]
        cells += [wanted, wanted - missed, false, share(seen, "exit_in")]
        table.append("| " + " | ".join(map(str, cells)) + " |")
    return "\n".join(table)


def share(lines: list[dict], key: str) -> str:
    return f"{sum(bool(each[key]) for each in lines)} of {len(lines)}"


def write_csv(path: Path, lines: list[dict]) -> None:
    """All of it in mm, lists separated by spaces."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(lines[0])
        for line in lines:
            writer.writerow(
                [" ".join(f"{x:.3f}" for x in cell) if isinstance(cell, list) else cell for cell in line.values()]
            )


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--write", action="store_true", help="write docs/events_by_eye.md")
    options.add_argument("--csv", type=Path, help="a file for the table")
    given = options.parse_args()
    if not (RECORDINGS / "needle-insertion-rig").is_dir():
        print(f"events beside the eye: no real recordings at {RECORDINGS}; set NEEDLEFORCE_RECORDINGS")
        return
    lines = [beside(row) for row in rows()]
    print("\nevents beside the eye, real recordings\n\n" + summary(lines), flush=True)
    if given.write:
        PAGE.write_text(page(lines, summary(lines), READING), encoding="utf-8")
    if given.csv:
        write_csv(given.csv, lines)


if __name__ == "__main__":
    main()
