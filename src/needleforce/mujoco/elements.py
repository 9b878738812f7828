# SPDX-License-Identifier: Apache-2.0
"""A model as the XML of the MuJoCo plugin."""

from xml.etree import ElementTree

from ..errors import InputError
from ..models.laws import FAMILIES
from ..models.model import Model

PLUGIN = "needleforce.needle"


def plugin_xml(source, *, name: str = "needle", bevel=None, **place) -> str:
    """The ``<plugin>`` element for the ``<extension>`` of a MuJoCo model, from an ``nf.Model`` or a fit.

    ``place``: ``joint``, or ``site`` with ``surface_site`` or ``surface_height`` [m] and ``surface_normal``; also
    ``max_speed`` [m/s]. Numbers are in SI, to the last digit. Raises InputError for a fit without a model and for
    another keyword.
    """
    model = source if isinstance(source, Model) else getattr(source, "model", None)
    if not isinstance(model, Model):
        raise InputError("source", type(source).__name__, "without a model", next_step="Give an nf.Model, or a fit.")
    plugin = ElementTree.Element("plugin", plugin=PLUGIN)
    instance = ElementTree.SubElement(plugin, "instance", name=name)
    for key, value in {**_place(place), **_bevel(bevel), **attributes(model)}.items():
        ElementTree.SubElement(instance, "config", key=key, value=value)
    ElementTree.indent(plugin)
    return ElementTree.tostring(plugin, encoding="unicode")


def attributes(model: Model) -> dict[str, str]:
    """The laws of ``model`` by the plugin's keys: the first layer's numbers each by its own, those of deeper layers
    beside their law, as MuJoCo takes no more than 255 keys."""
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


def _texts(value) -> dict[str, str]:
    numbers = {name: _number(number) for name, number in value.parameters().items()}
    return numbers | {part: getattr(value, part) for part in value.parts if part != "tip"}


def _own_keys(prefix: str, value) -> dict[str, str]:
    return {prefix: value.name} | {f"{prefix}.{name}": text for name, text in _texts(value).items()}


def _in_one_line(value) -> str:
    return " ".join([value.name, *(f"{name}={text}" for name, text in _texts(value).items())])


def _number(value) -> str:
    return ",".join(repr(float(each)) for each in value) if isinstance(value, tuple) else repr(float(value))


def _bevel(bevel) -> dict[str, str]:
    return {} if bevel is None else {f"bevel.{name}": repr(value) for name, value in bevel.parameters().items()}


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
        raise InputError("keyword", unknown[0], "of no known name", next_step=f"One of {', '.join(KEYS)}.")
    return {KEYS[name]: _text(value) for name, value in place.items() if value is not None}


def _text(value) -> str:
    if isinstance(value, str):
        return value
    return " ".join(repr(float(each)) for each in value) if hasattr(value, "__len__") else repr(float(value))
