# SPDX-License-Identifier: Apache-2.0
"""The ABI of the C library: what is frozen under its number, what the shared library exports, and that a program which
was compiled with other structs does not link with it."""

import re
import subprocess

import c_abi
from building import said

STRUCTS = (
    "settings|parameter|layer|fault|sample|output|bending|base|bent|base_output|event|prior|learnt|layer_learnt|ahead"
)

OLD = """
#include <stddef.h>
#include <stdio.h>
typedef struct { double max_speed, hold_time, velocity_slack, velocity_slack_ratio, bevel[3]; } nf_settings;
nf_settings nf_default_settings(void);
void* nf_init(void*, size_t, const void*, size_t, const nf_settings*, void*);
int main(void) { nf_settings s = nf_default_settings(); return !nf_init(NULL, 0, NULL, 0, &s, NULL); }
"""
NEW = """
#include "needleforce_guard.h"
int main(void) {
  nf_settings settings = nf_default_settings();
  nf_fault why;
  return nf_init(NULL, 0, NULL, 0, &settings, &why) != NULL || settings.depth_noise != 0.0;
}
"""


def linked(folder, prefix, text):
    """The attempt to build a program in C with the installed library."""
    (folder / "main.c").write_text(text, encoding="utf-8")
    command = ["gcc", "-std=c11", f"-I{prefix / 'include'}", "main.c", f"-L{prefix / 'lib'}", "-lneedleforce", "-lm"]
    return subprocess.run([*command, "-o", "main"], cwd=folder, capture_output=True, text=True)


def test_a_program_with_structs_of_another_version_does_not_link(tmp_path, prefix):
    done = linked(tmp_path, prefix, OLD)
    assert done.returncode != 0
    assert "nf_default_settings" in done.stderr and "nf_init" in done.stderr


def test_a_program_with_these_structs_links_and_runs(tmp_path, prefix):
    done = linked(tmp_path, prefix, NEW)
    assert done.returncode == 0, done.stderr
    said([tmp_path / "main"])


def frozen(root) -> str:
    """What the number in the header stands for."""
    number = re.search(r"define NF_ABI_VERSION (\d+)", c_abi.text_of("needleforce.h"))[1]
    text = (root / "bindings" / "c" / f"abi_v{number}.txt").read_text(encoding="utf-8")
    assert text.startswith(f"NF_ABI_VERSION {number}\n")
    return text


def test_what_the_headers_declare_is_what_was_frozen(root):
    """A new function is a new line of ``abi_v*.txt``. Anything else is an ABI with the next number: in NF_ABI_VERSION,
    in the names of the functions, in a new ``abi_v*.txt`` by ``python tests/packaging/c_abi.py``, in ``integrations/``.
    """
    assert c_abi.found() == frozen(root)


def test_every_function_with_a_struct_has_the_number(root):
    number = re.search(r"NF_ABI_VERSION (\d+)", frozen(root))[1]
    for text in map(c_abi.text_of, c_abi.HEADERS):
        renamed, declared = c_abi.linker_names(text), c_abi.functions(text)
        needed = {function for function, taken in declared.items() if re.search(rf"nf_({STRUCTS})\b", taken)}
        assert needed | ({"nf_default_settings"} & declared.keys()) == renamed.keys() != set()
        assert all(symbol == f"{function}_v{number}" for function, symbol in renamed.items())


def test_the_shared_library_exports_these_functions_and_nothing_else(root, shared_library):
    functions = re.findall(r"^function (\w+)$", frozen(root), re.M)
    number = re.search(r"NF_ABI_VERSION (\d+)", frozen(root))[1]
    symbols = said(["nm", "--dynamic", "--defined-only", "--format=posix", shared_library]).splitlines()
    assert {line.split("@")[0] for line in symbols if " T " in line} == set(functions)
    assert [line.split()[0] for line in symbols if " T " not in line] == [f"NEEDLEFORCE_{number}"]
    assert f"[libneedleforce.so.{number}]" in said(["readelf", "--dynamic", shared_library])
