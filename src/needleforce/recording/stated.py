# SPDX-License-Identifier: Apache-2.0
"""What a file states apart from its columns, above its table or next to its arrays: rate, speed and units."""

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from ..units import DIMENSIONS, find
from .quantities import NAMED_BY_WORD, dimension, plain_name
from .table import Table

_MAX_CHARS = 200  # of a line that states a value
_MAX_WORDS = 6  # of the name of a value
_SHOWN_CHARS = 60
_TOLERANCE = 1e-6  # of a value: two statements that differ by less agree
_USUAL_RATES_HZ = (9.0, 20e3)  # of a number without a unit: those of ``unit_guess``
_EDGES = " \t\r\n#%*\"'<>|"
_SEPARATORS = re.compile(r"[:=;,\t|]+")
_VALUE = re.compile(r"(?<![\w.+-])(?<!\d,)[+-]?(?:\d[\d.,]*|\.\d+)(?:[eE][+-]?\d+)?")
_BRACKETED = re.compile(r"(.*?)[\[(]([^\])]*)[\])][\s\"']*")
_OWN_ENTRIES = ("assumption:", "note:", "needle:", "tissue:", "rig:", "origin:")  # of a card
_FREQUENCIES = {
    "hz": 1.0, "hertz": 1.0, "khz": 1e3, "1/s": 1.0, "s-1": 1.0, "s^-1": 1.0, "sps": 1.0, "s/s": 1.0, "sa/s": 1.0,
    "ks/s": 1e3, "samples/s": 1.0, "samples/sec": 1.0, "samples/second": 1.0, "samplespersecond": 1.0,
    "points/s": 1.0, "points/sec": 1.0, "pts/s": 1.0, "scans/s": 1.0,
}  # fmt: skip
# names without blanks and accents: English, German, French, Spanish, Italian, and names of programs
_RATES = frozenset(
    "fs fsample fsampling fsamp samplerate samplingrate samplefrequency samplingfrequency samplefreq samplingfreq "
    "datarate dataacquisitionrate acquisitionrate acquisitionfrequency scanrate samplespersecond sps lograte "
    "loggingrate recordingrate rate abtastrate abtastfrequenz messrate messfrequenz aufzeichnungsrate "
    "frequencedechantillonnage frequenceechantillonnage frequencedacquisition frecuenciademuestreo tasademuestreo "
    "frequenzadicampionamento".split()
)
_STEPS = frozenset(
    "dt deltat sampleinterval samplinginterval sampleperiod samplingperiod sampletime samplingtime timestep "
    "timeincrement timeinterval wfincrement loginterval logginginterval datainterval acquisitioninterval scaninterval "
    "ts tsample abtastintervall abtastzeit abtastperiode messintervall zeitschritt pasdetemps periodedechantillonnage "
    "intervalodemuestreo periododemuestreo intervallodicampionamento periododicampionamento".split()
)
# words that do not make another rate of it
_HARMLESS = frozenset("daq adc rdt test recording measured actual of the in".split())
_SURE_STEPS = frozenset("dt deltat ts tsample timestep wfincrement zeitschritt pasdetemps".split())  # without a unit
_OR_DURATIONS = frozenset("sampletime samplingtime abtastzeit".split())  # names that a recording's length has, too
_SAMPLING = re.compile(r"sampl|abtast|acquisition|echantillonn|muestreo|campionament")
_SPEED = re.compile(r"speed|velocity|geschwindigkeit|vitesse|velocidad|velocita|^rate$|feedrate|vorschub")
# words of the speed of a test; any other makes it that of another stroke, a limit, or of something else
_OF_TEST = frozenset(
    "test testing crosshead cross head insertion needle stage loading load displacement drive actuator constant set "
    "ramp compression traverse traversen pruf prufung nadel einstich de la le du d essai deplacement ensayo aguja "
    "della di prova ago".split()
)
# quoted statements in one line: "Force Units: N","Counts per Unit Force: 1000000.0"
_BETWEEN = re.compile(r'(?<=[^\s"])"\s*[,;\t]\s*"(?=[^",;]+[:=])')
_COUNTS = re.compile(r"counts_?(per|/)?_?(unit)?_?(of)?_?(?P<name>[a-z]+)")
_UNIT = re.compile(r"(units?|einheit(en)?|unites?|unidad(es)?|unita)$")


@dataclass(frozen=True, kw_only=True)
class Statement:
    """A value in SI, and the text that states it."""

    value: float
    text: str


@dataclass(frozen=True, kw_only=True)
class Stated:
    """What a file states: rate [Hz] of the samples, speed [m/s] of the test, and for quantities the symbol of the unit
    with the text that states it."""

    rate: Statement | None = None
    speed: Statement | None = None
    units: Mapping[str, tuple[str, str]] = field(default_factory=dict)


def is_rate_name(name: str) -> bool:
    """Whether a name is that of a rate of samples or of the time between them."""
    words, _ = _words(name)
    return "".join(words) in _RATES | _STEPS


def stated_by(table: Table) -> Stated:
    """What the file states of a table.

    Parameters
    ----------
    table : Table
        Its ``preamble`` has the lines above it, the nearest level first, its ``comments`` single values and texts.

    Returns
    -------
    Stated
        A value is taken from the nearest level that states it, and is None if a level contradicts itself.
    """
    levels = [list(level) for level in table.preamble]
    levels.append(_once(text for _, text in table.comments))
    decimal = table.decimal
    rate, speed, units = None, None, {}
    for lines in ([each for line in level for each in _BETWEEN.split(line)] for level in levels):
        rate = rate or _agreeing(filter(None, (_rate(line, decimal) for line in lines)))
        speed = speed or _agreeing(filter(None, (_speed(line, decimal) for line in lines)))
        units = _units(lines) | units
    return Stated(rate=rate, speed=speed, units=units)


def stating_lines(lines: Iterable[str]) -> tuple[str, ...]:
    """Those of the lines above a table that may state a value or a unit."""
    short = (line.strip() for line in lines if len(line) <= _MAX_CHARS)
    return tuple(line for line in short if any(each.isalpha() for each in line))


def _once(texts: Iterable[str]) -> list[str]:
    """The entries of a file of arrays, those of an inner level before the outer ones: the first of each name."""
    found: dict[str, str] = {}
    for text in texts:
        found.setdefault(text.partition(":")[0], text)
    return list(found.values())


def _agreeing(found: Iterable[Statement]) -> Statement | None:
    """The statement, None without one or if they contradict each other."""
    found = list(found)
    agree = all(abs(each.value - found[0].value) <= _TOLERANCE * found[0].value for each in found)
    return found[0] if found and agree else None


@dataclass(frozen=True)
class _Entry:
    """A name in words, a number, and its unit in lower case without blanks; ``text`` is the line."""

    words: list[str]
    number: float
    unit: str
    text: str


def _entry(line: str, decimal: str) -> _Entry | None:
    """The name and value in a line such as ``Sampling rate: 1000 Hz`` or ``"Sample interval (ms)","1"``."""
    text = line[:_MAX_CHARS].strip(_EDGES)
    value = _VALUE.search(text)
    if value is None or value.start() == 0 or text.startswith(_OWN_ENTRIES):
        return None
    words, in_name = _words(text[: value.start()])
    number = _number(value[0], decimal)
    if number is None or not 0 < len(words) <= _MAX_WORDS:
        return None
    after = text[value.end() :].strip(_EDGES + ",;:=[]()")
    return _Entry(words, number, (after or in_name).strip(), " ".join(text.split())[:_SHOWN_CHARS])


def _words(name: str) -> tuple[list[str], str]:
    """The words of a name, the last part of several, and the unit in it: ``meta.SampleRate_Hz`` -> sample, rate, and
    Hz."""
    parts = [part for part in _SEPARATORS.split(name) if part.strip(_EDGES)]
    last = parts[-1].strip(_EDGES) if parts else ""
    bracketed = _BRACKETED.fullmatch(last)
    last, unit = (bracketed[1], bracketed[2]) if bracketed else (last, "")
    is_unit = _squeezed(unit) in _FREQUENCIES or any(find(unit, each) for each in DIMENSIONS)
    if unit and not is_unit:  # another word of the name: Sampling rate (max)
        last, unit = f"{last} {unit}", ""
    last = re.split(r"\.(?=\S)", last.rstrip(". "))[-1].rsplit("/", 1)[-1]
    words = plain_name(re.sub(r"(?<=[a-z])(?=[A-Z])", "_", last)).split("_")
    for count in (2, 1):  # mm_s, then Hz
        suffix = "/".join(words[-count:])
        if (
            not unit
            and len(words) > count
            and (suffix in _FREQUENCIES or find(suffix, "time" if count == 1 else "velocity"))
        ):
            return words[:-count], suffix
    return [word for word in words if word], unit


def _number(text: str, decimal: str) -> float | None:
    """A positive number, with a comma as decimal sign where the table has one or no group of thousands can be meant."""
    text = text.rstrip(".,")
    if decimal == "," or ("," in text and not re.fullmatch(r"[+-]?\d{1,3}(,\d{3})+(\.\d*)?", text)):
        text = text.replace(".", "") if "," in text else text
        text = text.replace(",", ".")
    try:
        number = float(text.replace(",", ""))
    except ValueError:
        return None
    return number if math.isfinite(number) and number > 0.0 else None


def _rate(line: str, decimal: str) -> Statement | None:
    """The rate of the samples [Hz] that a line states."""
    entry = _entry(line, decimal)
    if entry is None:
        return None
    name = "".join(word for word in entry.words if word not in _HARMLESS)
    frequency = _FREQUENCIES.get(_squeezed(entry.unit)) or _FREQUENCIES.get(_first(entry.unit).casefold())
    period = find(_first(entry.unit), "time")
    value = None
    if " " in entry.unit:  # what follows the unit may change the meaning
        return None
    if frequency and name in _RATES:
        value = frequency * entry.number
    elif period and name in _STEPS:
        value = 1.0 / float(period.to_si(entry.number))
        value = None if name in _OR_DURATIONS and not _is_usual(value) else value
    elif not entry.unit and name in _RATES and (name == "fs" or _SAMPLING.search(name)):
        value = entry.number if _is_usual(entry.number) else None
    elif not entry.unit and name in _STEPS and (name in _SURE_STEPS or _SAMPLING.search(name)):
        usual = [rate for unit in (1.0, 1e3, 1e6) if _is_usual(rate := unit / entry.number)]
        value = usual[0] if len(usual) == 1 else None
    return Statement(value=value, text=entry.text) if value and math.isfinite(value) else None


def _is_usual(rate: float) -> bool:
    return _USUAL_RATES_HZ[0] <= rate <= _USUAL_RATES_HZ[1]


def _speed(line: str, decimal: str) -> Statement | None:
    """The speed of the test [m/s] that a line states with its unit."""
    entry = _entry(line, decimal)
    if entry is None or not any(map(_SPEED.search, ["".join(entry.words), *entry.words])):
        return None
    unit = find(_first(entry.unit), "velocity") or find(_squeezed(entry.unit), "velocity")
    if unit is None or not all(_SPEED.search(word) or word in _OF_TEST for word in entry.words):
        return None
    return Statement(value=float(unit.to_si(entry.number)), text=entry.text)


def _squeezed(unit: str) -> str:
    return "".join(unit.casefold().split())


def _first(unit: str) -> str:
    """The first word of what follows a number."""
    return next(iter(unit.strip("()[]").split()), "").strip("()[],;\"'")


def _units(lines: Iterable[str]) -> dict[str, tuple[str, str]]:
    """Quantity -> unit and text, of lines such as ``Force unit: N`` and ``Units:,lbF``; none for a quantity that two
    lines state differently."""
    found: dict[str, set[str]] = {}
    texts: dict[str, str] = {}
    for line in lines:
        for quantity, symbol in _unit_entries(line):
            found.setdefault(quantity, set()).add(symbol)
            texts.setdefault(quantity, " ".join(line.strip(_EDGES).split())[:_SHOWN_CHARS])
    return {q: _counted(q, symbols.pop(), texts[q], lines) for q, symbols in found.items() if len(symbols) == 1}


def _counted(quantity: str, symbol: str, text: str, lines: Iterable[str]) -> tuple[str, str]:
    """The unit and its text, of a count where a line has ``Counts per Unit Force: 1e6``."""
    for line in lines:
        entry = _entry(line, ".")
        name = _COUNTS.fullmatch("_".join(entry.words)) if entry and not entry.unit else None
        if name and _names(name["name"], NAMED_BY_WORD[quantity].split()):
            return f"{1.0 / entry.number:.12g}{symbol}", f"{text}, {entry.text}"
    return symbol, text


def _unit_entries(line: str) -> Iterator[tuple[str, str]]:
    parts = [part.strip(_EDGES) for part in _SEPARATORS.split(line[:_MAX_CHARS], maxsplit=1)]
    words, _ = _words(parts[0]) if len(parts) == 2 else ([], "")
    known = {word for names in NAMED_BY_WORD.values() for word in names.split()}
    if not any(map(_UNIT.search, words)) or not all(_UNIT.search(w) or w in known | _HARMLESS for w in words):
        return
    texts = [text for text in re.split(r"[\s,;|\"']+", parts[1]) if text]
    named = [q for q, names in NAMED_BY_WORD.items() if any(_names(word, names.split()) for word in words)]
    quantities = named or list(NAMED_BY_WORD)
    if texts and all(any(find(text, dimension(q)) for q in quantities) for text in texts):
        for text in texts:
            for quantity in quantities:
                if unit := find(text, dimension(quantity)):
                    yield quantity, unit.symbol


def _names(word: str, names: Iterable[str]) -> bool:
    """Whether a word is one of these names, or joined with that of a unit, as ``Krafteinheit``."""
    return word in names or _UNIT.sub("", word) in names
