# SPDX-License-Identifier: Apache-2.0
"""Recordings identified, or models compared on them, in a process of its own, which the server can end.

``python -m needleforce.studio.recording_process`` runs in a folder with the files and ``request.json``. It writes
``files.json`` when the files are read, then ``result.json`` and ``report.html``, and prints a line for each step.
"""

import json
import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from ..errors import InputError
from ..files import atomic_write, json_safe
from ..recording.look import column_looks, used_quantities
from ..recording.options import ReadOptions
from ..recording.reader import RecordingFile, open_file
from .reading_choices import FileChoices
from .recording_jobs import FILES, REPORT, REQUEST, RESULT, Request

if TYPE_CHECKING:
    from ..recording import Recording

OPTION = re.compile(r"--[a-z]")  # of a message that the panel of the file answers
LIKELY = re.compile(r"--column '?(\w+)=(\d+)")  # what it proposes


@dataclass(kw_only=True)
class Source:
    """A recording of the file with this number: its part, the options that read it, and itself or why there is none."""

    file: int
    part: str | int | None
    reading: ReadOptions
    found: "Recording | InputError"

    @property
    def name(self) -> str:
        """The name of the recording in its file, of a file with several."""
        return "" if isinstance(self.found, InputError) else self.found.card.part


def main() -> None:
    """Do what is asked; what is wrong with it is written as a sentence."""
    request = msgspec.json.decode(Path(REQUEST).read_bytes(), type=Request)
    try:
        result = _result(request)
    except InputError as error:
        result = {"error": _without_folder(error)}
    except MemoryError:
        result = {"error": "The memory of this computer is not sufficient for these files."}
    _write(RESULT, result)


def _without_folder(error: InputError) -> str:
    """The page names no folder of the server."""
    return str(error).replace(f"{Path.cwd()}{os.sep}", "")


def _write(name: str, document: dict[str, Any]) -> None:
    with atomic_write(name) as target:
        json.dump(json_safe(document), target)


def progress(items: Iterable, text: str) -> Iterator:
    """The items, with a line on each."""
    listed = list(items)
    for k, item in enumerate(listed, 1):
        print(f"{text} {k} of {len(listed)}" if len(listed) > 1 else text, flush=True)
        yield item


def _result(request: Request) -> dict[str, Any]:
    asked = request.choices
    motions = {each.motion for each in asked.files if each.motion}
    sources, shown = [], []
    for number, each in enumerate(progress(asked.files, "reading")):
        if each.key in motions:
            shown.append({"state": "motion", "problem": "", "columns": [], "parts": []})
            continue
        own, looked = _read(number, each)
        sources += own
        shown.append(looked)
    remarks = _screen(sources)
    for number, each in enumerate(shown):
        _put_state(each, [one for one in sources if one.file == number])
    _write(FILES, {"files": shown})
    used = [each for each in sources if not isinstance(each.found, InputError)]
    found = _compared(used, request) if asked.task == "compare" else _identified(used, sources, request)
    return found | {"files": shown, "remarks": remarks}


def _read(number: int, asked: FileChoices) -> tuple[list[Source], dict[str, Any]]:
    """The recordings of a file, and its columns with the quantity that each is read as."""
    reading = asked.reading()
    try:
        opened = open_file(asked.key, reading)
        parts = [None] if reading.part is None else [part for part, _ in opened.chosen()]
    except InputError as error:
        return [Source(file=number, part=None, reading=reading, found=error)], {"columns": [], "parts": []}
    sources = [Source(file=number, part=each, reading=reading, found=_one(opened, each, asked)) for each in parts]
    return sources, _look(opened, parts[0])


def _one(opened: RecordingFile, part: str | int | None, asked: FileChoices) -> "Recording | InputError":
    try:
        recording = opened.read(part)[0]
        given = asked.events.get(recording.card.part)
        return recording if given is None else recording.with_events(**msgspec.structs.asdict(given))
    except InputError as error:
        return error


def _look(opened: RecordingFile, part: str | int | None) -> dict[str, Any]:
    try:
        shown = opened.named(part) if part is not None else next(iter(opened.parts), None)
    except InputError:
        shown = next(iter(opened.parts), None)
    looks = () if shown is None else column_looks(shown, used_quantities(opened.options))
    return {
        "parts": [each.name for each in opened.parts],
        "tables": [each.name for each in opened.tables],
        "columns": [{name: getattr(each, name) for name in ("header", "unit", "quantity", "head")} for each in looks],
    }


def _screen(sources: list[Source]) -> list[str]:
    """Leave out recordings with invalid values if others remain, as the command does; sentences on the others."""
    from ..campaign.checks import invalid_recordings

    readable = [each for each in sources if not isinstance(each.found, InputError)]
    named = {each.found.place: each for each in readable}
    invalid, remarks = invalid_recordings([(name, each.found) for name, each in named.items()])
    if len(invalid) < len(named):
        for name, anomaly in invalid.items():
            named[name].found = InputError("recording", "left out of the fit", anomaly.sentence.removesuffix("."), name)
    return remarks


def _put_state(shown: dict[str, Any], own: list[Source]) -> None:
    """What has become of a file: used, partly, or not, with the reason."""
    if "state" in shown:
        return
    problems = [each.found for each in own if isinstance(each.found, InputError)]
    shown["state"] = "used" if len(problems) < len(own) else "unread"
    shown["problem"] = _without_folder(problems[0]) if problems else ""
    shown["answered"] = any(OPTION.search(each.next_step) for each in problems)
    shown["likely"] = dict(LIKELY.findall(problems[0].next_step)) if problems else {}
    recordings = [each.found for each in own if not isinstance(each.found, InputError)]
    shown["assumed"] = list(dict.fromkeys(sentence for each in recordings for sentence in each.card.assumptions))


def _options(request: Request) -> dict[str, Any]:
    asked = request.choices
    return {"needle": asked.needle or None} | ({} if asked.task == "compare" else {"model": asked.model or None})


def _sources(used: list[Source], names: dict[str, str], files: list[FileChoices]) -> list[tuple]:
    """The names, options and events of recordings, for a script."""
    found = []
    for each in used:
        reading = replace(each.reading, part=each.part, motion=names.get(each.reading.motion))
        found.append((names[files[each.file].key], reading, each.found.card.given_events))
    return found


def _identified(used: list[Source], sources: list[Source], request: Request) -> dict[str, Any]:
    from ..identification import identify
    from ..identification.result import with_unreadable
    from .identified import exports_of, script_of, shown_fit

    options, files = _options(request), request.choices.files
    left = [each for each in sources if isinstance(each.found, InputError)]
    recordings = [each.found for each in used]
    fit = identify(recordings, progress=progress, **options) if recordings else None
    fit = with_unreadable(fit, [(files[each.file].key, each.found) for each in left])
    if not recordings:
        return {}
    print("writing the report", flush=True)
    fit.report(REPORT)
    script = script_of(_sources(used, request.names, files), "identify", options)
    shown = shown_fit(fit)
    for each, one in zip(shown["recordings"], used + left):
        each |= {"file": one.file, "part": one.name}
    return shown | {"exports": exports_of(fit, script)}


def _compared(used: list[Source], request: Request) -> dict[str, Any]:
    from ..identification import compare
    from .identified import script_of, shown_comparison

    if not used:
        return {}
    options, files = _options(request), request.choices.files
    rows = compare([each.found for each in used], progress=progress, **options)
    print("writing the report", flush=True)
    rows.report(REPORT, files=[files[each.file].key for each in used])
    script = script_of(_sources(used, request.names, files), "compare", options)
    return {"compared": shown_comparison(rows), "exports": {"json": rows.to_json(), "py": script}}


if __name__ == "__main__":
    main()
