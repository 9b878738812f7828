# SPDX-License-Identifier: Apache-2.0
"""Contacts, punctures and exits read by eye from plots, compared with the detected ones, for every real recording.

    python benchmarks/events_by_eye.py [--write] [--csv FILE]

Prints the summary, separately for odd repeats (on which thresholds were set) and even ones; ``--write`` makes the page
docs/evidence/events_by_eye.md, ``--csv`` a table in millimetres. The recordings were made by others and are not in this
repository; without them a message is printed and nothing is done. tests/segmentation/eye_readings.csv has the readings
and explains how they were made.
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
from recorded_data import RECORDINGS  # noqa: E402
from test_segmentation_real import READING, depths, near, repeat, rows  # noqa: E402  the one parser of the table

PAGE = ROOT / "docs" / "evidence" / "events_by_eye.md"


def events_of(name: str) -> tuple:
    """One recording and the detector's events in it; None twice where it cannot be read."""
    try:
        run = nf.read(RECORDINGS / "needle-insertion-rig" / f"{name}.csv")
    except nf.InputError:
        return None, None
    return run, nf.segment(run)


def compared(row: dict) -> dict:
    """One line of the table: by eye, detected, and whether they agree, by event; None without anything to compare."""
    run, events = events_of(row["recording"])
    line = {"recording": row["recording"], "half": "odd" if repeat(row["recording"]) % 2 else "even"}
    line |= {"contact_eye": row["contact"], "contact_low": row["contact_low"], "contact_high": row["contact_high"]}
    line |= {"punctures_eye": depths(row["punctures"]), "doubtful_eye": depths(row["doubtful"])}
    line |= {"exit_eye": row["exit"], "last_step_eye": row["last_step"]}
    contact, exit_event = (None if events is None else getattr(events, name) for name in ("contact", "exit"))
    line["contact"] = None if contact is None else 1e3 * contact.depth
    line["contact_overlaps"] = overlaps(run, contact, row)
    line["punctures"] = [] if events is None else [1e3 * each.depth for each in events.punctures]
    line["exit"] = None if exit_event is None else 1e3 * exit_event.depth
    line["unreadable"] = events is None
    return line | agreement(line)


def agreement(line: dict) -> dict:
    """Whether contact, punctures and exit agree."""
    if line["unreadable"]:
        return {"contact_in_range": None, "punctures_agree": None, "exit_in_range": None, "missed": [], "false": []}
    sharp, soft, found = line["punctures_eye"], line["doubtful_eye"], line["punctures"]
    missed = [depth for depth in sharp if not any(near(each, [depth]) for each in found)]
    false = [each for each in found if not near(each, sharp + [depth + READING for depth in soft])]
    return {
        "contact_in_range": inside(line["contact"], line["contact_low"], line["contact_high"]),
        "punctures_agree": not missed and not false if line["contact_eye"] else not found,
        "exit_in_range": inside(line["exit"], line["exit_eye"], line["last_step_eye"]),
        "missed": missed,
        "false": false,
    }


def overlaps(run, contact, row: dict) -> bool | None:
    """Whether the detector's interval of the contact overlaps the range by eye; None without a reading or contact."""
    if contact is None or not row["contact"]:
        return None
    low, high = 1e3 * run.depth[[contact.low, contact.high]]
    return bool(low <= float(row["contact_high"]) and float(row["contact_low"]) <= high)


def inside(found: float | None, *limits: str) -> bool:
    """Whether a depth lies between the readings; without readings, whether no depth was found."""
    if not all(limits):
        return found is None
    low, high = sorted(map(float, limits))
    return found is not None and low - READING <= found <= high + READING


def summary(lines: list[dict]) -> str:
    """Odd repeats, even repeats and all, in Markdown."""
    head = ["repeats", "recordings", "contact in range", "intervals overlap", "contact, median difference mm"]
    head += ["punctures", "detected", "false detections", "exit in range"]
    table = ["| " + " | ".join(head) + " |", "|---|" + "---:|" * (len(head) - 1)]
    for half in ("odd", "even", "all"):
        mine = [each for each in lines if not each["unreadable"] and half in (each["half"], "all")]
        with_contact = [each for each in mine if each["contact_eye"]]
        differences = [
            abs(each["contact"] - float(each["contact_eye"])) for each in with_contact if each["contact"] is not None
        ]
        wanted, missed, false = (sum(len(each[key]) for each in mine) for key in ("punctures_eye", "missed", "false"))
        cells = [
            half,
            len(mine),
            share(with_contact, "contact_in_range"),
            share(with_contact, "contact_overlaps"),
            f"{np.median(differences):.2f}",
        ]
        cells += [wanted, wanted - missed, false, share(with_contact, "exit_in_range")]
        table.append("| " + " | ".join(map(str, cells)) + " |")
    return "\n".join(table)


def share(lines: list[dict], key: str) -> str:
    return f"{sum(bool(each[key]) for each in lines)} of {len(lines)}"


def write_csv(path: Path, lines: list[dict]) -> None:
    """Writes every line in mm, lists separated by spaces."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(lines[0])
        for line in lines:
            writer.writerow(
                [" ".join(f"{x:.3f}" for x in cell) if isinstance(cell, list) else cell for cell in line.values()]
            )


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--write", action="store_true", help="write docs/evidence/events_by_eye.md")
    options.add_argument("--csv", type=Path, help="a file for the table")
    arguments = options.parse_args()
    if not (RECORDINGS / "needle-insertion-rig").is_dir():
        print(f"events by eye: no real recordings at {RECORDINGS}; set NEEDLEFORCE_RECORDINGS")
        return
    lines = [compared(row) for row in rows()]
    print("\ndetected events and readings by eye, real recordings\n\n" + summary(lines), flush=True)
    if arguments.write:
        PAGE.write_text(page(lines, summary(lines), READING), encoding="utf-8")
    if arguments.csv:
        write_csv(arguments.csv, lines)


if __name__ == "__main__":
    main()
