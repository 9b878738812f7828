# SPDX-License-Identifier: Apache-2.0
"""The force converges with the step as each law states, wherever surfaces, punctures and turns fall in a step."""

import itertools
import random
import sys
from pathlib import Path

import pytest

import needleforce as nf
from needleforce.errors import InputError
from needleforce.models.laws import laws_of

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmarks"))
import convergence

MODELS = convergence.models()
SMALL = 1e-5  # of the largest force: single samples decide whether the tip counts as withdrawing


def converges(measured) -> None:
    if measured.states_exact:
        assert measured.exact, measured.errors
    else:  # five halvings are a factor of 32
        assert measured.errors[-1] < max(SMALL, measured.errors[0] / 8.0), measured.errors


@pytest.mark.parametrize("name", MODELS)
def test_a_model_converges_as_its_laws_state(name):
    converges(convergence.converges(name, MODELS[name], 6))


@pytest.mark.parametrize("friction", laws_of("friction"), ids=lambda law: law.name)
def test_laws_converge_together(friction, many):
    combined, together = 0, list(itertools.product(*map(laws_of, ("puncture", "cutting", "relaxation"))))
    for parts in random.Random(friction.name).sample(together, len(together)):
        laws = {law.family: convergence.example(law).law for law in (friction, *parts)}
        try:
            model = nf.preset("paper").replace(**laws)
        except InputError:
            continue  # laws that exclude each other
        converges(convergence.converges(str(laws), model, 6, (0.29,)))
        combined += 1
        if combined == many(4, len(together)):
            break
    assert combined >= 3


def test_the_page_has_every_model():
    page = convergence.PAGE.read_text(encoding="utf-8")
    rows = [line.split(" | ")[0].removeprefix("| ") for line in page.partition(convergence.HEAD)[2].splitlines()]
    assert sorted(name for row in rows for name in row.split(", ")) == sorted(MODELS)


def test_a_force_that_does_not_converge_is_found():
    measured = convergence.converges("paper", MODELS["preset `paper`"], 6)
    wrong = convergence.Convergence("wrong", False, measured.steps, 1e-3 + 0.0 * measured.errors)
    with pytest.raises(AssertionError):
        converges(wrong)
