# SPDX-License-Identifier: Apache-2.0
"""The page docs/events_by_eye.md: what is said around the tables of ``events_by_eye.py``, and every recording."""

import re

INTRODUCTION = """\
# Events beside the eye

Contact, punctures and exit of 94 insertions recorded by others: as read by eye from plots before the detector existed
(`tests/segmentation/eye_readings.csv`), and as `nf.segment` finds them. The recordings are not part of this repository;
the numbers are depths in mm, in each recording's own zero. The page is made by
`python benchmarks/events_by_eye.py --write`; `make bench` prints the summary.

- **Contact**: the eye's reading and the range that it would also accept. *In*: the detector's depth lies in that range,
  {reading:g} mm wider on either side: half a grid step of the plots, and the width of the line. *Held*: the samples
  between which the detector says that the contact surely lies overlap the eye's range.
- **Punctures**: those the eye calls so; in brackets soft ones, to find or not. *Same*: every one is found, from 0.4 mm
  before to {reading:g} mm after, as the eye read the edge of the fall and the detector gives the peak, and no other is.
- **Exit**: the last sudden step and where the force is back at its baseline. *In*: the detector's lies between them,
  {reading:g} mm wider on either side.
- Odd repeats were used to set thresholds, even ones were not; recordings without a number count as even.
"""
REMARKS = """
## Where they differ

- Contacts out of range are earlier than the eye's, by 0.2 to 0.7 mm: the detector traces a slow first rise, which lies
  in the noise of 15 mN, further back than the eye does. Its interval holds the eye's range in each.
- Exits out of range are later than the eye's, mostly by 0.2 to 0.8 mm: the force is back for good only behind its last
  departure from the noise. In `dev__control-needle__3mm-artery_2_0_2_5` single spikes at 13 mm keep it 1.5 mm behind.
- The one puncture that is missed, at 9.45 mm in the first recording below, falls by 0.11 N: more than a tenth of its
  own peak, but less than the 3 % of the stroke's greatest force (5.1 N) that the detector asks for as well.
"""


def page(lines: list[dict], summary: str, reading: float) -> str:
    """The whole page in Markdown; ``reading`` [mm] is the width of a reading."""
    parts = INTRODUCTION.format(reading=reading), "## Summary\n", summary, REMARKS, "## Every recording\n", table(lines)
    return "\n".join(parts) + "\n"


def short(name: str, names: list[str]) -> str:
    """The name without its date, where that tells it from the others."""
    stem = re.sub(r"_\d{4}-\d\d-\d\d-\d\d-\d\d-\d\d$", "", name)
    return stem if sum(each.startswith(stem + "_2") for each in names) < 2 else name


def table(lines: list[dict]) -> str:
    """Every recording in Markdown."""
    head = [
        "recording",
        "contact, eye",
        "detector",
        "in",
        "punctures, eye",
        "detector",
        "same",
        "exit, eye",
        "detector",
        "in",
    ]
    names = [line["recording"] for line in lines]
    made = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for line in lines:
        contact = (
            f"{line['contact_eye']} ({line['contact_low']}–{line['contact_high']})" if line["contact_eye"] else "none"
        )
        punctures = [f"{each:g}" for each in line["punctures_eye"]] + [f"({each:g})" for each in line["doubtful_eye"]]
        left = f"{line['last_step_eye']}, {line['exit_eye']}" if line["contact_eye"] else "none"
        cells = [f"`{short(line['recording'], names)}`", contact, number(line["contact"]), word(line["contact_in"])]
        cells += [" ".join(punctures) or "none", " ".join(map(number, line["punctures"])) or "none"]
        cells += [word(line["punctures_same"]), left, number(line["exit"]), word(line["exit_in"])]
        made.append("| " + " | ".join(cells) + " |")
    return "\n".join(made)


def number(depth: float | None) -> str:
    return "none" if depth is None else f"{depth:.2f}"


def word(agrees: bool | None) -> str:
    return "not read" if agrees is None else "yes" if agrees else "**no**"
