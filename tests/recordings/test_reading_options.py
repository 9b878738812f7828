"""A reading option stands in one place: what follows from the table of options, shown with a new row in a copy."""

import inspect
import re
import shutil
import subprocess
import sys
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

import needleforce as nf
from needleforce.campaign import campaign
from needleforce.campaign.campaign import CampaignOptions
from needleforce.recording.look import option_words
from needleforce.recording.mappings import completed, save_mapping
from needleforce.recording.options import ReadOptions, flags

PACKAGE = Path(nf.__file__).parent
READING = ("identify", "compare", "campaign", "inspect", "convert", "indentation", "penetration")
# as a user of the release before this table wrote them: name -> (flag, value in its unit, value in SI)
GIVEN = {
    "columns": ("--column", "force=2", {"force": "2"}), "units": ("--unit", "force=mN", {"force": "mN"}),
    "inwards": ("--depth-inwards", "decreasing", "decreasing"), "part": ("--part", "B3", "B3"),
    "motion_part": ("--motion-part", "Axis", "Axis"), "rate": ("--rate-hz", "250", 250.0),
    "speed": ("--speed-mm-s", "2", 2e-3), "step": ("--step-um", "64", 64e-6), "stroke": ("--stroke-mm", "15", 15e-3),
    "hold": ("--hold-s", "3", 3.0), "motion_shift": ("--motion-shift-s", "1.35", 1.35),
    "segment": ("--segment", "step=2", {"step": "2"}),
    "first_row": ("--first-row", "5", 5), "filter_length": ("--filter-length", "4", 4),
    "decimate_to": ("--decimate-to-hz", "100", 100.0),
    "mapping": ("--as", "rig", "rig"), "motion": ("--motion", "axis.csv", "axis.csv"),
    "start_depth": ("--start-depth-mm", "-2.5", -2.5e-3),
}  # fmt: skip
NEW_ROW = """    gauge: Annotated[
        float | None,
        Flag("--gauge-mm", "Length of the gauge.", float, 1e-3),
    ] = None

    def of_every_file("""
NEW_WORDS = '''    gauge : float, optional
        Length of the gauge [m].
    """

    columns: Annotated['''
IN_COPY = """
import inspect, sys
from dataclasses import replace
from pathlib import Path
sys.meta_path = [each for each in sys.meta_path if "needleforce" not in str(getattr(each, "known_packages", ""))]
sys.path.insert(0, sys.argv[1])
import needleforce as nf
from needleforce.campaign import campaign
from needleforce.cli import app
from needleforce.recording.mappings import load_mapping, save_mapping
from typer.testing import CliRunner
assert Path(nf.__file__).is_relative_to(sys.argv[1])
for function in (nf.read, nf.read_all, campaign):
    assert "gauge" in inspect.signature(function).parameters and "Length of the gauge [m]." in function.__doc__
for command in COMMANDS:
    assert "--gauge-mm" in CliRunner().invoke(app, [command, "--help"], env={"COLUMNS": "200"}).output, command
folder = Path(sys.argv[2])
shown = nf.read(folder / "run.csv", gauge=0.0025, dry_run=True)
assert shown.options.gauge == 0.0025 and shown.command.endswith("--gauge-mm 2.5"), shown.command
kept = folder / "needleforce.toml"
words = ["inspect", str(folder / "run.csv"), "--gauge-mm", "2.5", "--save", str(kept)]
assert CliRunner().invoke(app, words).exit_code == 0 and load_mapping(kept).gauge_mm == 2.5
assert nf.read(folder / "run.csv", dry_run=True).options.gauge == 0.0025
assert campaign(folder, gauge=0.0025).recordings
"""


@pytest.fixture
def run_file(tmp_path):
    time = np.arange(0.0, 10.0, 0.02)
    depth = 10.0 - 2.0 * np.abs(time - 5.0)
    rows = np.column_stack([time, depth - 2.0, 0.05 * np.clip(depth - 2.0, 0.0, None)])
    folder = tmp_path / "runs"
    folder.mkdir()
    np.savetxt(folder / "run.csv", rows, delimiter=",", header="time_s,depth_mm,force_N", comments="")
    return folder / "run.csv"


def test_a_new_option_is_a_row(tmp_path, run_file):
    """With its words, in one file; keywords, documentation, flags, mapping files and the printed command follow."""
    package = shutil.copytree(PACKAGE, tmp_path / "copy" / "needleforce", ignore=shutil.ignore_patterns("__pycache__"))
    options = package / "recording" / "options.py"
    text = options.read_text(encoding="utf-8")
    for place, more in (("\n    def of_every_file(", NEW_ROW), ('    """\n\n    columns: Annotated[', NEW_WORDS)):
        assert text.count(place) == 1
        text = text.replace(place, more)
    options.write_text(text, encoding="utf-8")
    code = IN_COPY.replace("COMMANDS", repr(READING))
    words = [sys.executable, "-B", "-c", code, str(package.parent), str(run_file.parent)]
    done = subprocess.run(words, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    "function, options", [(nf.read, ReadOptions), (nf.read_all, ReadOptions), (campaign, CampaignOptions)]
)
def test_every_keyword_is_documented(function, options):
    """In the order of the rows, which is that of the signature."""
    names = [each.name for each in fields(options)]
    parameters = inspect.getdoc(function).split("----------\n")[1].split("Returns\n")[0]
    documented = re.findall(r"^(\w[\w, ]*) : ", parameters, re.MULTILINE)
    assert [name for entry in documented for name in entry.split(", ")][1:] == names
    assert list(inspect.signature(function).parameters)[1:] == names
    kinds = {each.kind for each in list(inspect.signature(function).parameters.values())[1:]}
    assert kinds == {inspect.Parameter.KEYWORD_ONLY}


def test_keywords_are_checked_as_those_of_any_function(run_file):
    for wrong in ({"speeds": 1.0}, {"path": run_file}):
        with pytest.raises(TypeError, match=next(iter(wrong))):
            nf.read(run_file, **wrong)
    with pytest.raises(TypeError):
        nf.read(run_file, "B3")
    assert len(nf.read(path=run_file)) == 500


def test_the_flags_with_their_units():
    assert {name: flag.word for name, flag in flags().items()} == {name: word for name, (word, _, _) in GIVEN.items()}
    options = ReadOptions(**{name: value for name, (_, _, value) in GIVEN.items()})
    assert option_words(options) == [word for flag, text, _ in GIVEN.values() for word in (flag, text)]


def test_what_a_mapping_keeps(tmp_path):
    """All but the names of files; values come back as they were."""
    given = {name: value for name, (_, _, value) in GIVEN.items()}
    path = save_mapping(ReadOptions(**given), str(tmp_path / "rig.toml"))
    kept = {**given, "mapping": None, "motion": None}
    found, sentence = completed(tmp_path / "run.csv", ReadOptions(mapping=path))
    assert found == ReadOptions(**kept) and "the mapping rig.toml: " in sentence and str(tmp_path) not in sentence
    for words in ('units.force = "mN"', "first_row = 5", "segment."):  # what it changed
        assert words in sentence
    of_user, less = completed(tmp_path / "run.csv", ReadOptions(mapping=path, speed=1.0, units={"depth": "um"}))
    assert of_user == replace(found, speed=1.0, units={"force": "mN", "depth": "um"})
    assert "units.depth" not in less and "units.force" in less


@pytest.mark.parametrize("line", ["gauge_mm = 2.5", "motion = 'axis.csv'", "speed = 2.0", "baseline = false"])
def test_a_mapping_with_an_option_that_does_not_exist_is_refused(run_file, line):
    (run_file.parent / "needleforce.toml").write_text(f"{line}\n")
    name = line.partition(" ")[0]
    with pytest.raises(
        nf.InputError, match=rf"needleforce.toml.*unknown field `{name}`|unknown field `{name}`.*needleforce.toml"
    ):
        nf.read(run_file)
