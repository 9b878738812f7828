# SPDX-License-Identifier: Apache-2.0
"""Figures of the structure of src/needleforce: how it is cut into files, who imports whom, what a call runs.

``python tools/structure.py`` prints them; with ``--write`` they replace the generated table in ARCHITECTURE.md, with
``--package FOLDER`` they are those of another checkout of the package.
"""

import argparse
import ast
import os
import re
import statistics
import subprocess
import sys
import tempfile
from collections import Counter, defaultdict
from pathlib import Path

from call_path import call_path, nodes_of, syntax_tree

ROOT = Path(__file__).resolve().parents[1]
TABLE = re.compile(r"(<!-- figures: .*? -->\n).*?(<!-- end of figures -->)", re.S)
# each in a process of its own: the functions that run, by the file they stand in; called once before, so that the
# classes of modules that are imported meanwhile do not count
RUNS = """
import sys, pathlib
import needleforce as nf
nf.identify, nf.read, nf.segment
package = str(pathlib.Path(nf.__file__).parent)
recording = nf.read({recording!r}) if {call!r} != "read" else None
fit = nf.identify(recording) if {call!r} == "report" else None
files = set()
def profile(frame, event, argument):
    name = frame.f_code.co_filename
    if event == "call" and name.startswith(package) and frame.f_code.co_name != "<module>":
        files.add(name)
call = {{"read": lambda: nf.read({recording!r}), "identify": lambda: nf.identify(recording),
         "report": lambda: fit.report({report!r})}}[{call!r}]
call()
sys.setprofile(profile)
call()
sys.setprofile(None)
print(len(files), *sorted(pathlib.Path(name).relative_to(package).as_posix() for name in files))
"""


def modules(package: Path) -> dict[str, Path]:
    """Every module by its dotted name."""
    paths = sorted(path for path in package.rglob("*.py"))
    names = [".".join(path.relative_to(package.parent).with_suffix("").parts) for path in paths]
    return {name.removesuffix(".__init__"): path for name, path in zip(names, paths)}


def imports_of(name: str, path: Path, known: dict[str, Path]) -> dict[str, set[str]]:
    """Modules of the package that one imports, with the names taken, "*" for the module itself."""
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    found: dict[str, set[str]] = defaultdict(set)
    for node in nodes_of(path):
        if not isinstance(node, ast.ImportFrom):
            continue
        parents = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
        base = ".".join([*parents, *([node.module] if node.module else [])])
        for alias in node.names:
            if f"{base}.{alias.name}" in known:
                found[f"{base}.{alias.name}"].add("*")
            elif base in known and base != name:
                found[base].add(alias.name)
    return found


def circles(graph: dict[str, set[str]]) -> list[list[str]]:
    """Groups of modules that import each other in a loop, also inside functions (Tarjan 1972)."""
    order: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found = []

    def visit(name: str) -> None:
        order[name] = low[name] = len(order)
        stack.append(name)
        for other in sorted(graph[name]):
            if other not in order:
                visit(other)
            if other in stack:
                low[name] = min(low[name], low[other])
        if low[name] == order[name]:
            group = [stack.pop()]
            while group[-1] != name:
                group.append(stack.pop())
            found.append(sorted(group))

    for name in graph:
        if name not in order:
            visit(name)
    return [group for group in found if len(group) > 1]


def run_files(call: str, environment: dict[str, str]) -> int:
    """How many files of the package run in one call on the example recording."""
    with tempfile.TemporaryDirectory() as folder:
        report = str(Path(folder) / "report.html")
        code = RUNS.format(call=call, recording=str(ROOT / "examples" / "insertion.csv"), report=report)
        command = [sys.executable, "-c", code]
        done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    return int(done.stdout.split()[0])


def unannotated(function: ast.FunctionDef) -> int:
    """Parameters without a type, ``self`` and ``cls`` left out."""
    return sum(each.annotation is None for each in named(function))


def figures(package: Path, environment: dict[str, str]) -> list[tuple[str, str]]:
    """Each figure with its value."""
    known = modules(package)
    imports = {name: imports_of(name, path, known) for name, path in known.items()}
    lines = [len(path.read_text(encoding="utf-8").splitlines()) for path in known.values()]
    trees = [syntax_tree(path) for path in known.values()]
    nodes = [node for path in known.values() for node in nodes_of(path)]
    calls = [node for node in nodes if isinstance(node, ast.Call)]
    functions = [node for node in nodes if isinstance(node, ast.FunctionDef)]
    classes = Counter(node.name for tree in trees for node in tree.body if isinstance(node, ast.ClassDef))
    loops = circles({name: set(found) for name, found in imports.items()})
    path = call_path(known, "needleforce.recording.reader", "read")
    return [
        ("Python files", f"{len(known)}"),
        ("lines", f"{sum(lines)}"),
        ("lines of a module, median and longest", f"{statistics.median(lines):.0f}, {max(lines)}"),
        ("modules with one importer", f"{len(single_importers(imports, known))}"),
        ("modules in the largest import circle", f"{max(map(len, loops), default=0)}"),
        ("functions with eight or more parameters", f"{sum(len(named(each)) >= 8 for each in functions)}"),
        ("calls with six or more positional arguments", f"{sum(len(call.args) >= 6 for call in calls)}"),
        (
            "unannotated parameters",
            f"{sum(map(unannotated, functions))} of {sum(len(named(each)) for each in functions)}",
        ),
        ("class names that occur more than once", f"{sum(count > 1 for count in classes.values())}"),
        *((f"files that run in `{shown}`", f"{run_files(call, environment)}") for call, shown in SHOWN.items()),
        ("stays in files on the path through `read`", f"{path.stays}"),
        ("returns to a file on the path through `read`", f"{path.returns}"),
    ]


SHOWN = {"read": "nf.read(file)", "identify": "nf.identify(recording)", "report": "fit.report(file)"}


def single_importers(imports: dict[str, dict[str, set[str]]], known: dict[str, Path]) -> list[str]:
    """The modules that one other module alone imports; what a package's ``__init__`` or the command line imports is
    an entry point and does not count."""
    importers: dict[str, set[str]] = defaultdict(set)
    for name, found in imports.items():
        for other in found:
            importers[other].add(name)
    entry = {name for name, path in known.items() if path.name == "__init__.py"} | {"needleforce.cli"}
    return [name for name, found in importers.items() if len(found) == 1 and not found & entry and name not in entry]


def named(function: ast.FunctionDef) -> list[ast.arg]:
    """The parameters of a function, ``self`` and ``cls`` left out."""
    arguments = [*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs]
    return [each for each in arguments if each.arg not in ("self", "cls")]


def table(rows: list[tuple[str, str]]) -> str:
    """The figures in Markdown."""
    return "| figure | value |\n|---|---|\n" + "".join(f"| {name} | {value} |\n" for name, value in rows)


def main() -> None:
    """Prints the figures, or writes them where they are generated."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--package", type=Path, default=ROOT / "src" / "needleforce", help="folder of the package")
    options.add_argument("--write", action="store_true", help="replace the table in ARCHITECTURE.md")
    given = options.parse_args()
    text = table(figures(given.package, dict(os.environ)))
    if not given.write:
        print(text, end="")
        return
    page = ROOT / "ARCHITECTURE.md"
    page.write_text(TABLE.sub(lambda m: m[1] + text + m[2], page.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
