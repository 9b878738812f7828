# SPDX-License-Identifier: Apache-2.0
"""What a program relies on that was compiled with the C headers: functions, values of enumerators, and where the
members of each struct are, with 64 bits. ``python tests/packaging/c_abi.py`` prints it."""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

C = Path(__file__).resolve().parents[2] / "bindings" / "c"
PARTS = ("", "_guard", "_bend", "_solid", "_events", "_online")
HEADERS = tuple(f"needleforce{part}.h" for part in PARTS)


def text_of(name: str) -> str:
    """A header without its comments."""
    return re.sub(r"/\*.*?\*/", "", (C / name).read_text(encoding="utf-8"), flags=re.S)


def functions(text: str) -> dict[str, str]:
    """Each function that a header declares: what it takes."""
    return dict(re.findall(r"^[\w* ]*?\b(nf_\w+)\(([^;{}]*)\);", text, flags=re.M))


def linker_names(text: str) -> dict[str, str]:
    """The names of the functions that have another for the linker."""
    return dict(re.findall(r"#define (nf_\w+) (nf_\w+)", text))


def members(body: str) -> list[str]:
    declared = [each for line in body.split(";") if line.strip() for each in line.split(",")]
    return [re.search(r"(\w+)\s*(?:\[\w+\])*\s*$", each)[1] for each in declared]


def program(text: str) -> str:
    """A C program that prints enumerators and structs."""
    prints = ['printf("NF_ABI_VERSION %d\\n", NF_ABI_VERSION);']
    for body in re.findall(r"enum \w*\s*\{(.*?)\}", text, flags=re.S):
        prints += [f'printf("value {name} %d\\n", {name});' for name in re.findall(r"\b(NF_\w+)", body)]
    for body, name in re.findall(r"typedef struct \{(.*?)\} (\w+);", text, flags=re.S):
        prints.append(f'printf("struct {name} %zu\\n", sizeof({name}));')
        prints += [f'printf("  {each} %zu\\n", offsetof({name}, {each}));' for each in members(body)]
    included = "".join(f'#include "{name}"\n' for name in HEADERS)
    return f"#include <stdio.h>\n{included}int main(void) {{\n" + "\n".join(prints) + "\nreturn 0;\n}\n"


def found() -> str:
    """The ABI of the headers as they are, as ``bindings/c/abi_v*.txt`` has it."""
    texts = [text_of(name) for name in HEADERS]
    names = sorted(linker_names(text).get(name, name) for text in texts for name in functions(text))
    with tempfile.TemporaryDirectory() as folder:
        source, binary = Path(folder) / "abi.c", Path(folder) / "abi"
        source.write_text(program("\n".join(texts)), encoding="utf-8")
        subprocess.run(["gcc", "-std=c11", "-Werror", f"-I{C}", source, "-o", binary], check=True)
        values = subprocess.run([binary], capture_output=True, text=True, check=True).stdout
    version, rest = values.split("\n", 1)
    return "\n".join([version, *(f"function {name}" for name in names), rest])


if __name__ == "__main__":
    sys.stdout.write(found())
