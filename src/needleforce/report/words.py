# SPDX-License-Identifier: Apache-2.0
"""Names in words, the result in one sentence, and what to know before believing the values."""

import re
from collections.abc import Iterable

from ..display.markup import Markup, element, join, listing
from ..display.quantities import counted, plain, quantity
from ..identification.layered.result import LayeredFit
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
    "cutting_force_low": "cutting force, trough where it sticks and slips",
    "cutting_force_high": "cutting force, crest where it sticks and slips",
    "cutting_force_low_1mm_s": "cutting force at 1 mm/s, lower end",
    "cutting_force_high_1mm_s": "cutting force at 1 mm/s, upper end",
    "implied_poisson_ratio": "implied Poisson ratio of the tissue",
    "presliding": "elastic travel of the friction before it slides",
    "contact_stiffness": "slope of the contact where it saturates or gives way",
    "top": "top of the layer, below the surface",
    "tissue_stiffness": "stiffness of the tissue dragged along",
    "rupture_length": "travel over which the rupture spreads",
    "resting_surface": "surface at rest after the rupture, below the layer's top",
    "relaxation_share_1": "share of the force that relaxes soon",
    "relaxation_share_2": "share of the force that relaxes late",
    "speed_exponent": "power of the speed by which all forces go",
} | {f"friction_coefficient_{reading}": f"friction coefficient, reading {reading}" for reading in READINGS}
_STATUS = {
    "ok": "identified",
    "no_contact": "no contact: the force never leaves its baseline",
    "no_puncture": "contact, but no puncture",
    "incomplete": "incomplete: the cycle does not come to its end",
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


def by_layer(parameters: dict) -> dict[str, dict]:
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


def outcome(fit) -> Markup:
    """One sentence or two in plain words, with the main numbers."""
    answered = sum(1 for one in fit.recordings if len(one.predicted))
    if fit.model is None:
        reasons = ", ".join(sorted({status_name(one.status).split(":")[0] for one in fit.recordings}))
        read = counted(len(fit.recordings), "recording")
        return join([f"No model could be identified from {read}", f" ({reasons})." if reasons else "."])
    parts = (_layers(fit),) if isinstance(fit, LayeredFit) else (_puncture(fit), _beyond(fit))
    said = join([part for part in parts if part], "; ") or "a model was identified"
    said = Markup(said[0].upper() + said[1:] + ". ")
    return join([said, _quality(fit, answered)])


def _puncture(fit) -> Markup | None:
    depth, force = _strong(fit, "puncture_indentation"), _strong(fit, "puncture_force")
    if depth and force:
        return join(["the needle breaks through the surface under ", force, " after indenting it by ", depth])
    if depth or force:
        return join(["the needle breaks through the surface at ", depth or force])
    return None


def _layers(fit) -> Markup:
    """How many layers, and how deep the tip is where they give way, which no recording may have reached."""
    surface, layers = fit.parameters["contact_depth"].value, by_layer(fit.parameters)
    broken = [e["puncture_depth"] for e in layers.values() if "puncture_depth" in e]
    known = [e for e in broken if e.identifiable]
    depths = [quantity(e.value - surface, e.low - surface, e.high - surface, e.unit, most=4).text for e in known]
    count = len(fit.model.layers)
    said = [element("strong", counted(count, "layer")), " of tissue" + ", with a share of the force each" * (count > 1)]
    if known:
        *first, last = (element("strong", depth) for depth in depths)
        where = join([join(first, ", "), " and " * bool(first), last])
        some = "one of them gives" if len(known) == 1 else f"{len(known)} of them give"
        which = "it gives" if count == 1 else "they give" if len(known) == count else some
        said += [f"; {which} way with the tip ", where, " below the surface"]
    return join(said)


def _beyond(fit) -> Markup | None:
    parts = (("friction grows by ", "friction_per_length"), ("cutting takes ", "cutting_force"))
    said = [join([words, number]) for words, number in ((words, _strong(fit, name)) for words, name in parts) if number]
    return join(["deeper in, ", join(said, " and ")]) if said else None


def _quality(fit, answered: int) -> Markup:
    of = f"{answered} of " * (answered < len(fit.recordings)) + counted(len(fit.recordings), "recording")
    if fit.quality is None:
        return join(["Identified from ", of, "."])
    rms, share = plain(fit.quality.rmse_N, "N", fit.quality.rmse_N), f"{100 * fit.quality.nrmse:.2g}\N{NO-BREAK SPACE}%"
    follows = f"Over {of} the model follows the measured force to "
    return join([follows, element("strong", rms), f" rms, {share} of its peak."])


def _strong(fit, name: str) -> Markup | None:
    """The number of an estimate in bold, or None where the logs do not tell it."""
    estimate = fit.parameters.get(name)
    if estimate is None or not estimate.identifiable:
        return None
    return element("strong", quantity(estimate.value, estimate.low, estimate.high, estimate.unit, most=4).text)


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
