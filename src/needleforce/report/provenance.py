# SPDX-License-Identifier: Apache-2.0
"""Where the numbers come from: files, hashes, samples, what the readers assumed, settings, version."""

from ..vocabulary import __version__
from .markup import Markup, element, join, listing, table
from .numbers import with_unit

_OWN = ("no.", "file")
_NAMES = ("sha256", "samples", "rate", "duration", "source", "needle", "tissue", "rig", "filter", "assumed in reading")


def provenance(fit) -> Markup:
    """The files as they were read; what all share said once; then settings and version."""
    files = [_file(k, one) for k, one in enumerate(fit.recordings, 1)]
    shared = _shared(files)
    own = [name for name in (files[0] if files else ()) if name not in shared]
    rows = ([_shown(name, file[name]) for name in own] for file in files)
    told = ((name, value) for name, value in fit.settings.items() if name != "evidence")  # has its own section
    settings = [("needleforce", __version__), *told, *shared.items()]
    return join([table(tuple(own), rows, class_="cards numbers provenance"), _definitions(settings)])


def _file(number: int, one) -> dict[str, object]:
    """What is known of one file, by name; empty where nothing is."""
    recording = one.recording
    if recording is None or len(recording) < 2:
        return dict.fromkeys((*_OWN, *_NAMES), "") | {"no.": number, "file": one.file}
    card, time = recording.card, recording.time
    rate, duration = with_unit(f"{recording.rate:.4g}", "Hz"), with_unit(f"{time[-1] - time[0]:.4g}", "s")
    length = f"average of {card.filter_length} samples" if card.filter_length > 1 else ""
    source = card.source if card.source != one.file else ""
    origin = source, card.needle, card.tissue, card.rig, length, card.assumptions
    known = card.sha256, _thousands(len(time)), rate, duration, *origin
    return {"no.": number, "file": one.file, **dict(zip(_NAMES, known))}


def _shared(files: list[dict]) -> dict[str, object]:
    """What is the same for all files: of one file everything but its name and hash."""
    apart = (*_OWN, "sha256", "samples")
    same = (name for name in _NAMES if name not in apart and len({file[name] for file in files}) == 1)
    return {name: files[0][name] for name in same if files[0][name]}


def _shown(name: str, value: object) -> object:
    if name == "file":
        return element("span", value, class_="file")
    if name == "sha256" and value:
        return element("code", value)
    return listing(value) if isinstance(value, tuple) and value else value or ""


def _definitions(pairs) -> Markup:
    rows = (join([element("dt", str(name).replace("_", " ")), element("dd", _value(value))]) for name, value in pairs)
    return element("dl", *rows)


def _value(value: object) -> object:
    if isinstance(value, (list, tuple)) and value:
        return listing(map(_value, value))
    return f"{value:.6g}" if isinstance(value, float) else "none" if value in (None, "", (), []) else str(value)


def _thousands(number: int) -> str:
    return f"{number:,}".replace(",", "\N{NARROW NO-BREAK SPACE}")
