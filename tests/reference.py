# SPDX-License-Identifier: Apache-2.0
"""Reference values through the public names: ``python tests/reference.py FILE`` prints name, expected, got, pass."""

import json
import sys
from pathlib import Path

import numpy as np
import reference_bench_rules  # noqa: F401 - importing them adds their rules
import reference_bending_rules  # noqa: F401
import reference_law_rules  # noqa: F401
from reference_rules import RULES, Given

FILE = Path(__file__).with_name("reference_values.json")


def mapped(entry):
    """The rule that computes an entry, or None."""
    for group, formula, inputs, function in RULES:
        if entry["group"] == group and formula.search(entry["formula"]) and inputs <= set(entry["inputs"]):
            return function
    return None


def resolved(entry, entries):
    """An entry's inputs with those that name another entry replaced by its value."""
    values = {each["name"]: each["expected"] for each in entries}
    inputs = {key: values.get(v, v) if isinstance(v, str) else v for key, v in entry["inputs"].items()}
    return Given(inputs | {"formula": entry["formula"]})


def evaluate(entry, entries):
    """(got, passed), or (None, None) where nothing maps it."""
    function = mapped(entry)
    if function is None:
        return None, None
    got = function(resolved(entry, entries))
    return got, bool(np.allclose(got, entry["expected"], rtol=entry["rel_tol"], atol=0.0))


def load(path=FILE):
    """The entries of a file of reference values."""
    return json.loads(Path(path).read_text(encoding="utf-8"))["oracles"]


def main(path) -> int:
    """Prints one line for each entry and returns the number that failed."""
    entries, counts = load(path), {"pass": 0, "FAIL": 0, "no mapping": 0}
    for entry in entries:
        got, passed = evaluate(entry, entries)
        verdict = {None: "no mapping", True: "pass", False: "FAIL"}[passed]
        counts[verdict] += 1
        shown = "" if got is None else np.array2string(np.asarray(got), precision=15)
        print(f"{entry['name']:44s} {entry['expected']!s:26.26s} {shown:26.26s} {verdict}")
    print(", ".join(f"{count} {verdict}" for verdict, count in counts.items()))
    return counts["FAIL"]


if __name__ == "__main__":
    sys.exit(min(main(sys.argv[1] if len(sys.argv) > 1 else FILE), 1))
