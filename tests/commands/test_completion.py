# SPDX-License-Identifier: Apache-2.0
"""What a shell is given to complete, by the interface that the installed script calls."""

import pytest
from typer.testing import CliRunner

from needleforce.cli import app


def completed(typed, monkeypatch):
    """The completions of the last word, which may be empty."""
    words = typed.split(" ")
    monkeypatch.setenv("_NEEDLEFORCE_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", typed)
    monkeypatch.setenv("COMP_CWORD", str(len(words) - 1))
    return CliRunner().invoke(app, [], prog_name="needleforce").stdout.split()


@pytest.mark.parametrize(
    "typed, among, never",
    [
        ("needleforce sim", {"simulate"}, {"identify"}),
        ("needleforce simulate --preset pap", {"paper", "paper_116"}, {"maurin"}),
        ("needleforce identify run.csv --needle ", {"paper", "my_needle.toml", "needles/"}, {"run.csv"}),
        ("needleforce identify run.csv --needle my", {"my_needle.toml"}, {"paper"}),
        ("needleforce bending run.csv --needle pap", {"paper", "paper_116"}, {"my_needle.toml"}),
        ("needleforce identify run.csv --as ", {"instron", "my_needle.toml", "needles/"}, {"paper", "run.csv"}),
        ("needleforce run.csv --model gradual", {"gradual_cone", "gradual_layers"}, {"paper"}),
        ("needleforce compare run.csv --models paper,cone", {"paper,cone_cylinder"}, {"paper,paper"}),
        ("needleforce identify run.csv --column ", {"time=t", "depth=2", "force=F_x"}, {"2"}),
        ("needleforce run.csv --column force=", {"force=F_x", "force=2"}, {"time=t"}),
        ("needleforce inspect run.csv --column d", {"depth=t", "depth=2"}, {"force=2"}),
        ("needleforce identify none.csv --column d", set(), {"depth=2"}),
        ("needleforce identify run.csv --col", {"--column"}, {"--unit"}),
    ],
)
def test_presets_models_needles_and_columns_are_completed(typed, among, never, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "needles").mkdir()
    (tmp_path / "my_needle.toml").write_text("")
    (tmp_path / "run.csv").write_text("t,way of tip [mm],F_x\n" + "".join(f"{k},{k},{k}\n" for k in range(9)))
    found = set(completed(typed, monkeypatch))
    assert among <= found and not never & found, found
