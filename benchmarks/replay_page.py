# SPDX-License-Identifier: Apache-2.0
"""The page docs/evidence/replay.md and its figures, with the tables of ``replay.py``."""

from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

FIGURES = {"best": 0.0, "median": 0.5, "worst": 1.0}
"""The held-out repeats that are drawn, by the share of repeats that ``layered`` replays better."""
COLOURS = {"layered_as_fitted": "#2f6db3", "layered_yielding": "#3a923a", "layered": "#d9822b"}
INTRODUCTION = """\
# Error on real insertions at 1 kHz

The engine runs as in a haptic device or robot: `nf.Insertion` receives the motion of a real insertion at 1 kHz and
returns the force of a model identified from other recordings. The force is compared with the measured one. For each
of {conditions} conditions recorded by others in skin, muscle and artery phantoms, the last repeat is held out and the
model is identified from the other repeats, without a warm start. *Prediction* uses only the motion of the held-out
repeat, *replay* also its punctures. Errors are over the complete cycle: insertion, hold, withdrawal.

Positions and forces are logged at about 100 Hz. Positions are interpolated by a cubic that is monotone in each interval
(PCHIP): a needle at rest stays at rest, and no position exceeds the logged range. Made by
`python benchmarks/replay.py --conditions 99 --write docs/evidence/replay.md`; `--full` holds out each repeat in turn.

*Jumps* are the largest change of the force in 1 ms: within {fall:g} s of a rupture, during withdrawal, and elsewhere.
Jumps of the measured force are averages over the 10 ms between two samples; changes within a single millisecond were
not recorded. Values are medians over the held-out repeats, with the worst in brackets.
"""


def write(page: Path, outcomes: list, tables: list[str], fall: float) -> None:
    """Writes the page, and its figures into ``docs/figures``; keeps the text below the tables."""
    observations = page.read_text(encoding="utf-8").partition("\n## Observations\n")[2] if page.exists() else ""
    ranked = sorted(outcomes, key=lambda outcome: relative(outcome))
    figures = []
    for name, share in FIGURES.items():
        outcome = ranked[round(share * (len(ranked) - 1))]
        draw(outcome, page.parents[1] / "figures" / f"replay_{name}.svg")
        condition = outcome.source.rsplit("_", 1)[0].replace("__", " ")
        figures.append(
            f"![Measured and replayed force over time](../figures/replay_{name}.svg)\n\n*The {name}: {condition}.*\n"
        )
    parts = INTRODUCTION.format(conditions=len(outcomes), fall=fall), "\n".join(tables), "", "\n".join(figures)
    page.write_text("\n".join(parts) + "\n## Observations\n" + observations, encoding="utf-8")


def relative(outcome) -> float:
    """Rms over the peak of the replay of ``layered``."""
    return float(np.sqrt(np.mean(outcome.error(("layered", "replay")) ** 2)) / outcome.cycle.peak)


def draw(outcome, path: Path) -> None:
    """Prediction and replay over time, and 0.2 s around the steepest measured fall."""
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
