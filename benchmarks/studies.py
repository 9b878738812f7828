# SPDX-License-Identifier: Apache-2.0
"""Studies: indices next to SALib called by hand, predicted and obtained widths of designs, the cost of a learning set.

python benchmarks/studies.py [--write docs/evidence/studies.md]
"""

import argparse
import os
import tempfile
import time
from pathlib import Path

import numpy as np

import needleforce as nf
from needleforce.display.canvas import panels, save_drawing
from needleforce.files import decode_toml
from needleforce.studies.page import draw_tornado

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = ROOT / "examples" / "studies"
FRICTION, CUTTING, DEPTH = (12.0, 25.0), (0.0776, 0.012), 15e-3
N = 1024


def by_hand() -> np.ndarray:
    """Total indices (2,) of the force at 15 mm, f' d + F_c, by SALib without needleforce's study."""
    from SALib.analyze.sobol import analyze
    from SALib.sample.sobol import sample

    problem = {
        "num_vars": 2,
        "names": ["friction", "cutting"],
        "bounds": [list(FRICTION), list(CUTTING)],
        "dists": ["unif", "norm"],
    }
    rows = sample(problem, N, calc_second_order=False, seed=7)
    force = []
    for friction, cutting in rows:
        laws = {"friction": nf.laws.Coulomb(friction), "cutting": nf.laws.ConstantCutting(cutting)}
        force.append(nf.preset("paper").replace(**laws).force([DEPTH])[0])
    return analyze(problem, np.array(force), calc_second_order=False, seed=7)["ST"]


def indices() -> list[str]:
    friction = {"name": "friction.per_length_N_per_mm", "low": 1e-3 * FRICTION[0], "high": 1e-3 * FRICTION[1]}
    cutting = {"name": "cutting.force_N", "distribution": "normal", "mean": CUTTING[0], "sd": CUTTING[1]}
    question = {
        "study": {"method": "sensitivity", "samples": N, "seed": 7},
        "factor": [friction, cutting],
        "output": [{"quantity": "force_at_depth", "depth_mm": 1e3 * DEPTH}],
    }
    (found,) = nf.study(question).sensitivities.values()
    parts = np.array([(DEPTH * (FRICTION[1] - FRICTION[0])) ** 2 / 12.0, CUTTING[1] ** 2])
    exact, hand = parts / parts.sum(), by_hand()
    rows = zip(("friction per length", "cutting force"), exact, hand, found.total, found.total_error)
    lines = ["| factor | exact | SALib by hand | study, total index |", "|---|---|---|---|"]
    return lines + [f"| {name} | {a:.4f} | {b:.4f} | {c:.4f} ± {d:.4f} |" for name, a, b, c, d in rows]


def designs(experiments: int = 200) -> list[str]:
    """Widths that 20 experiments predict next to those of 200 others."""
    question = decode_toml((EXAMPLES / "which_experiment.toml").read_bytes(), "study")
    question["design"] |= {"noise_N": [0.003], "repeats": [1, 5]}
    few = nf.study(question)
    question["study"] |= {"seed": 99}
    question["design"] |= {"experiments": experiments}
    many = nf.study(question)
    lines = [
        f"| experiment | parameter | predicted by 20 | obtained in {experiments} | ratio |",
        "|---|---|---|---|---|",
    ]
    for k, candidate in enumerate(few.candidates):
        for j, parameter in enumerate(few.question.design.parameters):
            a, b = few.expected(j)[k, 0], many.expected(j)[k, 0]
            name = candidate.name(few.question)
            lines.append(
                f"| {name} | {parameter.replace('_', ' ')} | {100 * a:.2f} % | {100 * b:.2f} % | {a / b:.2f} |"
            )
    return lines


def learning_set() -> list[str]:
    """Time and size of 10 000 insertions of 400 samples, and what a million would take."""
    lines = ["| processes | insertions | wall time | bytes an insertion | 10⁶ insertions |", "|---|---|---|---|---|"]
    for jobs in (1, os.cpu_count() or 1):
        with tempfile.TemporaryDirectory() as folder:
            started = time.perf_counter()
            result = nf.study(EXAMPLES / "learning_set.toml", jobs=jobs, out=Path(folder) / "set")
            seconds = time.perf_counter() - started
            size = sum(path.stat().st_size for path in Path(folder).rglob("*") if path.is_file())
        count = len(result.columns["number"])
        million = f"{1e6 / count * seconds / 3600.0:.2f} h, {1e6 / count * size / 1e9:.1f} GB"
        lines.append(f"| {jobs} | {count} | {seconds:.1f} s | {size / count:.0f} | {million} |")
    return lines


def picture() -> None:
    result = nf.study(EXAMPLES / "which_parameter.toml")
    names = [each for each in result.outputs if not each.is_curve]

    def draw(figure: object, sheet: object) -> None:
        grid = panels(figure, sheet, len(names), 1, margins={"left": 200.0, "top": 30.0})
        for axes, output in zip(grid.ravel(), names):
            axes.set_title(output.name.replace("_", " "), loc="left")
            axes.set_xlabel(draw_tornado(axes, result, output, "motion 1")[0])
        grid[0, 0].legend(frameon=False, loc="lower right")

    save_drawing(ROOT / "docs" / "figures" / "which_parameter.svg", draw, 420.0)


HEAD = """# Studies

Made by `python benchmarks/studies.py --write docs/evidence/studies.md` on {cores} cores.
Times are of this machine; ratios are not.

"""


def main(write: Path | None) -> None:
    parts = [
        ("Indices of a sum, in closed form, by SALib alone and by a study", indices()),
        ("Designs: predicted and obtained width of the interval over the value, medians", designs()),
        ("A learning set", learning_set()),
    ]
    text = HEAD.format(cores=os.cpu_count()) + "\n\n".join(
        f"## {title}\n\n" + "\n".join(lines) for title, lines in parts
    )
    print(text)
    if write is not None:
        picture()
        write.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=Path, help="the page to write")
    main(parser.parse_args().write)
