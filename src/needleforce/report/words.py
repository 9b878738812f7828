# SPDX-License-Identifier: Apache-2.0
"""Quantities in words, the result in one sentence, warnings and notes."""

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
    "contact_depth": "contact depth: depth of the surface",
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
    "settlement_ratio": "settlement of the foundation over that at which it bends",
    "deflection_length": "length over which the shaft's offset grows to the settlement",
    "friction_bend": "departure of the friction from a line at the deepest point",
    "cutting_force": "cutting force",
    "cutting_force_low": "cutting force, lower end of its stick–slip oscillation",
    "cutting_force_high": "cutting force, upper end of its stick–slip oscillation",
    "cutting_force_low_1mm_s": "cutting force at 1 mm/s, lower end",
    "cutting_force_high_1mm_s": "cutting force at 1 mm/s, upper end",
    "implied_poisson_ratio": "implied Poisson ratio of the tissue",
    "presliding": "presliding: elastic travel before friction slides",
    "contact_stiffness": "slope of the contact where it saturates or ruptures",
    "top": "top of the layer, below the surface",
    "tissue_stiffness": "stiffness of the dragged tissue",
    "rupture_length": "travel over which the rupture develops",
    "resting_surface": "surface at rest after the rupture, below the top of the layer",
    "relaxation_share_1": "share of the force that relaxes with the short time constant",
    "relaxation_share_2": "share of the force that relaxes with the long time constant",
    "speed_exponent": "exponent of the speed in all forces",
    "withdrawal_ratio": "friction on withdrawal over that on insertion",
} | {f"friction_coefficient_{reading}": f"friction coefficient, reading {reading}" for reading in READINGS}
_STATUS = {
    "ok": "identified",
    "no_contact": "no contact: the force stays at its baseline",
    "no_puncture": "contact, but no puncture",
    "incomplete": "incomplete: the recording ends within the cycle",
    "unreadable": "could not be read",
}
_PHASES = {"free": "free travel", "deformation": "deformation", "insertion": "insertion", "hold": "hold",
           "extraction": "withdrawal"}  # fmt: skip


_DEEPER = re.compile(r"layer_(\d+)_(.+)")


def quantity_name(name: str) -> str:
    """A quantity in words; one that is not listed above has its own name, with spaces."""
    deeper = _DEEPER.fullmatch(name)
    if deeper:
        return f"{quantity_name(deeper[2])}, layer {deeper[1]}"
    return _QUANTITIES.get(name, name.replace("_", " "))


def by_layer(parameters: dict[str, Estimate]) -> dict[str, dict]:
    """The estimates by layer, under their names within the layer; all under "" without a second layer."""
    if not any(map(_DEEPER.fullmatch, parameters)):
        return {"": parameters} if parameters else {}
    found: dict[str, dict] = {}
    for name, estimate in parameters.items():
        deeper = _DEEPER.fullmatch(name)
        layer = "all layers" if name.startswith(("relaxation_", "speed_")) else f"layer {deeper[1] if deeper else 1}"
        found.setdefault(layer, {})[deeper[2] if deeper else name] = estimate
    return found


def status_name(status: str) -> str:
    """A status of a recording in words."""
    return _STATUS.get(str(status), str(status).replace("_", " "))


def phase_name(phase: str) -> str:
    """A phase in words."""
    return _PHASES.get(str(phase), str(phase))


def file_name(path: str) -> str:
    """The last part of a path of any operating system."""
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


def which_values(fit: Fit) -> str:
    """Why values of the headline differ from those in tables and figures; empty without a model."""
    if fit.model is None:
        return ""
    if isinstance(fit, LayeredFit):
        contact = fit.parameters["contact_depth"]
        known = "" if contact.identifiable else ", which is not identifiable here"
        return (
            f"The depths above, in the order of the layers, are relative to the fitted contact depth{known}; depths in "
            "the tables are in the zero of the recordings. Events are detected punctures, not ruptures of layers."
        )
    several, peak = len(fit.recordings) > 1, fit.parameters.get("puncture_force")
    means = "The values above are means over the repeats; t" if several else "T"
    own = "he table of recordings has each recording's own fit" + ", without the second pass" * bool(fit.two_pass) + "."
    force = " The puncture force is measured just before the puncture; the model's force there can differ."
    measured = peak is not None and peak.source.startswith("measured")
    return (means + own) * (several or bool(fit.two_pass)) + force * measured


def _puncture(fit: Fit) -> Markup | None:
    """Indentation and force at the puncture, as far as they are identified."""
    depth, force = _strong(fit, "puncture_indentation"), _strong(fit, "puncture_force")
    if depth and force:
        return join(["the needle punctures the surface at a force of ", force, " and an indentation of ", depth])
    if depth or force:
        return join(["the needle punctures the surface at ", depth or force])
    return None


def _layers(fit: LayeredFit) -> Markup:
    """The number of layers, and the depths of their ruptures, which the recordings may not have reached."""
    surface, layers = fit.parameters["contact_depth"].value, by_layer(fit.parameters)
    broken = [e["puncture_depth"] for e in layers.values() if "puncture_depth" in e]
    known = [e for e in broken if e.identifiable]
    depths = [quantity(e.value - surface, e.low - surface, e.high - surface, e.unit, max_digits=4).text for e in known]
    count = len(fit.model.layers)
    sentence = [element("strong", counted(count, "layer")), " of tissue" + ", whose forces add up" * (count > 1)]
    if known:
        *first, last = (element("strong", depth) for depth in depths)
        where = join([join(first, ", "), " and " * bool(first), last])
        some = "one of them ruptures" if len(known) == 1 else f"{len(known)} of them rupture"
        which = "it ruptures" if count == 1 else "they rupture" if len(known) == count else some
        sentence += [f"; {which} with the tip ", where, " below the surface"]
    return join(sentence)


def _beyond(fit: Fit) -> Markup | None:
    """Friction and cutting force after the puncture, as far as they are identified."""
    friction, cutting = _strong(fit, "friction_per_length"), _strong(fit, "cutting_force")
    found = [join(["the friction per embedded length is ", friction])] if friction else []
    found += [join(["the cutting force is ", cutting])] if cutting else []
    source = " (both from the two passes)" if len(found) == 2 else " (from the two passes)"
    return join([join(found, " and "), source if fit.two_pass is not None else ""]) if found else None


def _quality(fit: Fit, answered: int) -> Markup:
    """The residual of the model, over the recordings that have one."""
    count = f"{answered} of " * (answered < len(fit.recordings)) + counted(len(fit.recordings), "recording")
    if fit.quality is None:
        return join(["Identified from ", count, "."])
    rms, share = plain(fit.quality.rmse_N, "N", fit.quality.rmse_N), f"{100 * fit.quality.nrmse:.2g}\N{NO-BREAK SPACE}%"
    text = f"The residual of the model over {count} is "
    return join([text, element("strong", rms), f" rms, {share} of the peak force."])


def _strong(fit: Fit, name: str) -> Markup | None:
    """The value of an estimate in bold, or None if it is not identifiable."""
    estimate = fit.parameters.get(name)
    if estimate is None or not estimate.identifiable:
        return None
    return element("strong", quantity(estimate.value, estimate.low, estimate.high, estimate.unit, max_digits=4).text)


def warnings(fit: Fit) -> Markup:
    """Recordings without a model, with the reason; limits that the fit and its model exceed."""
    general = dict.fromkeys([*fit.warnings, *(fit.model.warnings if fit.model is not None else ())])
    found = [*_unanswered(fit), *map(_sentence, general)]
    return listing(found, class_="warnings") if found else Markup("")


def notes(fit: Fit) -> Markup:
    """Notes of reading, segmentation and fits, in order; of notes that differ only in their values, the first."""
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
    """The different notes of one recording, in order."""
    read = one.recording.notes if one.recording is not None else ()
    return dict.fromkeys([*(note.message for note in read), *one.events.notes, *one.notes])


def _noted(found: dict[int, str], among: int) -> Markup:
    """A note with the recordings it applies to; if its values differ, also the recording whose values are shown."""
    first = next(iter(found))
    about = f"recording{'s' if len(found) > 1 else ''} {spans(found)}" if among > 1 else ""
    about += f", values of no. {first}" if len(set(found.values())) > 1 else ""
    return join([_sentence(found[first]), element("span", about, class_="about") if about else ""])


def spans(numbers: Iterable[int]) -> str:
    """Numbers as ranges, such as ``1–3, 5``."""
    runs: list[list[int]] = []
    for number in sorted(numbers):
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    return ", ".join(str(run[0]) if len(run) == 1 else f"{run[0]}–{run[-1]}" for run in runs)


def _sentence(text: str) -> str:
    """The text with a capital letter and a full stop."""
    text = text.strip()
    return text[:1].upper() + text[1:] + ("" if text.endswith((".", "!", "?")) else ".")
