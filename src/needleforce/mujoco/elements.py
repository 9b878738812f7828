# SPDX-License-Identifier: Apache-2.0
"""A model as XML for the MuJoCo plugin."""

from typing import Any
from xml.etree import ElementTree

from .. import core
from ..errors import InputError
from ..models.laws import FAMILIES
from ..models.model import Model

PLUGIN = "needleforce.needle"


def plugin_xml(source: Any, *, name: str = "needle", bevel: core.Bevel | None = None, **place: Any) -> str:
    """The ``<plugin>`` element for the ``<extension>`` of a MuJoCo model.

    Parameters
    ----------
    source : Model or Fit
        A model, or a fit with a model.
    name : str
        Name of the plugin instance.
    bevel : core.Bevel, optional
        As for ``nf.Insertion``.
    **place
        ``joint``, ``site``, ``surface_site``, ``surface_height`` [m], ``surface_normal`` and ``max_speed`` [m/s], as
        for ``attach``.

    Returns
    -------
    str
        The XML, with numbers in SI to the last digit.

    Raises
    ------
    InputError
        If a fit has no model, or a keyword is unknown.
    """
    model = source if isinstance(source, Model) else getattr(source, "model", None)
    if not isinstance(model, Model):
        raise InputError(
            "source", type(source).__name__, "without a model", next_step="Give an nf.Model, or a fit with a model."
        )
    plugin = ElementTree.Element("plugin", plugin=PLUGIN)
    instance = ElementTree.SubElement(plugin, "instance", name=name)
    bevelled = {} if bevel is None else {f"bevel.{name}": repr(value) for name, value in bevel.parameters().items()}
    for key, value in {**_place(place), **bevelled, **attributes(model)}.items():
        ElementTree.SubElement(instance, "config", key=key, value=value)
    ElementTree.indent(plugin)
    return ElementTree.tostring(plugin, encoding="unicode")


def attributes(model: Model) -> dict[str, str]:
    """The laws of ``model`` by the plugin's keys: one key for each parameter of the first layer, one for each law of a
    deeper layer with its parameters, as MuJoCo allows at most 255 keys."""
    keys = {}
    for family in FAMILIES:
        law = getattr(model, family)
        keys |= _own_keys(family, law)
        if "tip" in law.parts:
            keys |= _own_keys(f"{family}.tip", law.tip)
    for number, layer in enumerate(model.deeper, 2):
        keys[f"layer{number}.top"] = repr(float(layer.top))
        for family in FAMILIES:
            law = getattr(layer, family)
            keys[f"layer{number}.{family}"] = _in_one_line(law)
            if "tip" in law.parts:
                keys[f"layer{number}.{family}.tip"] = _in_one_line(law.tip)
    return keys


def _texts(value: Any) -> dict[str, str]:
    numbers = {name: _number(number) for name, number in value.parameters().items()}
    return numbers | {part: getattr(value, part) for part in value.parts if part != "tip"}


def _own_keys(prefix: str, value: Any) -> dict[str, str]:
    return {prefix: value.name} | {f"{prefix}.{name}": text for name, text in _texts(value).items()}


def _in_one_line(value: Any) -> str:
    return " ".join([value.name, *(f"{name}={text}" for name, text in _texts(value).items())])


def _number(value: Any) -> str:
    return ",".join(repr(float(each)) for each in value) if isinstance(value, tuple) else repr(float(value))


KEYS = {
    "joint": "joint",
    "site": "site",
    "surface_site": "surface.site",
    "surface_height": "surface.height",
    "surface_normal": "surface.normal",
    "max_speed": "max_speed",
}


def _place(place: dict) -> dict[str, str]:
    unknown = sorted(set(place) - set(KEYS))
    if unknown:
        raise InputError("keyword", unknown[0], "unknown", next_step=f"Give one of {', '.join(KEYS)}.")
    return {KEYS[name]: _text(value) for name, value in place.items() if value is not None}


def _text(value: Any) -> str:
    if isinstance(value, str):
        return value
    return " ".join(repr(float(each)) for each in value) if hasattr(value, "__len__") else repr(float(value))
