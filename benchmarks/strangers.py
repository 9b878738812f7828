# SPDX-License-Identifier: Apache-2.0
"""Trial of strangers: identification on generated recordings that it was not written for, judged by their truth.

The generator, with its own physics, and the judge are in ``tests/identification``;
``docs/evidence/trial_of_strangers.md`` says what counts as wrong.
Example: ``python benchmarks/strangers.py --runs 2000 --worst 20``."""

import argparse
import json
import os
import sys
import time
from collections import Counter, defaultdict
from dataclasses import asdict
from multiprocessing import Pool
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
import numpy as np
from rich.progress import track

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "identification"))
from stranger_faults import REPEATED, SCENARIOS  # noqa: E402
from strangers_judge import (  # noqa: E402
    PARAMETERS,
    VERDICTS,
    WORDS,
    Verdict,
    causes_named,
    declined_shares,
    share,
    trial,
    wrong_share,
)

HEAD = "shares in %; covered: truth in the 95 % interval, of those with a value; vague: of these, too wide to be of use"


def timed(task: tuple[int, str | None, dict]) -> Verdict:
    """The verdict of a seed with the time that it took."""
    started = time.perf_counter()
    seed, scenario, options = task
    verdict = trial(seed, scenario, **options)
    verdict.seconds = time.perf_counter() - started
    return verdict


def row(label: str, verdicts: list[Verdict], name: str | None = None) -> str:
    """One line: the share of each verdict and the strict coverage."""
    counts = share(verdicts, name)
    total = max(sum(counts.values()), 1)
    covered = [c for v in verdicts for key, c in v.covered.items() if name in (None, key)]
    too_wide = sum(name in (None, key) for v in verdicts for key in v.vague)
    cells = "".join(f"{100 * counts[v] / total:9.1f}" for v in VERDICTS)
    shares = [100 * np.mean(covered), 100 * too_wide / len(covered)] if covered else [np.nan] * 2
    return f"{label:24}{total:6d}{cells}{shares[0]:9.1f}{shares[1]:7.1f}"


def header(title: str) -> str:
    return f"\n{title:24}{'n':>6}" + "".join(f"{v:>9}" for v in VERDICTS) + f"{'covered':>9}{'vague':>7}"


def by_parameter(verdicts: list[Verdict]) -> list[str]:
    return [header("parameter"), *(row(name, verdicts, name) for name in PARAMETERS), row("all", verdicts)]


def by_group(title: str, groups: dict[str, list[Verdict]]) -> list[str]:
    """The table over groups of recordings, with their punctures; the most wrong first."""
    ordered = sorted(groups.items(), key=lambda item: -wrong_share(item[1]))
    return [header(title) + "   punctures: false missed of"] + [
        row(name, group) + f"{sum(v.false_punctures for v in group):18d}{sum(v.missed_punctures for v in group):7d}"
        f"{sum(v.true_punctures for v in group):4d}"
        for name, group in ordered
    ]


def groups_of(verdicts: list[Verdict]) -> tuple[dict, dict]:
    """By scenario, and those of the scenario ``anything`` by fault."""
    scenarios, faults = defaultdict(list), defaultdict(list)
    for v in verdicts:
        scenarios[v.scenario].append(v)
        if v.scenario == "anything":
            for fault in v.faults or ("none",):
                faults[fault].append(v)
    return scenarios, faults


def naming(verdicts: list[Verdict]) -> list[str]:
    """How often the words for a fault occur where it is present and where it is not: a warning must tell them apart."""
    lines = [f"\n{'words of the fault':24}{'present':>9}{'named %':>9}{'elsewhere %':>13}"]
    for fault in WORDS:
        named = {True: [], False: []}
        for v in verdicts:
            named[fault in v.faults].append(bool(causes_named((fault,), v.messages)))
        if named[True]:
            shares = (100 * np.mean(named[True]), 100 * np.mean(named[False] or [0]))
            lines.append(f"{fault:24}{len(named[True]):9d}{shares[0]:9.0f}{shares[1]:13.0f}")
    return lines


def badness(verdict: Verdict) -> tuple:
    return len(verdict.wrong), verdict.false_punctures + verdict.missed_punctures


def worst(verdicts: list[Verdict], n: int) -> list[str]:
    """The recordings with the largest number of wrong parameters, with their values."""
    lines = ["\nworst: seed, scenario, faults, status, wrong parameters [SI] with interval and truth"]
    for v in sorted(verdicts, key=badness, reverse=True)[:n]:
        if badness(v) == (0, 0):
            break
        punctures = f"punctures +{v.false_punctures} -{v.missed_punctures}"
        lines.append(f"{v.seed:6d} {v.scenario} {', '.join(v.faults)} [{v.status}] {punctures} {v.crash}")
        for name in v.wrong:
            value, low, high, truth = v.details[name]
            true = "does not exist" if truth is None else " to ".join(f"{t:.5g}" for t in dict.fromkeys(truth))
            lines.append(f"         {name} {value:.5g} [{low:.5g}, {high:.5g}], true {true}")
    return lines


def summary(verdicts: list[Verdict]) -> list[str]:
    """The bar, punctures, status values and time."""
    found = [sum(getattr(v, f"{kind}_punctures") for v in verdicts) for kind in ("false", "missed", "true")]
    seconds = np.array([v.seconds for v in verdicts])
    with_wrong = 100 * np.mean([bool(v.wrong) for v in verdicts])
    return [
        f"\nwrong and not warned of: {100 * wrong_share(verdicts):.2f} % of parameters (bar: 1 %)",
        f"recordings with such a parameter: {with_wrong:.1f} %",
        "declined: {:.1%} of parameters, {:.1%} of those that exist".format(*declined_shares(verdicts)),
        f"punctures: {found[0]} false, {found[1]} missed of {found[2]}",
        f"intervals that do not hold their own value: {sum(v.malformed for v in verdicts)}",
        f"status: {dict(Counter(v.status for v in verdicts).most_common())}",
        f"crashes: {[(v.seed, v.crash) for v in verdicts if v.crash]}",
        f"warnings of NumPy that reach the user: {[v.seed for v in verdicts if v.numeric]}",
        f"time of a recording, with its generation: median {np.median(seconds):.2f} s, largest {seconds.max():.1f} s",
    ]


def of_repeats(conditions: dict[int, list[Verdict]]) -> list[str]:
    """The table over the number of repeats, with the median half width of the intervals in practical tolerances."""
    lines = [header("repeats, all parameters")]
    lines += [row(f"n = {n}", verdicts) for n, verdicts in conditions.items()]
    lines += [f"\n{'median half width / tolerance':32}" + "".join(f"{f'n = {n}':>9}" for n in conditions)]
    for name in PARAMETERS:
        widths = [[v.widths[name] for v in verdicts if name in v.widths] for verdicts in conditions.values()]
        lines.append(f"{name:32}" + "".join(f"{np.median(each) if each else np.nan:9.3f}" for each in widths))
    for n, verdicts in conditions.items():
        groups = defaultdict(list)
        for v in verdicts:
            groups[v.scenario].append(v)
        lines += [*by_group(f"shared error, n = {n}", groups), *worst(verdicts, 10)]
    return lines


def run(tasks: list[tuple], processes: int) -> list[Verdict]:
    """The verdicts in the order of the tasks, with progress."""
    with Pool(processes) as pool:
        return list(track(pool.imap(timed, tasks, chunksize=4), total=len(tasks), description="recordings"))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=2000)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--scenario", choices=["anything", *SCENARIOS, *REPEATED])
    parser.add_argument("--repeats", type=int, nargs="+", metavar="N", help="conditions of N repeats instead")
    parser.add_argument("--model", help="a model of identify, instead of the default")
    parser.add_argument("--worst", type=int, default=20, metavar="N", help="list the N worst recordings")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument(
        "--json", type=Path, metavar="FILE", help="write every verdict, to compare two states of the code"
    )
    given = parser.parse_args()
    options = {"model": given.model} if given.model else {}
    seeds = range(given.first_seed, given.first_seed + given.runs)
    if given.repeats:
        named = [given.scenario] if given.scenario else list(REPEATED)
        made = [(seed, named[seed % len(named)]) for seed in seeds]
        conditions = {n: run([(*each, options | {"n": n}) for each in made], given.processes) for n in given.repeats}
        print("\n".join([HEAD, *of_repeats(conditions)]))
        return
    verdicts = run([(seed, given.scenario, options) for seed in seeds], given.processes)
    scenarios, faults = groups_of(verdicts)
    print("\n".join([HEAD, *by_parameter(verdicts), *by_group("scenario", scenarios)]))
    print(
        "\n".join(
            [
                *by_group("fault, in anything", faults),
                *naming(verdicts),
                *worst(verdicts, given.worst),
                *summary(verdicts),
            ]
        )
    )
    if given.json:
        given.json.write_text(json.dumps([asdict(v) for v in verdicts], default=float))


if __name__ == "__main__":
    main()
