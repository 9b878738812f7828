# SPDX-License-Identifier: Apache-2.0
"""Cross-validation: held-out repeats of real recordings predicted from the others, over the repeatability floor.

    python benchmarks/cross_validation.py [--full] [--write docs/evidence/cross_validation.md]

Uses every condition with three repeats or more; the condition is the file's name without its last two parts, repeat and
date. Models are identified without a warm start for every held-out repeat, so that --full takes some twenty minutes on
two cores; without it, two conditions and no passive layered model.
"""

import argparse
import os
import runpy
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

import needleforce as nf
from needleforce.identification.compare import ModelRow
from needleforce.identification.strokes import STROKES

ROOT = Path(__file__).resolve().parents[1]
COLUMNS = {"force": "fz", "depth": "pz", "time": "time"}
UNITS = {"time": "us", "depth": "mm", "force": "N"}
ONE_LAYER = ("paper", "cone_cylinder", "power_law", "okamura", "maurin")
LAYERED = ("layered_as_fitted", "layered_yielding", "layered")
FEW_CONDITIONS = 2  # without --full
HEAD = """# Cross-validation on held-out repeats

Each repeat of {conditions} conditions is predicted by a model identified from the other repeats only, without a warm
start. The {files} files were recorded by others in skin, muscle and artery phantoms at 1 to 3 mm/s. Values are errors
over the *floor*, the error of the mean of the other repeats of the same motion, by depth in the strokes and by time in
the hold. Both errors are rms over the whole cycle, hold included, over the peak. *Prediction* uses the motion only,
*replay* also depth and force of the repeat's own punctures. A perfect predictor would reach {perfect:.2f}.

Made by `python benchmarks/cross_validation.py --full --write docs/evidence/cross_validation.md`. Conditions are taken
from the file names; no setting depends on them.

"""


def conditions(folder: Path) -> dict[str, list[Path]]:
    """Files of each condition with three repeats or more."""
    found: dict[str, list[Path]] = {}
    for path in sorted(folder.glob("*.csv")):
        name, repeat, _ = path.stem.rsplit("_", 2)
        if repeat.isdigit():
            found.setdefault(name, []).append(path)
    return {name: files for name, files in found.items() if len(files) >= 3}


def compared(files: list[Path], models: tuple[str, ...]) -> tuple[ModelRow, ...]:
    """The models on one condition; a file that cannot be read is left out."""
    read = []
    for file in files:
        try:
            read.append(nf.read(file, columns=COLUMNS, units=UNITS))
        except nf.InputError as error:
            print(f"{file.name}: {error}", file=sys.stderr)
    return nf.compare(read, models)


def table(rows: dict[str, dict[str, ModelRow]]) -> list[str]:
    """Markdown: medians over conditions for every model, then every condition."""
    models = [model for model in (*ONE_LAYER, *LAYERED) if all(model in row for row in rows.values())]
    heads = ("prediction, median", "90th percentile", "replay, median", "90th percentile", *STROKES)
    lines = [f"| model | {' | '.join(heads)} |", "|---" * (1 + len(heads)) + "|"]
    for model in models:
        found = [row[model] for row in rows.values()]
        prediction, replay = ([getattr(row, what) for row in found] for what in ("prediction", "replay"))
        strokes = np.median([row.by_stroke for row in found], axis=0)
        numbers = [*np.percentile(prediction, [50, 90]), *np.percentile(replay, [50, 90]), *strokes]
        lines.append(f"| `{model}` | " + " | ".join(f"{number:.2f}" for number in numbers) + " |")
    lines += [
        "",
        f"| condition | repeats | floor / peak | `{'` | `'.join(models)}` |",
        "|---" * (3 + len(models)) + "|",
    ]
    for name, row in sorted(rows.items()):
        cross_validation = next(iter(row.values())).cross_validation
        shown = [f"{row[model].prediction:.2f}, {row[model].replay:.2f}" for model in models]
        floor = float(np.sqrt(np.mean(cross_validation.floor[:, 0] ** 2)))
        lines.append(
            f"| {name.replace('__', ' ')} | {len(cross_validation.floor)} | {floor:.3f} | " + " | ".join(shown) + " |"
        )
    return [*lines, "", "For each condition and model: prediction, replay."]


def main(full: bool, write: Path | None) -> None:
    folder = runpy.run_path(str(ROOT / "tests" / "recorded_data.py"))["RECORDINGS"] / "needle-insertion-rig"
    if not folder.is_dir():
        print(f"cross-validation: no real recordings at {folder}; set NEEDLEFORCE_RECORDINGS")
        return
    found = dict(list(conditions(folder).items())[: None if full else FEW_CONDITIONS])
    models = (*ONE_LAYER, *(LAYERED if full else LAYERED[:1]))
    rows: dict[str, dict[str, ModelRow]] = {}
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        work = {name: pool.submit(compared, files, models) for name, files in found.items()}
        for name, future in work.items():
            rows[name] = {row.model: row for row in future.result()}
            layered = rows[name][LAYERED[0]]
            print(f"{name}: prediction {layered.prediction:.2f}, replay {layered.replay:.2f}", flush=True)
    lines = table(rows)
    print("\n".join(lines))
    if write is not None:
        repeats = np.median([len(next(iter(row.values())).cross_validation.floor) for row in rows.values()])
        head = HEAD.format(
            conditions=len(rows), files=sum(map(len, found.values())), perfect=np.sqrt((repeats - 1) / repeats)
        )
        write.write_text(head + "\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true", help="every condition, and also the passive layered models")
    parser.add_argument("--write", type=Path, help="the page to write")
    options = parser.parse_args()
    main(options.full, options.write)
