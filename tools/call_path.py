# SPDX-License-Identifier: Apache-2.0
"""The path of a call through the files of a package, as its imports and calls show it without running it.

From the first function the calls are followed in the order in which they are written, arguments before the call that
takes them, each function where it is called first. A *stay* begins wherever the path enters another file; it is a
*return* if the path was in that file before. A call is followed where its name is defined in the file or imported, also
inside a function; a method where the class of its value is annotated: of a parameter, or of what a function returns.
"""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

FunctionKey = tuple[str, str]  # the module, and the name of a function, or Class.method


class CallPath(NamedTuple):
    """Functions that were followed, stays in files, files, and returns to a file."""

    functions: int
    stays: int
    files: int
    returns: int


@cache
def syntax_tree(path: Path) -> ast.Module:
    """A module, parsed once."""
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def nodes_of(path: Path) -> list[ast.AST]:
    """Everything in a module, walked once."""
    return list(ast.walk(syntax_tree(path)))


class _Package:
    """The functions of a package, and the module and name that each name of a module stands for."""

    def __init__(self, known: dict[str, Path]) -> None:
        trees = {module: syntax_tree(path) for module, path in known.items()}
        self.functions: dict[FunctionKey, ast.FunctionDef] = {}
        self.names = {module: dict(_imported(module, path, known)) for module, path in known.items()}
        for module, tree in trees.items():
            for node in tree.body:
                if isinstance(node, ast.FunctionDef | ast.ClassDef):
                    self.names[module][node.name] = module, node.name
                if isinstance(node, ast.FunctionDef):
                    self.functions[module, node.name] = node
                if isinstance(node, ast.ClassDef):
                    methods = [each for each in node.body if isinstance(each, ast.FunctionDef)]
                    self.functions |= {(module, f"{node.name}.{each.name}"): each for each in methods}

    def target(self, caller: FunctionKey, call: ast.Call) -> FunctionKey | None:
        """The function of the package that a call means, None if it is another or unknown."""
        called = call.func
        if isinstance(called, ast.Name):
            return self._defined(*self.names[caller[0]].get(called.id, ("", "")))
        if not isinstance(called, ast.Attribute):
            return None
        if isinstance(called.value, ast.Name) and called.value.id in self.names[caller[0]]:
            owner, name = self.names[caller[0]][called.value.id]
            return self._defined(owner, f"{name}.{called.attr}" if name else called.attr)
        owner, name = self._class_of(caller, called.value)
        return self._defined(owner, f"{name}.{called.attr}")

    def _class_of(self, caller: FunctionKey, value: ast.expr) -> FunctionKey:
        """The module and the name of the class of a value, empty if it is not known."""
        function = self.functions[caller]
        if isinstance(value, ast.Call):
            made = value.func.id if isinstance(value.func, ast.Name) else ""
            target = self.target(caller, value)
            returned = self._annotated(target[0], self.functions[target].returns) if target else ("", "")
            return returned if target else self._handed_on(*self.names[caller[0]].get(made, ("", "")))
        if not isinstance(value, ast.Name):
            return "", ""
        if value.id in ("self", "cls"):
            return caller[0], caller[1].partition(".")[0]
        for argument in (*function.args.args, *function.args.kwonlyargs):
            if argument.arg == value.id:
                return self._annotated(caller[0], argument.annotation)
        for node in ast.walk(function):
            targets = node.targets if isinstance(node, ast.Assign) else []
            if any(isinstance(each, ast.Name) and each.id == value.id for each in targets):
                return ("", "") if isinstance(node.value, ast.Name) else self._class_of(caller, node.value)
        return "", ""

    def _annotated(self, module: str, annotation: ast.expr | None) -> FunctionKey:
        """The class that an annotation names, if it names one alone."""
        if isinstance(annotation, ast.Constant) and isinstance(annotation.value, str):
            annotation = ast.parse(annotation.value, mode="eval").body
        name = annotation.id if isinstance(annotation, ast.Name) else ""
        return self._handed_on(*self.names[module].get(name, ("", "")))

    def _handed_on(self, module: str, name: str) -> FunctionKey:
        """Where a name is defined that a module may have imported."""
        while (further := self.names.get(module, {}).get(name)) not in (None, (module, name)):
            module, name = further
        return module, name

    def _defined(self, module: str, name: str) -> FunctionKey | None:
        owner, dot, method = name.partition(".")
        module, owner = self._handed_on(module, owner)
        key = module, f"{owner}{dot}{method}"
        return key if key in self.functions else None


def _imported(module: str, path: Path, known: dict[str, Path]) -> Iterator[tuple[str, FunctionKey]]:
    """Each imported name with the module, and the name in it, that it stands for; an empty name for a module."""
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    for node in nodes_of(path):
        if not isinstance(node, ast.ImportFrom):
            continue
        parents = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
        base = ".".join([*parents, *([node.module] if node.module else [])])
        for alias in node.names:
            if f"{base}.{alias.name}" in known:
                yield alias.asname or alias.name, (f"{base}.{alias.name}", "")
            elif base in known:
                yield alias.asname or alias.name, (base, alias.name)


def call_path(known: dict[str, Path], module: str, function: str) -> CallPath:
    """Follow a call of ``function`` of ``module`` through the modules ``known``."""
    package = _Package(known)
    trail: list[str] = []
    seen: set[FunctionKey] = set()

    def follow(key: FunctionKey) -> None:
        seen.add(key)
        trail.append(key[0])
        calls = [node for node in ast.walk(package.functions[key]) if isinstance(node, ast.Call)]
        for call in sorted(calls, key=lambda call: (call.end_lineno, call.end_col_offset)):
            target = package.target(key, call)
            if target is not None and target not in seen:
                follow(target)

    follow((module, function))
    stays = [name for name, before in zip(trail, ["", *trail]) if name != before]
    return CallPath(len(seen), len(stays), len(set(stays)), len(stays) - len(set(stays)))
