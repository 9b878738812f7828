# SPDX-License-Identifier: Apache-2.0
"""A program that was compiled with other structs than the C library does not link with it."""

import hashlib
import re
import subprocess

from building import said

PARTS = ("", "_guard", "_bend", "_solid", "_events", "_online")
HEADERS = tuple(f"needleforce{part}.h" for part in PARTS)
PLAIN = "settings|parameter|layer|fault|sample|output|bending|base|bent|base_output|event|prior|learnt|layer_learnt"
VERSION = 2
STRUCTS = "6971cb2f7590e72d"  # of VERSION

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


def test_a_changed_struct_has_another_version(root):
    text = "".join((root / "bindings" / "c" / name).read_text(encoding="utf-8") for name in HEADERS)
    structs = re.findall(r"typedef struct \{.*?\} \w+;", re.sub(r"/\*.*?\*/", "", text, flags=re.S), flags=re.S)
    assert len(structs) == 22
    found = hashlib.sha256("\n".join(" ".join(struct.split()) for struct in structs).encode()).hexdigest()[:16]
    assert found == STRUCTS, "a struct has changed: the names in both headers need the next version, here too"


def test_every_function_with_a_struct_has_the_version(root):
    for name in HEADERS:
        text = re.sub(r"/\*.*?\*/", "", (root / "bindings" / "c" / name).read_text(encoding="utf-8"), flags=re.S)
        versioned = dict(re.findall(r"#define (nf_\w+) (nf_\w+)", text))
        prototypes = re.findall(r"^[\w* ]*?\b(nf_\w+)\(([^;{}]*)\);", text, flags=re.M)
        plain = rf"nf_({PLAIN}|ahead)\b"
        needed = {function for function, taken in prototypes if re.search(plain, taken)}
        needed |= {"nf_default_settings"} & {function for function, _ in prototypes}
        assert needed and needed == set(versioned)
        assert all(symbol == f"{function}_v{VERSION}" for function, symbol in versioned.items())
