# SPDX-License-Identifier: Apache-2.0
"""Exported headers compile without a warning and give the same force as the model in Python."""

import re

import numpy as np
import pytest
from building import said
from traced_models import TIPS, c_program, cpp_program, models, way

import needleforce as nf
from needleforce.export import header
from needleforce.preset_files.schema import tips

STRICT = ["-Wall", "-Wextra", "-Werror", "-pedantic"]
LANGUAGES = {
    "c++": ("hpp", cpp_program, "main.cpp", ["g++", "-std=c++20"], []),
    "c": ("h", c_program, "main.c", ["gcc", "-std=c11"], ["-lneedleforce", "-lm"]),
}


@pytest.fixture(scope="module", params=LANGUAGES)
def traces(request, prefix, tmp_path_factory):
    """The force (n,) [N] of each model along the way, from a program of exported headers."""
    ending, program, source, compiler, libraries = LANGUAGES[request.param]
    folder = tmp_path_factory.mktemp("exported")
    for name, model in models().items():
        (folder / f"{name}.{ending}").write_text(header(model, request.param, name), encoding="utf-8")
    (folder / source).write_text(program(list(models())), encoding="utf-8")
    where = [f"-I{prefix / 'include'}", f"-L{prefix / 'lib'}"]
    said([*compiler, "-O0", *STRICT, *where, source, "-o", "main", *libraries], cwd=folder)
    text = said([folder / "main"], input="\n".join(map(repr, way().tolist())))
    return dict(zip(models(), (np.array(line.split(), float) for line in text.splitlines()), strict=True))


def test_every_tip_is_exported():
    assert {type(tip) for tip in TIPS.values()} == set(tips())


@pytest.mark.parametrize("name", models())
def test_the_force_is_that_of_python(traces, name):
    depth = way()
    force = nf.Insertion(models()[name]).run(depth, None, np.full(len(depth), 1e-3))["force"]
    assert np.abs(force).max() > 5e-4
    np.testing.assert_allclose(traces[name], force, rtol=0.0, atol=1e-12 * np.abs(force).max())


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_number_stands_there_to_the_last_bit(language):
    model = nf.preset("paper").replace(friction=nf.laws.Coulomb(np.nextafter(18.6, 19.0), np.nextafter(2e-5, 1.0)))
    text = header(model, language, "fine")
    found = {float(number) for number in re.findall(r"[=,] (-?\d[\d.e+-]*)", text)}
    for law in model.layers[0].parts:
        assert set(law.parameters().values()) <= found


@pytest.mark.parametrize("language", LANGUAGES)
def test_what_is_said_about_a_model_cannot_leave_its_comment(language, tmp_path):
    nasty = 'ends here */ int x = "\\'
    model = nf.preset("paper").replace(summary=nasty, reference=f"two\nlines {nasty}", doubts=(nasty, "/* \u202e ??/"))
    _, _, source, compiler, _ = LANGUAGES[language]
    text = header(model, language, "nasty")
    assert text.count("*/") == len(re.findall(r"/\*", text))
    text = text.replace('#include "needleforce', '// #include "needleforce').split("clang-format off")[0]
    (tmp_path / source).write_text(text + ("*/" if language == "c" else "") + "\nint main(void) { return 0; }\n")
    said([*compiler, *STRICT, "-fsyntax-only", tmp_path / source])


def test_the_same_model_gives_the_same_text_with_where_it_is_from():
    model = nf.preset("layered")
    text = header(model, "c++", "layered", ("Recording one.csv",))
    assert text == header(model, "c++", "layered", ("Recording one.csv",))
    assert "// Recording one.csv\n" in text and nf.__version__ in text
    assert " ".join(text.replace("\n//  ", "").split()).count(model.doubts[0][:60]) == 1


@pytest.mark.parametrize("name", ["int", "2fast", "a-b", "", "_x", "a__b", "constexpr", "größe", "nf_init", "NAN"])
def test_names_that_no_compiler_takes_are_refused(name):
    with pytest.raises(nf.InputError, match="not a valid name of a constant"):
        header(nf.preset("paper"), "c", name)


def test_the_header_for_c_is_also_one_for_cpp(prefix, tmp_path):
    for name, model in models().items():
        (tmp_path / "model.cpp").write_text(header(model, "c", name), encoding="utf-8")
        said(["g++", "-std=c++20", f"-I{prefix / 'include'}", "-fsyntax-only", tmp_path / "model.cpp"])


def test_an_unknown_language_is_refused():
    with pytest.raises(nf.InputError, match=r"unknown\. Give c\+\+ or c"):
        header(nf.preset("paper"), "rust")
