# SPDX-License-Identifier: Apache-2.0
"""The functions for Octave and MATLAB, in Octave: built from an installed C library, a model of a fit, errors. The
conformance set is in tests/mechanics/test_conformance.py."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from building import said

import needleforce as nf

pytestmark = pytest.mark.skipif(not shutil.which("mkoctfile"), reason="no Octave: sudo tools/system_packages.sh hosts")

REFUSED = {  # a line that fails: part of its message
    "nf_insertion('create')": "layers are missing",
    "nf_insertion('create', layers(ones(1, 9)))": "layers count (9) is outside its range: 1 to 8",
    "nf_insertion('create', changed('stiffness', 'cone'))": "stiffness is not a struct",
    "nf_insertion('create', changed('friction', struct('name', 'glue')))": "glue friction (0) is of no known name",
    "nf_insertion('create', changed('friction', drag(-1)))": "per_length (-1) is outside its range: 0 to 100000",
    "nf_insertion('create', changed('friction', drag('x')))": "per_length is not a real number",
    "nf_insertion('create', layers, struct('max_sped', 1))": "max_sped is no setting",
    "nf_insertion('run', 77, 0, 1e-3)": "handle is of no insertion",
    "nf_insertion('run', h, zeros(3, 1))": "depth or dt is missing",
    "nf_insertion('run', h, zeros(3, 1), [1 2])": "another length than depth",
    "nf_insertion('run', h, {1}, 1e-3)": "is not of real doubles",
    "nf_insertion('step', h, [1 2], 1e-3)": "a step has one depth, not 2",
    "nf_insertion('prod', h)": "is none of create, run",
    "nf_model('nowhere.json')": "nowhere.json",
    "nf_identify('nowhere.csv')": "nowhere.csv",
    "nf_build('nowhere')": "nowhere has no include/needleforce.h",
}
PROGRAM = """
fit = nf_identify('RECORDING', 'needle', 'paper');
layers = fit.layers;
h = nf_insertion('create', layers);
depth = linspace(0, 8e-3, 2001);
s = nf_insertion('run', h, depth, 1e-3);
again = nf_insertion('restore', h, nf_insertion('snapshot', h));
nf_insertion('reset', h);
for i = 1:numel(depth)
  one = nf_insertion('step', h, depth(i), 1e-3);
end
bad = nf_insertion('step', h, NaN, 1e-3);
nf_insertion('delete', nf_insertion('create', nf_model('paper')));
changed = @(name, value) setfield(layers, name, value);
drag = @(value) struct('name', 'coulomb', 'per_length', value);
messages = {};
for line = {LINES}
  try
    eval([line{1} ';']);
    messages{end + 1} = '';
  catch refused
    messages{end + 1} = refused.message;
  end
end
bad = [bad.force bad.status];
printf('%s\\n', jsonencode(struct('force', s.force, 'last', one.force, 'again', again, 'bad', bad, 'friction', ...
  layers.friction.per_length, 'help', numel(help('nf_insertion')))), jsonencode(messages));
"""
OCTAVE = ["octave-cli", "--quiet", "--norc", "--no-history"]


def octave(folder: Path, program: str) -> str:
    """What a program prints, with the functions in a folder and this installation's command."""
    command = os.environ | {"NEEDLEFORCE": str(Path(sys.executable).with_name("needleforce"))}
    (folder / "program.m").write_text(f"addpath('{folder}');\n{program}", encoding="utf-8")
    return said([*OCTAVE, folder / "program.m"], env=command, cwd=folder)


def functions(root, folder) -> Path:
    """A copy without a gateway, which someone may have compiled there."""
    without = shutil.ignore_patterns("*.mex*")
    return shutil.copytree(root / "integrations" / "octave", folder / "functions", ignore=without)


@pytest.fixture(scope="module")
def folder(root, prefix, tmp_path_factory):
    """The functions where ``nf_build`` compiled the gateway."""
    folder = functions(root, tmp_path_factory.mktemp("octave"))
    octave(folder, f"nf_build('{prefix}')")
    return folder


@pytest.fixture(scope="module")
def output(root, folder):
    lines = ", ".join(f'"{line}"' for line in REFUSED)
    recording = str(root / "examples" / "insertion.csv")
    text = octave(folder, PROGRAM.replace("RECORDING", recording).replace("LINES", lines))
    numbers, messages = map(json.loads, text.splitlines()[-2:])
    return numbers, dict(zip(REFUSED, messages, strict=True))


def test_a_fit_goes_into_an_insertion(root, output):
    numbers, _ = output
    fit = nf.identify(nf.read(root / "examples" / "insertion.csv"), needle="paper")
    insertion = nf.Insertion(fit.model)
    expected = [insertion.step(depth, None, 1e-3).force for depth in np.linspace(0, 8e-3, 2001)]
    assert numbers["friction"] == fit.model.friction.per_length
    assert np.abs(np.array(numbers["force"]) - expected).max() <= 1e-9 * max(expected)
    assert numbers["last"] == numbers["force"][-1] and numbers["again"] is True
    assert numbers["bad"] == [0, 3] and numbers["help"] > 1000


@pytest.mark.parametrize("line", REFUSED)
def test_what_is_refused_is_named(output, line):
    assert REFUSED[line] in output[1][line]


def test_a_gateway_that_is_not_compiled_and_a_command_that_is_missing_are_named(root, tmp_path):
    program = f"addpath('{functions(root, tmp_path)}'); setenv('NEEDLEFORCE', 'no_such_command');"
    for line, expected in {"nf_insertion('run')": "nf_build(", "nf_model('paper')": "pip install needleforce"}.items():
        done = subprocess.run([*OCTAVE, "--eval", f"{program} {line}"], capture_output=True, text=True)
        assert done.returncode == 1 and expected in done.stderr
