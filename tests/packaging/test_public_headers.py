# SPDX-License-Identifier: Apache-2.0
"""The public headers compile without a warning under the flags of strict projects, with every compiler there is."""

import shutil

import pytest
from building import said

STRICT = [
    *("-Wall", "-Wextra", "-Wpedantic", "-Werror", "-Wconversion", "-Wsign-conversion", "-Wfloat-conversion"),
    *("-Wshadow", "-Wdouble-promotion"),
]
COMPILERS = {
    "c++": ("g++", "clang++", "clang++-19", "clang++-20", "clang++-21", "clang++-22"),
    "c": ("gcc", "clang", "clang-19", "clang-20", "clang-21", "clang-22"),
}
# what is a template is only checked where it is used
USED = (
    *("tests/cpp/step_object.cpp", "examples/guard.cpp"),
    *("bindings/c/needleforce.cpp", "bindings/c/needleforce_guard.cpp"),
    *("bindings/c/needleforce_events.cpp", "bindings/c/needleforce_online.cpp"),
)


def present(language):
    return [name for name in COMPILERS[language] if shutil.which(name)]


@pytest.mark.parametrize("compiler", present("c++"))
def test_every_header_of_the_core_compiles_under_strict_warnings(compiler, root, tmp_path):
    headers = sorted((root / "include").rglob("*.hpp"))
    assert len(headers) > 50
    names = [header.relative_to(root / "include").as_posix() for header in headers]
    every = [*names, *(root / name for name in USED)]  # in one unit: each header is parsed once
    (tmp_path / "all.cpp").write_text("".join(f'#include "{name}"\n' for name in every), encoding="utf-8")
    where = [f"-I{root / 'include'}", f"-I{root / 'bindings' / 'c'}", "-Wextra-semi"]
    said([compiler, "-std=c++20", "-fsyntax-only", *STRICT, *where, tmp_path / "all.cpp"])


@pytest.mark.parametrize("compiler", present("c"))
def test_the_c_headers_compile_under_strict_warnings(compiler, root, tmp_path):
    included = '#include "needleforce_guard.h"\n#include "needleforce_online.h"\n'
    text = included + "int main(void) { return nf_default_settings().max_speed < 0.0; }\n"
    (tmp_path / "main.c").write_text(text, encoding="utf-8")
    where = f"-I{root / 'bindings' / 'c'}"
    said([compiler, "-std=c99", "-fsyntax-only", "-Wstrict-prototypes", *STRICT, where, tmp_path / "main.c"])
