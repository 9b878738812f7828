# SPDX-License-Identifier: Apache-2.0
"""The page docs/replay.md and its figures: the text around the tables of ``replay.py``."""

from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

FIGURES = {"best": 0.0, "median": 0.5, "worst": 1.0}
"""Which held-out repeats are drawn, by the share of those that ``layered`` replays better."""
COLOURS = {"layered_as_fitted": "#2f6db3", "layered": "#d9822b"}
INTRODUCTION = """\
# Real recordings through the engine

The engine as a haptic device or a robot would run it: the input is the motion of a real insertion at 1 kHz, the output
the force of a model identified from other recordings, step by step through `nf.Insertion`, compared with the measured
force. In each of {conditions} conditions recorded by others in skin, muscle and artery phantoms, the last repeat is
held out and the model identified from the other repeats, without a warm start. *Prediction* uses the motion only,
*replay* also the repeat's own punctures. Errors are over the whole cycle: insertion, hold, withdrawal.

Positions and forces are logged at some 100 Hz. Positions are interpolated by a cubic that keeps each interval monotone
(PCHIP): a needle at rest stays at rest, and none moves beyond its logged positions. Made by
`python benchmarks/replay.py --conditions 99 --write docs/replay.md`; `--full` holds out each repeat in turn.

*Jumps* are the largest change of the force in 1 ms: within {fall:g} s of a rupture, on withdrawal, and elsewhere.
Those of the measured force are averaged over the 10 ms between two samples: changes within a single millisecond were
not measured. Medians over the held-out repeats, in brackets the worst.
"""


def write(page: Path, outcomes: list, tables: list[str], fall: float) -> None:
    """Writes the page, and its figures to ``figures`` next to it; the sections below the tables are kept."""
    sections = page.read_text(encoding="utf-8").partition("\n## ")[2] if page.exists() else "Discussion\n"
    ranked = sorted(outcomes, key=lambda outcome: relative(outcome))
    figures = []
    for name, share in FIGURES.items():
        outcome = ranked[round(share * (len(ranked) - 1))]
        draw(outcome, page.parent / "figures" / f"replay_{name}.svg")
        condition = outcome.source.rsplit("_", 1)[0].replace("__", " ")
        figures.append(
            f"![Measured and replayed force over time](figures/replay_{name}.svg)\n\n*The {name}: {condition}.*\n"
        )
    parts = INTRODUCTION.format(conditions=len(outcomes), fall=fall), "\n".join(tables), "", "\n".join(figures)
    page.write_text("\n".join(parts) + "\n## " + sections, encoding="utf-8")


def relative(outcome) -> float:
    """Rms over the peak of the replay of ``layered``."""
    return float(np.sqrt(np.mean(outcome.error(("layered", "replay")) ** 2)) / outcome.cycle.peak)


def draw(outcome, path: Path) -> None:
    """Prediction and replay over time, and 0.2 s around the steepest measured drop."""
    plt.rcParams.update(
        {"svg.fonttype": "none", "svg.hashsalt": "replay", "path.simplify_threshold": 0.7, "font.size": 8}
    )
    figure, axes = plt.subplots(2, 2, figsize=(7.5, 4.6), sharey="row", width_ratios=(3, 1), layout="constrained")
    cycle = outcome.cycle
    inwards = cycle.stroke == 0
    steepest = cycle.time[inwards][np.argmin(np.diff(cycle.force[inwards]))]
    spans = (cycle.time[0], cycle.time[-1]), (steepest - 0.08, steepest + 0.12)
    for mode, panels in zip(("prediction", "replay"), axes):
        for panel, span, marker in zip(panels, spans, (None, ".")):
            panel.plot(*within(span, outcome.measured), color="#333333", lw=1.2, marker=marker, label="measured")
            for model, colour in COLOURS.items():
                panel.plot(*within(span, outcome.traces[model, mode]), color=colour, lw=0.9, label=f"{model}, {mode}")
            panel.set_xlim(span)
            panel.grid(lw=0.3)
        panels[0].set_ylabel("force [N]")
        panels[0].legend(frameon=False, fontsize=7)
    for panel in axes[1]:
        panel.set_xlabel("time [s]")
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


def within(span: tuple[float, float], trace) -> tuple[np.ndarray, np.ndarray]:
    """Time and force of a trace inside a span [s]."""
    inside = (trace.time >= span[0]) & (trace.time <= span[1])
    return trace.time[inside], trace.force[inside]
