# SPDX-License-Identifier: Apache-2.0
"""A needle, a tip, a tissue or a law as a table of its parameters."""

from collections.abc import Iterable
from typing import Any

from .markup import Markup, element, join, table
from .quantities import plain

HEAD = ("parameter", "symbol", "value", "meaning")


def parameter_rows(value: Any) -> list[tuple[str, str, str, str]]:
    """The parameters of a value of the core, from its table.

    Parameters
    ----------
    value : nf.Needle, nf.Tissue, a tip of nf.tips or a law of nf.laws
        Has ``table()`` and ``parameters()``.

    Returns
    -------
    list of tuple
        Name, symbol, value with unit, and meaning, of each parameter, under ``HEAD``.
    """
    numbers = value.parameters()
    rows = [(row["name"], row["symbol"], plain(numbers[row["name"]], row["unit"]), row["meaning"]) for row in value.table()]
    parts = ((part, getattr(value, part)) for part in getattr(value, "parts", ()))
    return rows + [(part, "", str(found), "") for part, found in parts if found is not None]


def as_html(value: Any) -> Markup:
    """The name of a value of the core and its parameters as an HTML table, for a notebook."""
    return join([element("p", element("b", type(value).__name__)), table(HEAD, parameter_rows(value))])


def named_rows(values: Iterable[tuple[str, Any]]) -> list[tuple[str, str, str, str]]:
    """Rows of several values, each parameter under the name of its owner, as ``stiffness.reduced_modulus``."""
    return [(f"{owner}.{row[0]}", *row[1:]) for owner, value in values for row in parameter_rows(value)]
