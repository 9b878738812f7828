# SPDX-License-Identifier: Apache-2.0
"""docs/evidence/events_by_eye.md: the text around the tables of ``events_by_eye.py``, and the table of recordings."""

import re

INTRODUCTION = """\
# Detected events and readings by eye

Contact, punctures and exit of 94 insertions recorded by others: as read by eye from plots before the detector existed
(`tests/segmentation/eye_readings.csv`), and as `nf.segment` finds them. The recordings are not part of this repository.
Depths are in mm, in each recording's own zero. The page is made by
`python benchmarks/events_by_eye.py --write`; `make bench` prints the summary.

- **Contact**: the reading by eye and the range also accepted. *In range*: the detected depth lies in that range,
  {reading:g} mm wider on either side: half a grid step of the plots, and the width of the line. *Intervals overlap*:
  the detector's interval of the contact overlaps the range by eye.
- **Punctures**: sharp ones; in brackets soft ones, whose detection is optional. *Agree*: every sharp one is detected,
  at most 0.4 mm before and {reading:g} mm after the reading (the eye read the edge of the drop, the detector gives the
  peak), and there is no false detection.
- **Exit**: the last sudden step and where the force is back at its baseline. *In range*: the detected exit lies between
  them, {reading:g} mm wider on either side.
- Limits of contact and exit were set on odd repeats, not on even ones; recordings without a number count as even.
  Those of punctures follow from the noise (events.md), but for the tenth of the force that the eye, too, asks for.
"""
REMARKS = """
## Differences

- Detected contacts out of range are earlier than the readings, by 0.2 to 0.7 mm: the detector traces a slow first rise,
  hidden in the noise of 15 mN, further back than the eye. Its interval overlaps the range by eye in each.
- Detected exits out of range are later than the readings, mostly by 0.2 to 0.8 mm: the detector waits for the last
  departure of the force from the noise. In `dev__control-needle__3mm-artery_2_0_2_5` single spikes at 13 mm delay it by
  1.5 mm.
- Lesser falls that the eye calls no puncture, most of them below a tenth of the force, are in `events.minor`.
"""


def page(lines: list[dict], summary: str, reading: float) -> str:
    """The complete page in Markdown; ``reading`` [mm] is the uncertainty of a reading."""
    parts = INTRODUCTION.format(reading=reading), "## Summary\n", summary, REMARKS, "## Every recording\n", table(lines)
    return "\n".join(parts) + "\n"


def short(name: str, names: list[str]) -> str:
    """The name without its date, if it stays unique."""
    stem = re.sub(r"_\d{4}-\d\d-\d\d-\d\d-\d\d-\d\d$", "", name)
    return stem if sum(each.startswith(stem + "_2") for each in names) < 2 else name


def table(lines: list[dict]) -> str:
    """Every recording in Markdown."""
    head = [
        "recording",
        "contact, by eye",
        "detected",
        "in range",
        "punctures, by eye",
        "detected",
        "agree",
        "exit, by eye",
        "detected",
        "in range",
    ]
    names = [line["recording"] for line in lines]
    made = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for line in lines:
        contact = (
            f"{line['contact_eye']} ({line['contact_low']}–{line['contact_high']})" if line["contact_eye"] else "none"
        )
        punctures = [f"{each:g}" for each in line["punctures_eye"]] + [f"({each:g})" for each in line["doubtful_eye"]]
        exit_eye = f"{line['last_step_eye']}, {line['exit_eye']}" if line["contact_eye"] else "none"
        cells = [
            f"`{short(line['recording'], names)}`",
            contact,
            number(line["contact"]),
            word(line["contact_in_range"]),
        ]
        cells += [" ".join(punctures) or "none", " ".join(map(number, line["punctures"])) or "none"]
        cells += [word(line["punctures_agree"]), exit_eye, number(line["exit"]), word(line["exit_in_range"])]
        made.append("| " + " | ".join(cells) + " |")
    return "\n".join(made)


def number(depth: float | None) -> str:
    return "none" if depth is None else f"{depth:.2f}"


def word(agrees: bool | None) -> str:
    return "not read" if agrees is None else "yes" if agrees else "**no**"
