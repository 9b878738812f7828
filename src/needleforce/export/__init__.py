# SPDX-License-Identifier: Apache-2.0
"""A model as a header of constants, so that a controller reads no file."""

import re

from ..errors import InputError
from ..models.model import Model
from . import c, headers
from .source import Given, given

__all__ = ["LANGUAGES", "Given", "given", "header", "identifier"]

LANGUAGES = {"c++": headers.header, "c": c.header}
# words that either language keeps for itself
RESERVED = frozenset(
    "alignas alignof and and_eq asm auto bitand bitor bool break case catch char char16_t char32_t char8_t class "
    "co_await co_return co_yield compl concept const const_cast consteval constexpr constinit continue decltype "
    "default delete do double dynamic_cast else enum explicit export extern false float for friend goto if inline int "
    "long main mutable namespace needleforce new noexcept not not_eq nullptr operator or or_eq private protected "
    "public register reinterpret_cast requires restrict return short signed sizeof static static_assert static_cast "
    "struct switch template this thread_local throw true try typedef typeid typename union unsigned using virtual void "
    "volatile wchar_t while xor xor_eq".split()
)
# letters, digits and _, and none of what either language or the C library of this project has for itself
NAME = re.compile(r"(?!nf_|NULL$|NAN$|INFINITY$|EOF$)[A-Za-z]\w*", re.ASCII)


def header(model: Model, language: str = "c++", name: str | None = None, sources: tuple[str, ...] = ()) -> str:
    """The text of a header that holds ``model`` as the constant array ``name``, its layers from the surface down.

    ``language``: ``c++`` for ``needleforce::Layer`` with typed laws, ``c`` for ``nf_layer`` with laws by name. Every
    number is in SI and the same to the last bit when a compiler reads it. ``name``: without it the model's own.
    ``sources`` are lines that say where the model comes from. The same model gives the same text, without a date.
    Raises InputError for another language and for a name that is no identifier.
    """
    if language not in LANGUAGES:
        raise InputError("language", repr(language), f"known are {' and '.join(LANGUAGES)}")
    name = identifier(model.name) if name is None else name
    if not _free(name):
        limit = "no name that C and C++ take for a constant"
        raise InputError("name", repr(name), limit, next_step="Give letters, digits and _, no keyword, as liver_18G.")
    return LANGUAGES[language](model, name, sources)


def identifier(text: str) -> str:
    """``text`` as a name for a constant: what neither language takes becomes _, and a bad start a prefix."""
    name = re.sub(r"[^A-Za-z0-9]+", "_", text).strip("_")
    return name if _free(name) else f"model_{name}".rstrip("_")


def _free(name: str) -> bool:
    return bool(NAME.fullmatch(name)) and "__" not in name and name not in RESERVED
