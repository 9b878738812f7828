# SPDX-License-Identifier: Apache-2.0
"""The quantities of a recording, and the headers by which they and their units are recognised."""

import re
import unicodedata
from collections.abc import Callable, Sequence
from functools import lru_cache

from ..errors import InputError
from ..units import find

# quantity: its dimension, and the header names that are recognised, as normalised by _plain(): English, then German,
# French, Spanish, Italian, and names of instruments
QUANTITIES = {
    "time": (
        "time",
        "time t timestamp time_stamp stamp header_stamp elapsed elapsed_time test_time run_time total_time sample_time "
        "seconds millis milliseconds msec ms micros microseconds usec sekunden "
        "zeit laufzeit prufzeit pruefzeit temps tiempo tempo",
    ),
    "depth": (
        "length",
        "depth insertion_depth needle_depth tip_depth penetration penetration_depth indentation "
        "indentation_depth pd z pz p_z pos_z position_z z_position z_pos position pos tip_position "
        "stage_position displacement axial_displacement displ disp travel stroke distance extension ext "
        "crosshead crosshead_position crosshead_extension crosshead_displacement "
        "weg standardweg traversenweg prufweg pruefweg tiefe eindringtiefe eindringweg verschiebung hub "
        "deplacement profondeur enfoncement course allongement desplazamiento profundidad posicion carrera "
        "spostamento profondita posizione corsa",
    ),
    "velocity": (
        "velocity",
        "velocity vel vz v_z velocity_z insertion_velocity speed insertion_speed "
        "geschwindigkeit vitesse velocidad velocita",
    ),
    "force": (
        "force",
        "force fz f_z force_z axial_force force_axial needle_force insertion_force f fn f_n "
        "normal_force load axial_load compressive_load compression_load load_cell load_cell_force "
        "standard_force kraft standardkraft prufkraft pruefkraft last effort force_axiale charge fuerza "
        "carga forza carico",
    ),
    "fx": ("force", "fx f_x force_x"),
    "fy": ("force", "fy f_y force_y"),
    "tx": ("torque", "tx t_x torque_x mx m_x moment_x"),
    "ty": ("torque", "ty t_y torque_y my m_y moment_y"),
    "tz": ("torque", "tz t_z torque_z mz m_z moment_z"),
    "stiffness": ("force", "stiffness"),
    "friction": ("force", "friction"),
    "cutting": ("force", "cutting"),
}
MAIN, AXES = tuple(QUANTITIES)[:4], tuple(QUANTITIES)[4:]
_NAMES = {name: quantity for quantity, (_, names) in QUANTITIES.items() for name in names.split()}
_IN_BRACKETS = re.compile(r"(.*?)[\s_]*[\[(]\s*([^\])]+?)\s*[\])]\s*")
_AFTER_SLASH = re.compile(r"(.*?)\s+(?:/|in)\s+(\S+)\s*")
_AFTER_COMMA = re.compile(r"(.*?),\s*(\S+)\s*")
_NUMBERED = re.compile(r"(.*?)[_.]?\d+")


NAMED_BY_WORD = {
    "time": "time zeit temps tiempo tempo stamp timestamp timestamps",
    "depth": "depth position displacement extension travel indentation penetration crosshead weg tiefe deplacement "
             "profondeur desplazamiento profundidad spostamento profondita posizione",
    "force": "force load kraft standardkraft effort fuerza carga forza fz",
}  # fmt: skip
_LATE_WORDS = "deformation verformung eindruckung gap spalt spaltweite messspalt"
_TIME_WORDS = frozenset("t time stamp timestamp zeit temps tiempo tempo".split())
# words that make another quantity of a header, such as a target, an error or a rate
OTHER_WORDS = frozenset(
    "rate speed velocity energy work error sd std max min mean average peak target set setpoint command "
    "commanded desired ratio strain stress offset x y transverse lateral geschwindigkeit soll".split()
)
_RATIOS = ("%", "percent", "prozent", "mm/mm", "m/m", "in/in")
UNIT_DIMENSIONS = ("time", "length", "velocity", "force", "torque", "angle")


def dimension(quantity: str) -> str:
    """The dimension of a quantity: time, length, velocity, force or torque."""
    return QUANTITIES[quantity][0]


def check_known(quantity: str) -> None:
    """Raise InputError for a name that is not a quantity of a recording."""
    if quantity not in QUANTITIES:
        known = f"known are {', '.join(QUANTITIES)}"
        raise InputError("quantity", repr(quantity), known, next_step="Give one of these.")


def is_unit(text: str) -> bool:
    """Whether a text is a unit of a quantity of a recording, or of a ratio, in which none is read."""
    return text.casefold() in _RATIOS or any(find(text, each) for each in UNIT_DIMENSIONS)


@lru_cache(4096)
def split(header: str, known: Callable[[str], bool] = is_unit) -> tuple[str, str | None]:
    """Split a header into name and unit: ``Force [N]``, ``time_us``, ``Weg (mm)``, ``F / N``, ``Fz, gf``.

    ``known`` is whether a text is a unit that may follow a comma or ``_``.
    """
    plain = " ".join(header.split())  # runs of blanks would take the expressions a time with their cube
    after_comma = _AFTER_COMMA.fullmatch(plain)
    if after_comma and known(after_comma[2].strip("[]()")):
        return after_comma[1], after_comma[2].strip("[]()")
    bracketed = _IN_BRACKETS.fullmatch(plain) or _AFTER_SLASH.fullmatch(plain)
    if bracketed and (known(bracketed[2]) or _NAMES.get(plain_name(plain)) is None):
        return bracketed[1], bracketed[2]
    parts = header.split("_")
    for cut in range(1, len(parts)):
        name, suffix = "_".join(parts[:cut]), "_".join(parts[cut:])
        if parts[cut].isdecimal() and cut + 1 < len(parts):  # the number of a channel
            continue
        quantity = _NAMES.get(plain_name(name))
        if suffix in _RATIOS or (find(suffix, dimension(quantity)) if quantity else known(suffix)):
            return name, suffix
    names_unit = _NAMES.get(plain_name(header)) == "time" and find(header, "time")
    return header, header.strip() if names_unit else None


def by_name(header: str) -> str | None:
    """The quantity of a header by its whole name."""
    return _NAMES.get(plain_name(split(header)[0]))


def by_numbered_name(header: str) -> str | None:
    """The quantity of a header whose name ends with a number, as that of a specimen: ``Load 2``."""
    numbered = _NUMBERED.fullmatch(plain_name(split(header)[0]))
    return _NAMES.get(numbered[1]) if numbered else None


def by_word(header: str) -> str | None:
    """Time, depth or force, by one word of a header: ``Compressive load 5 kN cell``; None if another word makes it a
    different quantity, such as a rate, or if words of several are in it."""
    ordered = plain_name(split(header)[0]).split("_")
    words = set(ordered)
    if _is_time_of_another(ordered):
        return "time"
    found = [quantity for quantity, names in NAMED_BY_WORD.items() if words & set(names.split())]
    return found[0] if len(found) == 1 and not words & OTHER_WORDS else None


def _is_time_of_another(words: Sequence[str]) -> bool:
    """Whether words are those of the times of a quantity: ``force_time``, ``t_pos``."""
    if len(words) < 2 or not _TIME_WORDS & {words[0], words[-1]}:
        return False
    rest = words[1:] if words[0] in _TIME_WORDS else words[:-1]
    return _NAMES.get("_".join(rest)) in ("depth", "velocity", "force")


def by_late_word(header: str) -> str | None:
    """Depth, of a header such as ``Deformation`` or ``Gap`` that has no ratio as its unit; only where no other column
    is a depth."""
    name, unit = split(header)
    words = set(plain_name(name).split("_"))
    fits = not unit or find(unit, dimension("depth"))
    return "depth" if words & set(_LATE_WORDS.split()) and fits and not words & OTHER_WORDS else None


RECOGNISED = {"name": by_name, "numbered name": by_numbered_name, "word": by_word, "late word": by_late_word}
"""How a header is recognised, the surest way first."""


def names_quantity(header: str) -> bool:
    """Whether a header, or a unit apart from it, is one of a recording."""
    unit = split(header)[1] or header
    return is_unit(unit) or any(each(header) for each in RECOGNISED.values())


@lru_cache(4096)
def plain_name(name: str) -> str:
    """A name in lower case without accents, its words joined by ``_``."""
    letters = "".join(each for each in unicodedata.normalize("NFKD", name) if not unicodedata.combining(each))
    return re.sub(r"[\W_]+", "_", letters.casefold()).strip("_")
