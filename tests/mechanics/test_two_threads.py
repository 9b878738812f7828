# SPDX-License-Identifier: Apache-2.0
"""An engine that runs in one thread refuses every call of a second one, and its run is not disturbed by it."""

import subprocess
import sys
import threading

import numpy as np
import pytest

import needleforce as nf
from needleforce import core, fe

PAPER = nf.preset("paper")
MOTION = 20e-3 * np.abs(np.sin(np.linspace(0.0, 6.0, 500)))


def rigid():
    return nf.Insertion(PAPER), 2000, lambda depth: (depth, None, np.full(len(depth), 1e-3))


def flexible(**kind):
    engine = nf.FlexibleInsertion(PAPER, PAPER.needle, lateral=5e4, **kind)._core
    return (
        engine,
        40,
        lambda depth: (
            depth,
            np.zeros((len(depth), 2)),
            np.zeros((len(depth), 2)),
            np.zeros(len(depth)),
            np.full(len(depth), 1e-3),
        ),
    )


def solid():
    nodes = np.arange(40)
    compliance = 1e-3 * np.exp(-0.3 * np.abs(nodes[:, None] - nodes))
    engine = fe.CondensedInsertion(fe.CondensedTissue(1e-3, compliance), PAPER)
    return engine, 100, lambda depth: (depth, np.full(len(depth), 1e-3))


def calls(engine):
    """What a second thread may try, by name."""
    base = (0.01, (0.0, 0.0), (0.0, 0.0), 0.0) if hasattr(engine, "path") else (0.01, None)
    saved = engine.save()
    given = {
        "step": lambda: engine.step(*base, 1e-3),
        "forces": lambda: engine.forces(MOTION, MOTION),
        "restore": lambda: engine.restore(saved),
    }
    kind = next(kind for kind in type(engine).__mro__ if kind.__module__ == core.__name__)
    for name in sorted(set(vars(kind)) - {"run"}):
        if not name.startswith("_"):
            yield name, given.get(name, lambda name=name: call_or_value(engine, name))


def call_or_value(engine, name):
    value = getattr(engine, name)
    return value() if callable(value) else value


def is_refused(call) -> bool:
    try:
        call()
    except nf.InputError as error:
        assert "another thread" in str(error)
        return True
    return False


def refused_while_it_runs(engine, series, tried):
    """The names of those that were refused while the engine ran, and what it returned. On a busy computer a run may
    end before all were tried: then it runs again."""
    refused, found = set(), {}
    for _ in range(50):
        engine.reset()
        runs = threading.Thread(target=lambda: found.update(engine.run(*series)))
        runs.start()
        while runs.is_alive() and not is_refused(engine.save):
            pass
        refused |= {name for name, call in tried.items() if is_refused(call)}
        runs.join()
        if refused == set(tried):
            break
    return refused, found


@pytest.mark.parametrize(
    "make",
    [rigid, solid, lambda: flexible(planar=True), flexible],
    ids=["rigid", "solid", "bends in a plane", "bends in space"],
)
def test_second_thread_is_refused_while_an_engine_runs(make):
    engine, repeats, inputs = make()
    series = inputs(np.tile(MOTION, repeats))
    alone = make()[0].run(*series)
    tried = dict(calls(engine))
    refused, found = refused_while_it_runs(engine, series, tried)
    assert refused == set(tried)
    for name, values in alone.items():
        np.testing.assert_array_equal(found[name], values)
    assert not is_refused(engine.reset)


def test_what_uses_an_engine_that_runs_is_refused():
    engine, repeats, inputs = rigid()
    guard, other = core.Guard(engine, core.GuardSettings()), nf.Insertion(PAPER)
    support = core.Support(needle_length=0.2)
    straight = [core.LateralLayer(modulus=5e4)], [(1.0, 1e-3, 0.0)], support, core.Bending(), 40, False
    tried = {
        "guard.step": lambda: guard.step(0.0, None, 1e-3),
        "guard.miss": lambda: guard.miss(1e-3),
        "guard.reset": guard.reset,
        "restore": lambda: other.restore(engine),
        "bends": lambda: core.PlanarInsertion(engine, *straight),
    }
    refused, _ = refused_while_it_runs(engine, inputs(np.tile(MOTION, repeats)), tried)
    assert refused == set(tried)
    assert not is_refused(tried["guard.step"])


def test_guard_of_a_needle_that_runs_is_refused():
    engine, repeats, inputs = flexible()
    guard = core.BaseGuard(engine, core.GuardSettings())
    tried = {
        "step": lambda: guard.step(0.0, (0.0, 0.0), (0.0, 0.0), 0.0, 1e-3),
        "miss": lambda: guard.miss(1e-3),
        "reset": guard.reset,
    }
    refused, _ = refused_while_it_runs(engine, inputs(np.tile(MOTION, repeats)), tried)
    assert refused == set(tried)


def test_python_without_the_interpreters_lock_is_refused_by_name():
    flags = "type('Flags', (), {'gil': 0, '__getattr__': lambda self, name, flags=sys.flags: getattr(flags, name)})()"
    program = f"import sys; sys.flags = {flags}; import needleforce.core"
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert ended.returncode == 1
    assert "ImportError" in ended.stderr and "PYTHON_GIL=0" in ended.stderr
