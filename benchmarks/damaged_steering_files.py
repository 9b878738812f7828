# SPDX-License-Identifier: Apache-2.0
"""Damaged steering files, tip tables, base motions and tables of shapes: read with finite numbers, or refused.

    python benchmarks/damaged_steering_files.py [--files 20000] [--simulate 10]

Every file is a valid one with one to three changes: bytes changed or cut out, numbers replaced by what no needle has,
cells of another type, keys, columns and rows missing or twice, spikes. It is read with finite numbers, or refused with
an InputError that has a next step, within two seconds of processor time; anything else is printed and ends the
benchmark with an error. One in ``--simulate`` of the steering files that are read is simulated, and one in as many base
motions, where each step is finite or lost. Last, clean tip paths in which no spike is to be found.
"""

import argparse
import random
import re
import resource
import sys
import tempfile
import time
import warnings
from collections import Counter
from pathlib import Path

import numpy as np

import needleforce as nf
from needleforce.rig import SteeringPhantom, steering_insertion, write_steering
from needleforce.steering import BaseMotion
from needleforce.steering.tip_path_tables import spikes

LIMIT_S = 2.0
NUMBERS = ("nan", "inf", "-inf", "1e308", "-1e308", "1e31", "1e-308", "-5", "0", "-0.0", "50", "100000", "1e22",
           "99999999999999999999", "1_000", "0x1f")  # fmt: skip
OTHERS = ("", '"x"', "[]", "{}", "true", "None", "[[1.0]]", "1979-05-27", "=1+1", "\x00", "\u202e", ",", "\n")
SHAPE = "x_mm,y_mm,z_mm,depth_mm\n" + "".join(f"{0.001 * z**2},0,{z},90\n" for z in range(0, 91, 5))
MOTION = (
    "\n".join(["depth_mm,base_x_mm,base_y_mm,roll_deg", *(f"{z},{0.1 * z},0,{2 * z}" for z in range(0, 81, 5))]) + "\n"
)


def valid(folder: Path) -> dict[str, str]:
    """The content of a file of each kind; the needle is identified from the table."""
    made = []
    for number in range(3):
        insertion = steering_insertion(1, number, SteeringPhantom())
        for depth in np.arange(0.0, 0.081, 5e-3):
            insertion.advance(float(depth), (2e-3 * (number > 0 and depth > 0.02), 1e-3 * (number > 1)))
        made.append(insertion)
    write_steering(made, folder / "tips.csv")
    fit = nf.steering.identify(nf.steering.read(folder / "tips.csv"), SteeringPhantom().needle, model="linear")
    fit.save(folder / "needle.toml")
    tables = {name: (folder / name).read_text(encoding="utf-8") for name in ("needle.toml", "tips.csv")}
    return tables | {"motion.csv": MOTION, "shapes.csv": SHAPE}


def damaged(text: str, chance: random.Random) -> bytes:
    """The content with one to three changes."""
    for _ in range(chance.randint(1, 3)):
        text = chance.choice((number_replaced, number_replaced, spike, line_changed, cut, columns_changed))(
            text, chance
        )
    data = bytearray(text.encode("utf-8", "replace"))
    for _ in range(chance.choice((0, 0, 0, 0, 1, 5)) if data else 0):
        data[chance.randrange(len(data))] = chance.randrange(256)
    return bytes(data)


def places(text: str) -> list[tuple[int, int]]:
    """Begin and end of each number."""
    return [found.span() for found in re.finditer(r"(?<![\w.])-?\d[\d.]*(?:e[+-]?\d+)?", text)] or [(0, 1)]


def number_replaced(text: str, chance: random.Random) -> str:
    begin, end = chance.choice(places(text))
    return text[:begin] + chance.choice(NUMBERS if chance.random() < 0.7 else OTHERS) + text[end:]


def spike(text: str, chance: random.Random) -> str:
    begin, end = chance.choice(places(text))
    size = chance.choice((-1.0, 1.0)) * 10.0 ** chance.uniform(-3.0, 8.0)
    try:
        return text[:begin] + repr(float(text[begin:end]) + size) + text[end:]
    except ValueError:
        return text


def line_changed(text: str, chance: random.Random) -> str:
    lines = text.split("\n")
    at = chance.randrange(len(lines))
    lines[at : at + 1] = chance.choice(([], [lines[at]] * 2, [lines[at]] * 50, [lines[at][::-1]]))
    return "\n".join(lines)


def cut(text: str, chance: random.Random) -> str:
    begin = chance.randrange(len(text) or 1)
    return text[:begin] + (text[begin + chance.randint(1, 400) :] if chance.random() < 0.7 else "")


def columns_changed(text: str, chance: random.Random) -> str:
    """A key or header with another name, or two cells of a line exchanged."""
    words = sorted({word for word in text.replace(",", " ").replace("=", " ").split() if word[:1].isalpha()})
    word = chance.choice(words or ["x"])
    return text.replace(word, chance.choice(("", word + "_", word.upper(), chance.choice(words or ["x"]))), 1)


def finite(name: str, file: Path, simulated: bool) -> bool:
    """Read a file, and whether all of its numbers, and those that follow, are finite."""
    straight = BaseMotion(5e-3 * np.arange(7), np.zeros((7, 2)), np.zeros(7))
    if name == "needle.toml":
        model = nf.steering.load(file)
        paths, numbers = model.predictor.insertions, [*model.values.values(), model.needle.length]
        return is_finite(paths) and bool(np.all(np.isfinite(numbers))) and (not simulated or ok(model, straight))
    if name == "tips.csv":
        return is_finite(nf.steering.read(file))
    if name == "shapes.csv":
        return all(np.isfinite(shape.points).all() for shape in nf.steering.read_shapes(file))
    motion = BaseMotion.read(file)
    layer = nf.LateralLayer(modulus=2e4, tip_force=0.2)
    flex = nf.FlexibleInsertion(None, SteeringPhantom().needle, lateral=[layer], max_speed=np.inf)
    falls = np.any(np.diff(motion.depth) < 0.0) or not len(motion)
    return falls or not simulated or ok(flex, motion)


def is_finite(paths: object) -> bool:
    return all(np.isfinite(np.column_stack([p.base, p.tip, p.roll, p.depth])).all() for p in paths)  # type: ignore[attr-defined]


def ok(model: object, motion: BaseMotion) -> bool:
    """Whether every step of a simulated motion is lost or has finite tip, force and wrench."""
    run = nf.steering.simulate(model, motion)
    return bool(np.isfinite(np.column_stack([run.tip, run.force, run.wrench]))[~run.lost].all())


def trial(name: str, content: bytes, folder: Path, simulated: bool) -> tuple[str, float]:
    """The outcome of a file, and the processor time [s]."""
    (folder / name).write_bytes(content)
    begin = time.process_time()
    try:
        outcome = "read" if finite(name, folder / name, simulated) else "not finite"
    except nf.InputError as error:
        outcome = "refused" if error.next_step or error.limit else "refused without reason"
    except Exception as error:
        outcome = f"{type(error).__name__}: {error}"[:150]
    seconds = time.process_time() - begin
    return (outcome if simulated or seconds < LIMIT_S else f"took {seconds:.1f} s"), seconds


def clean_paths(count: int) -> tuple[int, int]:
    """Spikes found in insertions of the rig, half of them steered, in steps of 2 to 10 mm; and their number of rows."""
    found = rows = 0
    for seed in range(count):
        rng = np.random.default_rng(seed)
        insertion, base = steering_insertion(seed, 0, SteeringPhantom(noise=rng.uniform(0.05e-3, 0.5e-3))), np.zeros(2)
        for row, depth in enumerate(np.arange(0.0, 0.1001, rng.choice([2e-3, 5e-3, 10e-3]))):
            if seed % 2 and row >= 2:
                base = np.clip(base + rng.normal(0.0, 1.2e-3, 2), -6e-3, 6e-3)
            insertion.advance(float(depth), base)
        tip = 1e-3 * np.array([[row[f"tip_{axis}_mm"] for axis in "xyz"] for row in insertion.rows])
        found, rows = found + len(spikes(tip)), rows + len(tip)
    return found, rows


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--files", type=int, default=20_000)
    options.add_argument("--simulate", type=int, default=10)
    options.add_argument("--clean", type=int, default=1000)
    given = options.parse_args()
    warnings.simplefilter("ignore")
    wrong: list[str] = []
    print("| file | damaged | read | refused | other outcome | longest processor time |\n|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        contents = valid(folder)
        for name, text in contents.items():
            counts, longest = Counter[str](), 0.0
            for number in range(given.files // len(contents)):
                content = damaged(text, random.Random(f"{name} {number}"))
                outcome, seconds = trial(name, content, folder, number % given.simulate == 0)
                known = outcome if outcome in ("read", "refused") else "other"
                counts[known] += 1
                longest = max(longest, seconds if number % given.simulate else 0.0)
                wrong += [f"{name}, change {number}: {outcome}"] * (known == "other")
            cells = [sum(counts.values()), counts["read"], counts["refused"], counts["other"], f"{longest:.2f} s"]
            print(f"| {name} |", " | ".join(map(str, cells)), "|", flush=True)
    print(f"\nmost memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss >> 10} MiB")
    found, rows = clean_paths(given.clean)
    print(f"{found} spikes in {given.clean} clean insertions, {rows} rows")
    for line in wrong[:40]:
        print(line)
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
