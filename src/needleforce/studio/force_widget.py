# SPDX-License-Identifier: Apache-2.0
"""The studio's plots in a notebook: a recording and what was fitted to it, by the contract of anywidget."""

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..files import read_bytes
from ..recording import Recording
from ..segmentation import Events, segment
from .page_files import PAGE

if TYPE_CHECKING:
    from ..identification import Fit

_IMPORT = re.compile(r'^import (\{[^}]*\}) from "\./([\w.]+)";\n', re.M)
_EXPORT = re.compile(r"^export (?=(?:const|let|class|(?:async )?function\*?) (\w+))", re.M)


def force_widget(recording: Recording, *fits: "Fit") -> Any:
    """Force over depth and over time in a notebook, measured and of each fit, to be zoomed and read with the pointer.

    A drag or, after a click, the wheel and the keys + - 0 and arrows zoom. The stretch of time that is looked at is the
    widget's ``time_range``, which a script may read or set.

    Parameters
    ----------
    recording : Recording
        What was measured.
    *fits : Fit
        Results of ``nf.identify`` or ``nf.compare``, each drawn as the force it predicts along the recording.

    Returns
    -------
    anywidget.AnyWidget
        With ``time_range``, a list [start, end] in s, empty for the whole recording.

    Raises
    ------
    InputError
        If anywidget is not installed.
    """
    try:
        import anywidget
        import traitlets
    except ImportError:
        step = 'Run pip install "needleforce[jupyter]".'
        raise InputError("force_widget", "without anywidget", "it shows the plots", next_step=step) from None

    class ForceWidget(anywidget.AnyWidget):
        _esm = one_module("force_widget.js")
        columns = traitlets.Bytes().tag(sync=True)
        shown = traitlets.Dict().tag(sync=True)
        time_range = traitlets.List().tag(sync=True)

    return ForceWidget(**widget_state(recording, *fits))


def widget_state(recording: Recording, *fits: "Fit") -> dict[str, Any]:
    """What the widget shows: columns of numbers as bytes, and what they are."""
    columns = [recording.time, recording.depth, recording.force, *(fit.predict(recording) for fit in fits)]
    marks = _marks(recording, segment(recording))
    shown = {"rows": len(recording), "fits": [_name(fit) for fit in fits], "marks": marks}
    return {"columns": np.stack(columns).astype("<f8").tobytes(), "shown": shown}


def _name(fit: "Fit") -> str:
    return fit.model.name.removeprefix("identified_").replace("_", " ")


def _marks(recording: Recording, events: Events) -> list[dict]:
    """Contact, punctures and exit by the numbers of their samples."""
    found = [("contact", events.contact), *(("puncture", each) for each in events.punctures), ("exit", events.exit)]
    marks = [(kind, int(np.searchsorted(recording.time, each.time))) for kind, each in found if each is not None]
    return [{"kind": kind, "at": min(at, len(recording) - 1)} for kind, at in marks]


def one_module(name: str) -> str:
    """A module of this folder with all that it imports from the page, as the text of one module."""
    text = _text(Path(__file__).with_name(name))
    return "\n".join([*_imported(text, {}).values(), _with_constants(text)])


def _imported(text: str, done: dict[str, str]) -> dict[str, str]:
    """Each module that is imported, after those that it imports, as an object of what it exports."""
    for _, name in _IMPORT.findall(text):
        if name in done:
            continue
        inner = _text(PAGE / name)
        _imported(inner, done)
        exports = ", ".join(_EXPORT.findall(inner))
        body = _with_constants(_EXPORT.sub("", inner))
        done[name] = f"const {_object(name)} = (() => {{\n{body}return {{ {exports} }};\n}})();"
    return done


def _with_constants(text: str) -> str:
    return _IMPORT.sub(lambda found: f"const {found[1]} = {_object(found[2])};\n", text)


def _object(name: str) -> str:
    return name.replace(".", "_")


def _text(path: Path) -> str:
    return read_bytes(path, "page").decode()
