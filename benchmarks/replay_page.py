# SPDX-License-Identifier: Apache-2.0
"""The page docs/replay.md and its figures: what is said around the tables of ``replay.py``."""

from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

FIGURES = {"best": 0.0, "median": 0.5, "worst": 1.0}
"""Which repeats left out are drawn, by the share of those that ``layered`` replays better."""
COLOURS = {"layered_as_fitted": "#2f6db3", "layered": "#d9822b"}
INTRODUCTION = """\
# Real recordings through the engine

The engine as a haptic device or a robot would run it: the motion of a real insertion in at 1 kHz, the force of a model
identified from other recordings out, step by step through `nf.Insertion`, beside the force that was measured. Of each
of {conditions} conditions recorded by others in skin, muscle and artery phantoms, the last repeat is left out and the
model identified from the other repeats, from cold. *Prediction* knows the motion alone, *replay* also the punctures of
the repeat itself. Errors are over the whole cycle: insertion, hold, withdrawal.

Positions and forces are logged at some 100 Hz. Between the positions runs a cubic that keeps each interval monotone
(PCHIP): a needle at rest stays at rest, and none goes beyond where it was seen. Made by
`python benchmarks/replay.py --conditions 99 --write docs/replay.md`; `--full` leaves out each repeat in turn.

*Jumps* are the largest change of the force in 1 ms: within {fall:g} s of a rupture, on the way out, and elsewhere.
Those of the measured force are even over the 10 ms between two samples: what happened in a single millisecond of them
nobody has seen. Medians over the repeats left out, in brackets the worst.
"""


def write(page: Path, outcomes: list, tables: list[str], fall: float) -> None:
    """The page and its figures, which go to ``figures`` beside it; what stands below the tables is kept."""
    said = page.read_text(encoding="utf-8").partition("\n## What one sees\n")[2] if page.exists() else ""
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
    page.write_text("\n".join(parts) + "\n## What one sees\n" + said, encoding="utf-8")


def relative(outcome) -> float:
    """Rms over the peak of the replay of ``layered``."""
    return float(np.sqrt(np.mean(outcome.error(("layered", "replay")) ** 2)) / outcome.cycle.peak)


def draw(outcome, path: Path) -> None:
    """Prediction and replay over time, and 0.2 s around the steepest fall that was measured."""
    plt.rcParams.update(
        {"svg.fonttype": "none", "svg.hashsalt": "replay", "path.simplify_threshold": 0.7, "font.size": 8}
    )
    figure, axes = plt.subplots(2, 2, figsize=(7.5, 4.6), sharey="row", width_ratios=(3, 1), layout="constrained")
    cycle = outcome.cycle
    inwards = cycle.stroke == 0
    steepest = cycle.time[inwards][np.argmin(np.diff(cycle.force[inwards]))]
    spans = (cycle.time[0], cycle.time[-1]), (steepest - 0.08, steepest + 0.12)
    for way, panels in zip(("prediction", "replay"), axes):
        for panel, span, marker in zip(panels, spans, (None, ".")):
            panel.plot(*within(span, outcome.measured), color="#333333", lw=1.2, marker=marker, label="measured")
            for model, colour in COLOURS.items():
                panel.plot(*within(span, outcome.traces[model, way]), color=colour, lw=0.9, label=f"{model}, {way}")
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
