# SPDX-License-Identifier: Apache-2.0
"""Quantities, statuses, phases and files in words, and the notes of recordings."""

import re
from collections.abc import Iterable, Sequence

from ...display.markup import Markup, element, join, listing
from ...mechanics.foundation import READINGS
from ..estimates import Estimate
from ..recording_fit import RecordingFit

IN_TABLES = "The values are in the tables of this page."
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
    "machine_stiffness": "stiffness of sensor, holder and drive in series with the needle",
    "contact_stiffness": "slope of the contact where it saturates or ruptures",
    "top": "top of the layer, below the surface",
    "tissue_stiffness": "stiffness of the dragged tissue",
    "rupture_length": "travel over which the rupture develops",
    "resting_surface": "surface at rest after the rupture, below the top of the layer",
    "relaxation_share_1": "share of the force that relaxes with the short time constant",
    "relaxation_share_2": "share of the force that relaxes with the long time constant",
    "relaxation_time_1": "short time constant of relaxation",
    "relaxation_time_2": "long time constant of relaxation",
    "speed_exponent": "exponent of the speed in all forces",
    "withdrawal_ratio": "friction on withdrawal over that on insertion",
} | {f"friction_coefficient_{reading}": f"friction coefficient, reading {reading}" for reading in READINGS}
_STATUS = {
    "ok": "identified",
    "no_contact": "no contact: the force stays at its baseline",
    "no_puncture": "contact, but no puncture",
    "incomplete": "incomplete: the recording ends within the cycle",
    "unreadable": "could not be read or fitted",
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


def notes(recordings: Sequence[RecordingFit]) -> Markup:
    """Notes of reading, segmentation and fits, in order; of notes that differ only in their values, the first."""
    similar: dict[str, dict[int, str]] = {}
    for k, one in enumerate(recordings, 1):
        for message in _notes_of(one):
            similar.setdefault(re.sub(r"-?\d[\d.e+-]*", "#", message), {}).setdefault(k, message)
    return listing((_noted(found, len(recordings)) for found in similar.values()), class_="notes")


def _notes_of(one: RecordingFit) -> dict[str, None]:
    """The different notes of one recording, in order."""
    read = one.recording.notes if one.recording is not None else ()
    return dict.fromkeys([*(note.message for note in read), *one.events.notes, *one.notes])


def _noted(found: dict[int, str], among: int) -> Markup:
    """A note with the recordings it applies to; if its values differ, also the recording whose values are shown."""
    first = next(iter(found))
    about = f"recording{'s' if len(found) > 1 else ''} {spans(found)}" if among > 1 else ""
    about += f", values of no. {first}" if len(set(found.values())) > 1 else ""
    return join([sentence(found[first]), element("span", about, class_="about") if about else ""])


def spans(numbers: Iterable[int]) -> str:
    """Numbers as ranges, such as ``1–3, 5``."""
    runs: list[list[int]] = []
    for number in sorted(numbers):
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    return ", ".join(str(run[0]) if len(run) == 1 else f"{run[0]}–{run[-1]}" for run in runs)


def sentence(text: str) -> str:
    """The text with a capital letter and a full stop."""
    text = text.strip()
    return text[:1].upper() + text[1:] + ("" if text.endswith((".", "!", "?")) else ".")
