# SPDX-License-Identifier: Apache-2.0
"""Names in words, the result in one sentence, and what to know before believing the values."""

import re
from collections.abc import Iterable, Iterator

from ..display.markup import Markup, element, join, listing
from ..display.quantities import counted, plain, quantity
from ..identification.estimates import Estimate
from ..identification.layered.result import LayeredFit
from ..identification.recording_fit import RecordingFit
from ..identification.result import Fit
from ..mechanics.foundation import READINGS

_QUANTITIES = {
    "contact_depth": "depth at which the needle meets the surface",
    "puncture_depth": "depth of the puncture",
    "puncture_indentation": "indentation at puncture",
    "puncture_force": "force at puncture",
    "stiffness_coefficient": "stiffness coefficient (force over indentation²)",
    "saturation_depth": "indentation at which the contact reaches the needle's radius",
    "reference_force": "force at an indentation of 1 mm",
    "exponent": "exponent of the loading curve",
    "linear": "stiffness at first contact",
    "quadratic": "coefficient of the indentation squared",
    "rate": "rate of the exponential loading curve",
    "scale": "force scale of the exponential loading curve",
    "reduced_modulus": "reduced modulus of needle and tissue",
    "tissue_young_modulus": "Young's modulus of the tissue",
    "needle_young_modulus": "Young's modulus of the needle",
    "friction_per_length": "friction per embedded length",
    "cutting_force": "cutting force",
    "cutting_force_low": "cutting force, lower end of its stick–slip oscillation",
    "cutting_force_high": "cutting force, upper end of its stick–slip oscillation",
    "cutting_force_low_1mm_s": "cutting force at 1 mm/s, lower end",
    "cutting_force_high_1mm_s": "cutting force at 1 mm/s, upper end",
    "implied_poisson_ratio": "implied Poisson ratio of the tissue",
    "presliding": "presliding: elastic travel before friction slides",
    "contact_stiffness": "slope of the contact where it saturates or ruptures",
    "top": "top of the layer, below the surface",
    "tissue_stiffness": "stiffness of the tissue that is dragged along",
    "rupture_length": "travel over which the rupture spreads",
    "resting_surface": "surface at rest after the rupture, below the layer's top",
    "relaxation_share_1": "share of the force that relaxes with the short time constant",
    "relaxation_share_2": "share of the force that relaxes with the long time constant",
    "speed_exponent": "exponent of the speed in all forces",
} | {f"friction_coefficient_{reading}": f"friction coefficient, reading {reading}" for reading in READINGS}
_STATUS = {
    "ok": "identified",
    "no_contact": "no contact: the force stays at its baseline",
    "no_puncture": "contact, but no puncture",
    "incomplete": "incomplete: the cycle was cut off",
    "unreadable": "could not be read",
}
_PHASES = {"free": "free travel", "deformation": "deformation", "insertion": "insertion", "hold": "hold",
           "extraction": "withdrawal"}  # fmt: skip


_DEEPER = re.compile(r"layer_(\d+)_(.+)")


def quantity_name(name: str) -> str:
    """A quantity in words; one not listed here has its own name, spelled out."""
    deeper = _DEEPER.fullmatch(name)
    if deeper:
        return f"{quantity_name(deeper[2])}, layer {deeper[1]}"
    return _QUANTITIES.get(name, name.replace("_", " "))


def by_layer(parameters: dict[str, Estimate]) -> dict[str, dict]:
    """The estimates by layer, each under its name within it; all under "" where there is no second layer."""
    if not any(map(_DEEPER.fullmatch, parameters)):
        return {"": parameters} if parameters else {}
    found: dict[str, dict] = {}
    for name, estimate in parameters.items():
        deeper = _DEEPER.fullmatch(name)
        layer = "all layers" if name.startswith(("relaxation_", "speed_")) else f"layer {deeper[1] if deeper else 1}"
        found.setdefault(layer, {})[deeper[2] if deeper else name] = estimate
    return found


def status_name(status: str) -> str:
    """What became of a recording."""
    return _STATUS.get(str(status), str(status).replace("_", " "))


def phase_name(phase: str) -> str:
    """A phase in words."""
    return _PHASES.get(str(phase), str(phase))


def file_name(path: str) -> str:
    """The last part of a path, on whatever system it was written."""
    return path.replace("\\", "/").rsplit("/", 1)[-1] or path


def outcome(fit: Fit) -> Markup:
    """The result in a sentence or two, with the main values."""
    answered = sum(1 for one in fit.recordings if len(one.predicted))
    if fit.model is None:
        reasons = ", ".join(sorted({status_name(one.status).split(":")[0] for one in fit.recordings}))
        read = counted(len(fit.recordings), "recording")
        return join([f"No model could be identified from {read}", f" ({reasons})." if reasons else "."])
    parts = (_layers(fit),) if isinstance(fit, LayeredFit) else (_puncture(fit), _beyond(fit))
    found = join([part for part in parts if part], "; ") or "a model was identified"
    found = Markup(found[0].upper() + found[1:] + ". ")
    return join([found, _quality(fit, answered)])


def _puncture(fit: Fit) -> Markup | None:
    depth, force = _strong(fit, "puncture_indentation"), _strong(fit, "puncture_force")
    if depth and force:
        return join(["the needle punctures the surface at ", force, " after indenting it by ", depth])
    if depth or force:
        return join(["the needle punctures the surface at ", depth or force])
    return None


def _layers(fit: Fit) -> Markup:
    """How many layers, and how deep the tip is where they rupture, which no recording may have reached."""
    surface, layers = fit.parameters["contact_depth"].value, by_layer(fit.parameters)
    broken = [e["puncture_depth"] for e in layers.values() if "puncture_depth" in e]
    known = [e for e in broken if e.identifiable]
    depths = [quantity(e.value - surface, e.low - surface, e.high - surface, e.unit, most=4).text for e in known]
    count = len(fit.model.layers)
    parts = [element("strong", counted(count, "layer")), " of tissue" + ", each with a part of the force" * (count > 1)]
    if known:
        *first, last = (element("strong", depth) for depth in depths)
        where = join([join(first, ", "), " and " * bool(first), last])
        some = "one of them ruptures" if len(known) == 1 else f"{len(known)} of them rupture"
        which = "it ruptures" if count == 1 else "they rupture" if len(known) == count else some
        parts += [f"; {which} with the tip ", where, " below the surface"]
    return join(parts)


def _beyond(fit: Fit) -> Markup | None:
    parts = (("friction grows by ", "friction_per_length"), ("cutting takes ", "cutting_force"))
    found = [join([words, value]) for words, value in ((words, _strong(fit, name)) for words, name in parts) if value]
    source = ", by the two passes" if fit.two_pass is not None else ""
    return join(["after it ", join(found, " and "), source]) if found else None


def _quality(fit: Fit, answered: int) -> Markup:
    of = f"{answered} of " * (answered < len(fit.recordings)) + counted(len(fit.recordings), "recording")
    if fit.quality is None:
        return join(["Identified from ", of, "."])
    rms, share = plain(fit.quality.rmse_N, "N", fit.quality.rmse_N), f"{100 * fit.quality.nrmse:.2g}\N{NO-BREAK SPACE}%"
    follows = f"Over {of} the model follows the measured force to "
    return join([follows, element("strong", rms), f" rms, {share} of its peak."])


def _strong(fit: Fit, name: str) -> Markup | None:
    """The value of an estimate in bold, or None where the recordings do not identify it."""
    estimate = fit.parameters.get(name)
    if estimate is None or not estimate.identifiable:
        return None
    return element("strong", quantity(estimate.value, estimate.low, estimate.high, estimate.unit, most=4).text)


def warnings(fit: Fit) -> Markup:
    """Recordings without a model, with the reason; limits that the fit and its model cross."""
    general = dict.fromkeys([*fit.warnings, *(fit.model.warnings if fit.model is not None else ())])
    found = [*_unanswered(fit), *map(_sentence, general)]
    return listing(found, class_="warnings") if found else Markup("")


def notes(fit: Fit) -> Markup:
    """Notes of reading, segmentation and fits, in order; of notes that differ only in their values the first."""
    similar: dict[str, dict[int, str]] = {}
    for k, one in enumerate(fit.recordings, 1):
        for message in _notes_of(one):
            similar.setdefault(re.sub(r"-?\d[\d.e+-]*", "#", message), {}).setdefault(k, message)
    shown = [_noted(found, len(fit.recordings)) for found in similar.values()]
    return listing(shown, class_="notes") if shown else Markup("")


def _unanswered(fit: Fit) -> Iterator[Markup]:
    """Every recording without a model, with the reason."""
    for k, one in enumerate(fit.recordings, 1):
        if not len(one.predicted):
            reason = status_name(one.status) if str(one.status) != "ok" else "not used for the model"
            yield join([element("strong", f"Recording {k} has no model. "), f"{file_name(one.file)}: {reason}."])


def _notes_of(one: RecordingFit) -> dict[str, None]:
    read = one.recording.notes if one.recording is not None else ()
    return dict.fromkeys([*(note.message for note in read), *one.events.notes, *one.notes])


def _noted(found: dict[int, str], among: int) -> Markup:
    """A note by recording number, with the recordings it holds for; whose numbers are shown, where they differ."""
    first = next(iter(found))
    about = f"recording{'s' if len(found) > 1 else ''} {spans(found)}" if among > 1 else ""
    about += f", values of no. {first}" if len(set(found.values())) > 1 else ""
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
