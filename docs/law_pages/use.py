# SPDX-License-Identifier: Apache-2.0
"""How a law is written in a preset, in Python and in C++."""

from needleforce.preset_files.build import as_toml

from . import header
from .typical import around


def toml(law) -> str:
    """The law's own sections of a preset file."""
    sections = as_toml(around(law)).split("\n\n")
    return "\n\n".join(text.strip() for text in sections if text.startswith((f"[{law.family}]", f"[{law.family}.")))


def python(law) -> str:
    """The statement that makes the law in Python."""
    return f"law = nf.laws.{_written(law, _python)}"


def cpp(law) -> str:
    """The statement that makes the law in C++, inside ``namespace needleforce``."""
    return f"const {header.cpp_name(type(law))} law{_written(law, _cpp).removeprefix(type(law).__name__)};"


def _values(law) -> dict:
    return law.parameters() | {part: getattr(law, part) for part in getattr(law, "parts", ())}


def _written(value, write) -> str:
    """``Name(a=1, b=2)`` or ``Name{.a = 1, .b = 2}``; a value within, such as a tip, likewise."""
    return write(type(value).__name__, {name: _inner(part, write) for name, part in _values(value).items()})


def _inner(value, write) -> str:
    if hasattr(value, "parameters"):
        return WHERE_TIPS_ARE[write] + _written(value, write)
    return repr(value)


def _python(name: str, values: dict) -> str:
    return f"{name}({_listed(f'{key}={value}' for key, value in values.items())})"


def _cpp(name: str, values: dict) -> str:
    return f"{name}{{{_listed(f'.{key} = {value}' for key, value in values.items())}}}"


def _listed(arguments) -> str:
    """On one line, or with three or more arguments one a line."""
    arguments = list(arguments)
    return ", ".join(arguments) if len(arguments) < 3 else "\n" + "".join(f"    {each},\n" for each in arguments)


WHERE_TIPS_ARE = {_python: "nf.tips.", _cpp: "tips::"}
