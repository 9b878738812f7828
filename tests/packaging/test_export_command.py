# SPDX-License-Identifier: Apache-2.0
"""`needleforce export`: from a fit, a preset file or a preset; and what it refuses."""

import json
import subprocess
import sys

import pytest
from command_line import run

import needleforce as nf
from needleforce.cli import main
from needleforce.export import header, identifier, model_source


@pytest.fixture(scope="module")
def fit(root):
    return nf.identify(nf.read(root / "examples" / "insertion.csv"), needle=nf.preset("paper").needle)


def export(*arguments):
    return run("export", *arguments)


def test_the_json_of_a_fit_holds_the_whole_model(fit, tmp_path):
    (tmp_path / "fit.json").write_text(fit.to_json())
    assert model_source(tmp_path / "fit.json").model == fit.model


def test_a_fit_and_the_preset_it_saves_export_the_same_numbers(fit, tmp_path):
    (tmp_path / "fit.json").write_text(fit.to_json())
    fit.save(tmp_path / "fit.toml")
    of_json, of_toml = (model_source(tmp_path / f"fit.{ending}") for ending in ("json", "toml"))
    assert header(of_json.model, "c", "fit") == header(of_toml.model, "c", "fit")
    assert of_json.sources[0] == f"Recording insertion.csv, ok, sha256 {fit.recordings[0].recording.card.sha256[:16]}"
    assert any(fit.warnings[0] in line for line in of_json.sources)


def test_the_command_prints_or_writes_the_header(tmp_path):
    code, text, _ = export("paper", "--name", "gel", "--language", "c")
    assert code == 0 and text == header(nf.preset("paper"), "c", "gel")
    code, printed, warned = export("paper", "-o", tmp_path / "gel.hpp")
    assert (code, printed) == (0, "") and "paper" in warned
    assert (tmp_path / "gel.hpp").read_text() == header(nf.preset("paper"), "c++", "paper")


def test_the_warnings_of_a_fit_are_told_beside_its_header(fit, tmp_path):
    (tmp_path / "fit.json").write_text(fit.to_json())
    code, text, warned = export(tmp_path / "fit.json")
    assert code == 0 and fit.warnings[0] in warned and "Warning: " in text


OLD = {"recordings": [], "parameters": [], "model": "paper"}


@pytest.mark.parametrize(
    "document, words",
    [
        (OLD, "did not save the complete model"),
        (OLD | {"model": None, "preset": None}, "without a model, no recording could be evaluated. See its notes"),
        (OLD | {"preset": {"name": "x"}}, "missing required field"),
        ([{"model": "paper", "bic": 1.0}], "file is not a fit"),
        ({"conditions": []}, "file is not a fit"),
        (OLD | {"recordings": [{"status": "ok"}]}, "file is not a fit"),
        (OLD | {"recordings": None}, "file is not a fit"),
    ],
)
def test_what_holds_no_model_is_refused_with_the_next_step(document, words, tmp_path, capsys, monkeypatch):
    path = tmp_path / "fit.json"
    path.write_text(json.dumps(document))
    monkeypatch.setattr(sys, "argv", ["needleforce", "export", str(path)])
    with pytest.raises(SystemExit) as stopped:
        main()
    warned = capsys.readouterr().err
    assert stopped.value.code == 2 and words in warned and "fit.json" in warned


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["nowhere.json"], "fit is missing"),
        (["nothing"], "unknown"),
        (["paper", "--language", "rust"], "Give one of c++, c, c#, json, fmu"),
        (["paper", "--name", ""], "not a valid name of a constant"),
        (["paper", "--name", "int"], "not a valid name of a constant"),
        (["paper", "-o", "nowhere/x.hpp"], "its folder does not exist"),
    ],
)
def test_wrong_usage_is_told_in_one_line(arguments, words):
    code, text, warned = export(*arguments)
    assert (code, text) == (2, "") and words in warned and warned.count("\n") == 1


def test_a_number_lost_in_the_json_is_told_with_its_place(fit, tmp_path):
    document = json.loads(fit.to_json())
    document["preset"]["friction"]["per_length_N_per_m"] = None
    (tmp_path / "fit.json").write_text(json.dumps(document))
    with pytest.raises(nf.InputError, match=r"fit.json: .*friction.*per_length"):
        model_source(tmp_path / "fit.json")
    (tmp_path / "fit.json").write_bytes(b"\xff\xfe{")
    with pytest.raises(nf.InputError, match="fit is not readable, not UTF-8"):
        model_source(tmp_path / "fit.json")


@pytest.mark.parametrize(
    "change",
    [
        {"warnings": 5},
        {"settings": None},
        {"settings": {"speed_m_s": "fast"}},
        {"recordings": [{"file": "a", "status": "ok", "sha256": 5}]},
    ],
)
def test_a_fit_that_was_altered_is_refused(change, fit, tmp_path):
    (tmp_path / "fit.json").write_text(json.dumps(json.loads(fit.to_json()) | change))
    with pytest.raises(nf.InputError, match=r"fit\.json: file is not a fit"):
        model_source(tmp_path / "fit.json")


def test_json_without_end_is_refused(tmp_path):
    (tmp_path / "fit.json").write_text("[" * 200_000)
    with pytest.raises(nf.InputError, match=r"fit\.json: fit is not JSON"):
        model_source(tmp_path / "fit.json")


RESERVED = (
    "linux unix size_t M_PI std std2 posix main int typeof class co_await requires _X __x a__b x_ errno assert stdin "
    "sin sinf index y1 EOF NAN I PRId64 INFINITY LIVER offsetof va_list off64_t nf_model min near bool true import "
    "final"
).split()


@pytest.mark.parametrize("name", [*RESERVED, "1x", "x-y", "\u00e4", "x" * 64, "a b"])
def test_a_name_that_does_not_compile_everywhere_is_refused(name):
    with pytest.raises(nf.InputError, match="not a valid name of a constant in C and C"):
        header(nf.preset("paper"), "c", name)
    assert header(nf.preset("paper"), "c", identifier(name))


HEADERS = {
    "c": "assert complex ctype errno fenv float inttypes limits locale math setjmp signal stdarg stdbool stdint stdio "
    "stdlib string tgmath time wchar wctype".split(),
    "c++": "algorithm array bit cassert cctype cerrno cmath complex cstdio cstdlib cstring ctime functional iostream "
    "map string vector".split(),
}


@pytest.mark.parametrize("language", HEADERS)
def test_names_that_are_accepted_compile_after_every_standard_header(language, root, tmp_path):
    compiler = {"c": ["gcc", "-std=gnu11"], "c++": ["g++", "-std=gnu++20"]}[language]
    ending = ".h" if language == "c" else ""
    names = [
        "gel",
        "liver_18G",
        "x",
        "membrane",
        "island",
        "Paper",
        *map(identifier, ["size_t", "sin", "linux", "M_PI", "2 mm", "int"]),
    ]
    lines = [f"#include <{name}{ending}>" for name in HEADERS[language]]
    (tmp_path / "main.c").write_text(
        "\n".join(lines) + "\n" + "\n".join(header(nf.preset("paper"), language, n) for n in names)
    )
    places = [f"-I{root / 'include'}", f"-I{root / 'bindings' / 'c'}"]
    kind = "c" if language == "c" else "c++"
    command = [*compiler, "-x", kind, "-fsyntax-only", "-Wno-pragma-once-outside-header", *places, tmp_path / "main.c"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[:2000]


@pytest.mark.parametrize("name", ["linux", "size_t", "M_PI", "sin", "int", "errno", "stdin"])
def test_names_that_are_refused_do_not_compile(name, root, tmp_path):
    text = header(nf.preset("paper"), "c", "gel").replace("gel", name)
    (tmp_path / "main.c").write_text("#include <math.h>\n#include <errno.h>\n#include <stdio.h>\n" + text)
    command = ["gcc", "-std=gnu11", "-fsyntax-only", f"-I{root / 'bindings' / 'c'}", tmp_path / "main.c"]
    assert subprocess.run(command, capture_output=True).returncode != 0
