# SPDX-License-Identifier: Apache-2.0
"""What to know before believing the numbers: warnings, and notes, each said once with the recordings it is about."""

import re
from collections.abc import Iterable

from .markup import Markup, element, join, listing
from .words import file_name, status_name


def warnings(fit) -> Markup:
    """Recordings that could not answer, with the reason; limits that the fit and its model cross."""
    general = dict.fromkeys([*fit.warnings, *(fit.model.warnings if fit.model is not None else ())])
    said = [*_unanswered(fit), *map(_sentence, general)]
    return listing(said, class_="warnings") if said else Markup("")


def notes(fit) -> Markup:
    """What readers, segmentation and fits noticed, in order; of notes that differ in their numbers alone the first."""
    alike: dict[str, dict[int, str]] = {}
    for k, one in enumerate(fit.recordings, 1):
        for message in _notes_of(one):
            alike.setdefault(re.sub(r"-?\d[\d.e+-]*", "#", message), {}).setdefault(k, message)
    said = [_noted(found, len(fit.recordings)) for found in alike.values()]
    return listing(said, class_="notes") if said else Markup("")


def _unanswered(fit):
    """Every recording without a model, with the reason."""
    for k, one in enumerate(fit.recordings, 1):
        if not len(one.predicted):
            reason = status_name(one.status) if str(one.status) != "ok" else "not used for the model"
            yield join([element("strong", f"Recording {k} has no model. "), f"{file_name(one.file)}: {reason}."])


def _notes_of(one) -> dict[str, None]:
    read = one.recording.notes if one.recording is not None else ()
    return dict.fromkeys([*(note.message for note in read), *one.events.notes, *one.notes])


def _noted(found: dict[int, str], among: int) -> Markup:
    """A note by recording number, with the recordings it holds for; whose numbers are shown, where they differ."""
    first = next(iter(found))
    about = f"recording{'s' if len(found) > 1 else ''} {spans(found)}" if among > 1 else ""
    about += f", numbers as in no. {first}" if len(set(found.values())) > 1 else ""
    return join([_sentence(found[first]), element("span", about, class_="about") if about else ""])


def spans(numbers: Iterable[int]) -> str:
    """``1–3, 5``."""
    runs: list[list[int]] = []
    for number in sorted(numbers):
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    return ", ".join(str(run[0]) if len(run) == 1 else f"{run[0]}–{run[-1]}" for run in runs)


def _sentence(text: str) -> str:
    """With a capital and a full stop, whoever wrote it."""
    text = text.strip()
    return text[:1].upper() + text[1:] + ("" if text.endswith((".", "!", "?")) else ".")
