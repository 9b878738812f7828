# SPDX-License-Identifier: Apache-2.0
"""Recorders against axes and sensors that lie at random, in processes of their own: how far does the needle get?

``python benchmarks/lies.py [--runs 10000] [--jobs 6] [--first-seed 0] [--simulated]`` prints what was violated, with
its seed, and a table of distances and delays by kind of lie. Exit code 1 if anything was violated. On a simulated clock
a run takes a tenth of its time, is the same each time, and the delays are those of the program alone.
"""

import argparse
import collections
import contextlib
import multiprocessing
import resource
import sys
import tempfile
import time
from pathlib import Path

from lying_rig import (
    CONFIGURATION,
    LIMITS,
    NOISE,
    START,
    STIFFNESS,
    UNUSABLE,
    LyingRig,
    RigInProcess,
    RigInThread,
)
from simulated_clock import SimulatedClock

from needleforce import InputError
from needleforce.acquisition.axis_check import stop_distance
from needleforce.acquisition.recorder import AxisNotStopped, record_run
from needleforce.acquisition.settings import Settings
from needleforce.acquisition.sources.axis import AxisClient
from needleforce.acquisition.sources.net_ft_sensor import SensorClient

SPEED, DEPTH, SILENCE = 0.02, 6e-3, 0.5
SETTINGS = Settings(force_limit=1.0, bias_time=0.1, silence=SILENCE)
REACTION = 0.1  # [s] from the force to the order to stop, in addition to delays of the two processes
BLIND = {  # the reported depth is not the true one, or there is none
    "depth late", "depth frozen", "depth times 3", "depth reversed", "depth jumps", "counter repeats", "counter falls",
    "silent", "closes", "garbage", "long line", "flood of states", "flood of answers",
}  # fmt: skip
FALLING = {"scale falls", "scale falls, noise stays", "any scale", "any scale, noise stays", "scale creeps"}
HIDING = FALLING | {"zero falls", "zero creeps"}  # the limit is on the reading, so that the force may pass it
CREEPING = {"zero creeps", "scale creeps"}  # of which a force at rest seems to rise
CLEAR = {"honest", "huge datagrams", "flood of records", "constant fifth", "lateral frozen"}
SEEN_SCALE = 0.75  # below which a jump of the scale is promised to be seen by the bias, after three means
SURE_LATE = 0.2  # [s] of a depth from which the turn shows it
FIGURES = (
    "after the order [mm]", "limit to order [ms]", "beyond the limit [mm]", "lie to order [ms]", "without force [mm]",
    "force over the bound",
)  # fmt: skip


def one(seed: int, folder: Path, rig: RigInProcess | RigInThread) -> dict:
    """One run: plan, truth, and what the recorder reported."""
    path, page, began = folder / f"{seed}.mcap", folder / f"{seed}.xml", time.monotonic()
    page.write_bytes(CONFIGURATION.xml())
    sensor, axis = rig.begin(seed, page)
    limit = LyingRig(seed, page).plan["limit"]
    settings = Settings(**{**vars(SETTINGS), "force_limit": limit})
    moves = [(DEPTH, SPEED), (DEPTH, 0.1), (START, SPEED)]
    result = {"seed": seed, "error": "", "outcome": None, "complete": None}
    try:
        force = SensorClient("127.0.0.1", sensor, CONFIGURATION, str(page))
        result["outcome"] = record_run(path, force, AxisClient("127.0.0.1", axis), moves, {}, settings)
        result["complete"] = path.read_bytes().endswith(b"\x89MCAP0\r\n")  # as a closed file ends
    except AxisNotStopped as error:
        result["error"] = str(error)
    except InputError as error:
        result["error"] = str(error)
    result["seconds"] = time.monotonic() - began
    result["plan"], result["truth"] = rig.end()
    for each in (path, page):
        each.unlink(missing_ok=True)
    return result


def judged(result: dict) -> tuple[list[str], dict]:
    """What is violated, and the figures of the run."""
    truth, outcome = result["truth"], result["outcome"]
    if outcome is None:
        return (["no run: " + result["error"]] if truth["moves"] else []), {}
    own = outcome.longest_own_gap + truth["gap"]
    wrong, figures = distances(result, own)
    wrong += rest(result, own, figures["after the order [mm]"]) + reason(result, own)
    if not result["complete"]:
        wrong.append("file not complete")
    if result["seconds"] > 12.0:
        wrong.append(f"took {result['seconds']:.1f} s")
    return wrong, figures


def distances(result: dict, own: float) -> tuple[list[str], dict]:
    """How far the needle got after the order, after the limit, and after the force could no longer be used."""
    plan, truth, wrong = result["plan"], result["truth"], []
    track, ordered = truth["track"], min(truth["stops"], default=float("inf"))
    figures = {"after the order [mm]": 1e3 * farthest(track, ordered)}
    if plan["deed"] == "ignores the stop":
        return wrong, figures
    speed = SPEED * (4.0 if plan["deed"] == "too fast" else 1.0)
    late = {"stops 0.4 s late": 0.4, "only silence stops it": 1.6}.get(plan["deed"], 0.0)
    usual = speed * (REACTION + own + late) + stop_distance(LIMITS, speed)
    unusable = plan["sensor"] in UNUSABLE and (plan["sensor"] != "zero falls" or plan["begins"] < DEPTH - 3e-3)
    unusable |= plan["sensor"].startswith("any scale") and plan["scale"] < SEEN_SCALE
    hidden = (plan["sensor"] in UNUSABLE or plan["sensor"] in HIDING) and truth["lie"] <= truth["crossed"]
    if truth["crossed"] < ordered and not hidden:
        distance, slow = farthest(track, truth["crossed"]), speed * 0.1 * (plan["sensor"] in ("late", "half lost"))
        figures |= {"limit to order [ms]": 1e3 * (ordered - truth["crossed"]), "beyond the limit [mm]": 1e3 * distance}
        if distance > usual + slow:
            wrong.append(f"{1e3 * distance:.2f} mm beyond the limit")
    if unusable and truth["lie"] < ordered:  # a zero that falls is seen where the needle goes deeper for 0.1 s
        distance = farthest(track, truth["lie"])
        figures |= {"lie to order [ms]": 1e3 * (ordered - truth["lie"]), "without force [mm]": 1e3 * distance}
        if distance > usual + speed * SETTINGS.max_force_gap:
            wrong.append(f"{1e3 * distance:.2f} mm without usable force")
    if plan["sensor"] in HIDING:
        most, reached = hidden_force(plan), max(STIFFNESS * depth for _, depth in track)
        figures["force over the bound"] = reached / most
        if reached > most + STIFFNESS * usual:
            wrong.append(f"{reached:.2f} N, at most {most:.2f} N before the stop")
    return wrong, figures


def hidden_force(plan: dict) -> float:
    """The true force [N] at which the limit is reached, or the change seen, in the worst case."""
    limit, zero = plan["limit"], plan["zero"]
    if plan["sensor"] in FALLING:
        return limit / plan["scale"]
    return limit + zero if plan["sensor"] == "zero creeps" else min(limit + zero, 2.1 * limit + SETTINGS.steady)


def farthest(track: list, since: float) -> float:
    """The largest true distance [m] from where the needle was at a time."""
    depths = [depth for now, depth in track if now >= since]
    return max((abs(depth - depths[0]) for depth in depths), default=0.0)


def rest(result: dict, own: float, after_mm: float) -> list[str]:
    """Whether the report of the stop is true, where depth or force can show it."""
    plan, truth, outcome = result["plan"], result["truth"], result["outcome"]
    honest = plan["words"] not in BLIND or truth["lie"] == float("inf")
    stopped = after_mm <= 1e3 * (stop_distance(LIMITS, SPEED) + own * SPEED)
    allowed = stop_distance(LIMITS, SPEED) + 1.05 * SPEED / plan["rate"]  # from the depth reported last
    if outcome.rest_confirmed and honest and not stopped and after_mm > 1e3 * allowed:
        return [f"rest confirmed, {after_mm:.2f} mm after the order"]
    if outcome.rest_confirmed and truth["moves_at_end"] and plan["sensor"] not in UNUSABLE:
        return ["rest confirmed while the needle moves and its force rises"]
    honest &= plan["sensor"] not in CREEPING
    if not outcome.rest_confirmed and stopped and honest and plan["deed"] == "obeys" and own < 0.1:
        return [f"rest not confirmed although it stopped: {outcome.detail}"]
    return []


def reason(result: dict, own: float) -> list[str]:
    """Whether the reason of the end is one that the plan explains."""
    plan, truth, ended = result["plan"], result["truth"], str(result["outcome"].ended)
    lies, returned = truth["lie"] < float("inf"), abs(truth["track"][-1][1] - START) < 1e-3
    force = STIFFNESS * max(depth for _, depth in truth["track"])
    axis_lies = (plan["words"], plan["deed"]) != ("honest", "obeys")
    explained = {
        "done": not lies or returned or plan["words"] in BLIND,
        "force limit": force > plan["limit"] - 5.0 * NOISE
        or plan["sensor"] in ("saturated", "wrong sizes", "zero falls", "zero creeps", "noise grows"),
        "recorder delayed": own > 0.1,
        "axis did not stop": axis_lies or own > 0.1,
        "depth late": plan["words"] in ("depth late", "late states"),
    }
    if plan["words"] == "depth late" and plan["late"] > SURE_LATE and ended == "done" and returned:
        if plan["deed"] == "obeys" and plan["sensor"] in CLEAR and plan["begins"] < DEPTH - 1e-3:
            return ["a late depth is not named"]
    sensor_lies = plan["sensor"] != "honest" or plan["words"] == "depth reversed"  # then the tissue pulls the wrong way
    default = own > 0.2 or (lies and (sensor_lies if ended.startswith("sensor") else axis_lies))
    return [] if explained.get(ended, default) else [f"ended {ended!r}: {result['outcome'].detail}"]


def work(seeds: list[int], simulated: bool, results) -> None:
    """One recorder and its rig, for many runs."""
    rig = RigInThread() if simulated else RigInProcess()
    with tempfile.TemporaryDirectory() as folder:
        for seed in seeds:
            with SimulatedClock() if simulated else contextlib.nullcontext():
                result = one(seed, Path(folder), rig)
            wrong, figures = judged(result)
            memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
            outcome = result["outcome"]
            ended = str(outcome.ended) if outcome else "refused"
            results.put((seed, result["plan"], ended, wrong, figures, memory))
    results.put(None)


def main() -> int:
    """Run, and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=10_000)
    parser.add_argument("--jobs", type=int, default=6)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--simulated", action="store_true")
    options = parser.parse_args()
    results = multiprocessing.Queue()
    seeds = range(options.first_seed, options.first_seed + options.runs)
    shares = [(seeds[k :: options.jobs], options.simulated, results) for k in range(options.jobs)]
    jobs = [multiprocessing.Process(target=work, args=share) for share in shares]
    for job in jobs:
        job.start()
    table, ends, violations, memory, left, done = {}, collections.Counter(), 0, {}, len(jobs), 0
    while left:
        got = results.get()
        if got is None:
            left -= 1
            continue
        seed, plan, ended, wrong, figures, used = got
        done += 1
        ends[ended] += 1
        memory.setdefault("first", used)
        memory["last"] = max(memory.get("last", 0.0), used)
        for kind in ("deed", "words", "sensor"):
            for name, value in figures.items():
                table.setdefault((kind, plan[kind]), {}).setdefault(name, []).append(value)
        if wrong:
            violations += 1
            print(f"seed {seed}: {plan}: {ended}: {'; '.join(wrong)}", flush=True)
        if done % 200 == 0:
            print(f"{done} of {options.runs} runs, {violations} violated", file=sys.stderr, flush=True)
    print_tables(table, ends)
    print(f"{done} runs, {violations} violated; memory of a recorder {memory['first']:.0f} to {memory['last']:.0f} MB")
    return 1 if violations else 0


def print_tables(table: dict, ends: collections.Counter) -> None:
    """Median and worst of each figure, by lie; and how often each reason ended a run."""
    print("| lie | " + " | ".join(FIGURES) + " |\n|" + "---|" * (len(FIGURES) + 1))
    for (kind, name), figures in sorted(table.items()):
        cells = []
        for each in FIGURES:
            values = sorted(figures.get(each, []))
            cells.append(f"{values[len(values) // 2]:.2f} ({values[-1]:.2f})" if values else "")
        print(f"| {kind}: {name} | " + " | ".join(cells) + " |")
    print(", ".join(f"{name}: {count}" for name, count in ends.most_common()))


if __name__ == "__main__":
    sys.exit(main())
