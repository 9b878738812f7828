# SPDX-License-Identifier: Apache-2.0
"""Judges a fit by the truth of a stranger's recording.

Each parameter is ``inside`` its 95 % interval; ``near`` (outside, but inside the interval widened to 1.5 times, or off
by less than the practical tolerance); ``declined`` (refused, no such parameter, or not identifiable);
``warned`` (farther off, with a warning that names a fault of the recording); or ``wrong``: farther off without one.
Whatever the status of the fit, every number that it shows as identifiable is judged, the pooled one and the
recording's own; the depths at which deeper layers rupture are judged only where they are shown.
"""

import re
import warnings
from collections import Counter
from dataclasses import dataclass, field, replace

import numpy as np
from strangers import repeats

import needleforce as nf
from needleforce.recording.recording import Card

PARAMETERS = (
    "contact_depth",
    "puncture_depth",
    "puncture_indentation",
    "puncture_force",
    "friction_per_length",
    "cutting_force",
    "stiffness_coefficient",
)
VERDICTS = ("inside", "near", "declined", "warned", "wrong")
DEPTH_TOLERANCE, SHARE_TOLERANCE, PEAK_TOLERANCE = 0.1e-3, 0.10, 0.03  # [m], of the value, of the largest force
WIDENED = 1.5
DEEPER = re.compile(r"layer_\d+_puncture_depth")

# A warning counts if it names what is there. These words are searched in warnings and notes, without regard to case.
# That the model does not describe the data counts for every fault of the tissue and the rig, not for one of the sensor.
MISFIT = (
    r"residual|misfit|R²|does not (fit|describe|follow)|not described|poor(ly)? (fit|described)|"
    r"(above|below) the measured|% of the (peak|largest force)|model .* (off|differs|departs|misses)"
)
LAYERS = r"layer|interface|(more than one|several|two|three|\d+) (puncture|rupture|drop)s?"
RETURNS = r"revers|pull(s|ed)?[ -]?back|(goes|went|moves) back|backward|jerk|by hand|not monoton|uneven|re-?insert"
STROKES = RETURNS + r"|insertions|(several|second|\d+) strokes?"
ZERO = r"offset|bias|\bzero\b|baseline"
COARSE = r"quanti[sz]|quantum|resolution|steps of|digit"
DEPTH_NOISE = r"depth.*(quanti[sz]|quantum|resolution|steps|noise|jitter)|(quanti[sz]|resolution|noise|jitter).*depth"
AVERAGED = r"filter|averag|smooth"
NO_DROP = r"(no|without a) (sharp )?(drop|puncture)|gradual"
WORDS = {
    "reversals": RETURNS,
    "pull_back": RETURNS,
    "by_hand": RETURNS + r"|speed (varies|changes)|unsteady",
    "several_strokes": STROKES,
    "two_insertions": STROKES,
    "pauses": r"pause|stops?\b|halt|stands still|at rest|relax",
    "relaxation": r"relax|" + MISFIT,
    "no_hold": r"(no|without a?) ?hold",
    "no_withdrawal": r"(no|without a?) ?withdrawal|only (the )?insertion|not withdrawn",
    "partial_withdrawal": r"withdraw(al|n).*(part|incomplete|ends|inside)|no exit|(ends|stays) in",
    "no_free_travel": r"free travel|before (the )?contact|in contact",
    "in_contact": r"free travel|before (the )?contact|in contact|extrapolated",
    "starts_inside": r"(begins?|starts?) (in|deep)|free travel|no exit",
    "short": r"short (travel|insertion|stroke)|little travel (below|after|past)|few samples|too shallow",
    "withdrawal_only": r"only (a |the )?withdrawal|no insertion|never increases|(begins?|starts?) (in|deep)",
    "stuck_depth": r"depth .*(stands|stuck|constant|does not (move|change)|frozen)|stall",
    "compliant_rig": r"complian|(rig|clamp).*(stiffness|bends|yields)|" + MISFIT,
    "layers": LAYERS + "|" + MISFIT,
    "rounded": r"gradual|rounded|round peak|over a (length|travel)|" + MISFIT,
    "power_law": r"power|exponent|" + MISFIT,
    "polynomial": r"polynom|" + MISFIT,
    "cone_cylinder": MISFIT,
    "oscillation": r"swing|oscillat|stick.slip|periodic|" + MISFIT,
    "resting_surface": r"surface|dimple|rebound|" + MISFIT,
    "texture": r"irregular|heterogen|uneven|rough|" + MISFIT,
    "grip": r"exit|jump|intercept|surface|" + MISFIT,
    "dragged": r"presliding|stretch|elastic|stick|drag|relax|" + MISFIT,
    "long_stretch": r"presliding|stretch|elastic|stick|" + MISFIT,
    "weak": r"weak|small (drop|puncture)",
    "unruptured": r"no puncture|no drop|not (punctured|ruptured)",
    "no_drop": NO_DROP,
    "offset_small": ZERO,
    "offset_large": ZERO,
    "drift_small": r"drift|" + ZERO,
    "drift_large": r"drift|" + ZERO,
    "hum": r"\bhum\b|mains|50 Hz|60 Hz|periodic|oscillat",
    "loud": r"noise|noisy",
    "coloured": r"correlated|coloured",
    "quantum": COARSE,
    "noisy_start": COARSE + r"|noise|noisy",
    "depth_quantum": DEPTH_NOISE,
    "depth_jitter": DEPTH_NOISE,
    "spikes": r"spike|outlier|(single|one)[- ]sample",
    "saturation": r"clip|(sensor|force|signal|peak)( is| may be)? saturat|saturated (force|sensor|peak)|overload",
    "filter": AVERAGED,
    "filter_declared": AVERAGED,
    "lag": r"\blags?\b|lagg|delay|\blate\b|behind",
    "clock_jitter": r"clock|uneven|jitter|gaps?\b|sampling",
    "slow_rate": r"few samples|sampling|\brate\b|coarse",
    "fast_rate": r"sampling|\brate\b",
    "disorder": r"(wrong|out of) order|sorted|not increase|decreases|backwards in time|time (goes|steps) back",
}
WORDS |= {
    "outwards": r"disagree|" + MISFIT,
    "steep_law": MISFIT,
    "speed": r"speed|disagree|" + MISFIT,
    "ageing": r"time|disagree|" + MISFIT,
    "gain": r"gain|disagree|" + MISFIT,
}
# What a named fault can explain; one that is not here explains every parameter.
AFTER, AT = {"friction_per_length", "cutting_force"}, {"puncture_depth", "puncture_indentation", "puncture_force"}
EXPLAINS = {
    "no_hold": AFTER,
    "no_withdrawal": AFTER,
    "partial_withdrawal": AFTER,
    "short": AFTER,
    "layers": AFTER,
    "resting_surface": AFTER,
    "relaxation": AFTER,
    "long_stretch": AFTER,
    "texture": AFTER,
    "grip": AFTER,
    "dragged": AFTER,
    "oscillation": AFTER | AT,
    "weak": AT,
    "no_drop": AT,
    "unruptured": AFTER | AT,
}
# said of every fit whatever the recording: no warning
ALWAYS = r"A cone without saturation fits best|The needle goes deeper than 12 mm"


@dataclass
class Verdict:
    """A recording's judgement: for each parameter a verdict and whether its 95 % interval holds the truth."""

    seed: int
    scenario: str
    faults: tuple
    status: str
    verdicts: dict = field(default_factory=dict)  # name -> one of VERDICTS
    absent: tuple = ()  # of these, what does not exist
    covered: dict = field(default_factory=dict)  # name -> bool, of those with a value
    vague: list = field(default_factory=list)  # identifiable and inside, but the interval excludes nothing useful
    widths: dict = field(default_factory=dict)  # name -> half width over the practical tolerance
    details: dict = field(default_factory=dict)  # name -> (value, low, high, truth range)
    false_punctures: int = 0
    missed_punctures: int = 0
    true_punctures: int = 0  # those that are detectable
    malformed: int = 0  # intervals that do not hold their own value
    named: tuple = ()  # the faults that a warning names
    messages: tuple = ()
    crash: str = ""
    numeric: tuple = ()  # warnings of NumPy that reach the user
    seconds: float = 0.0

    @property
    def wrong(self):
        return [name for name, verdict in self.verdicts.items() if verdict == "wrong"]


def tolerance(name, truth):
    """Practical tolerance of a parameter: an error below it is no error to a user.

    Depths: 0.1 mm, or what the depth's own quantum, jitter and sampling allow. Forces: 10 % of the value or 3 % of the
    largest force. Friction per length: the same over the embedded travel. Stiffness: 10 %.
    """
    if name.endswith(("contact_depth", "puncture_depth", "puncture_indentation")):
        return max(DEPTH_TOLERANCE, truth.depth_error)
    value = max(abs(v) for v in truth.values.get(name, (0.0,)))
    if name == "stiffness_coefficient":
        return SHARE_TOLERANCE * value
    per = PEAK_TOLERANCE * truth.peak / (max(truth.travel, 1e-3) if name == "friction_per_length" else 1.0)
    return max(SHARE_TOLERANCE * value, per)


def overlaps(low, high, truth_range):
    """True if an interval meets the range of true values."""
    return bool(low <= truth_range[1] and high >= truth_range[0])


def ends(estimate):
    """Limits of an interval in order; a limit that is missing or NaN is the value."""
    given = (estimate.value if v is None or np.isnan(v) else v for v in (estimate.low, estimate.high))
    return sorted(given)


def malformed(estimate):
    """True if the value is not between its limits, or a limit is missing."""
    limits = (estimate.low, estimate.high)
    return any(v is None or np.isnan(v) for v in limits) or not limits[0] <= estimate.value <= limits[1]


def vague(name, estimate):
    """True if half of the interval is more than 1 mm of a depth, or more than the value of another parameter."""
    low, high = ends(estimate)
    return bool((high - low) / 2 > (1e-3 if "depth" in name or "indentation" in name else abs(estimate.value)))


def verdict_of(name, estimate, truth, named):
    """The verdict of one estimate and whether its interval holds the truth (None if there is no value to judge)."""
    if estimate is None or not estimate.identifiable or estimate.value is None or not np.isfinite(estimate.value):
        return "declined", None
    if name in truth.absent:
        return ("warned" if named else "wrong"), False
    value = estimate.value
    low, high = ends(estimate)
    real = truth.values[name]
    if overlaps(low, high, real):
        return "inside", True
    off = max(real[0] - value, value - real[1])
    if off <= tolerance(name, truth) or overlaps(
        value - WIDENED * (value - low), value + WIDENED * (high - value), real
    ):
        return "near", False
    return ("warned" if named else "wrong"), False


def with_deeper(name, estimate, truth):
    """The truth with that of a deeper layer's rupture: the nearest one below the first, or none."""
    if not DEEPER.fullmatch(name):
        return truth
    below = [(each.start, each.end) for each in truth.ruptures if each.start > truth.ruptures[0].start]
    if not below:
        return replace(truth, absent=truth.absent | {name})
    nearest = min(below, key=lambda ends: max(ends[0] - estimate.value, estimate.value - ends[1]))
    return replace(truth, values=truth.values | {name: nearest})


def causes_named(faults, messages):
    """The faults that are present and that the messages name."""
    text = [re.sub(ALWAYS, "", message) for message in messages]
    return tuple(f for f in faults if f in WORDS and any(re.search(WORDS[f], line, re.IGNORECASE) for line in text))


def count_punctures(found, truth, verdict):
    """Events that are no rupture, and detectable ruptures without an event."""
    margin = max(DEPTH_TOLERANCE, truth.depth_error) + truth.event_margin
    near = [[r.start - margin <= event.depth <= r.end + margin for r in truth.ruptures] for event in found]
    verdict.false_punctures = sum(not any(row) for row in near)
    seen = [any(row[k] for row in near) for k in range(len(truth.ruptures))]
    verdict.true_punctures = sum(r.detectable for r in truth.ruptures)
    verdict.missed_punctures = sum(r.detectable and not s for r, s in zip(truth.ruptures, seen, strict=True))


def judged(fit, truth):
    """The verdict of a fit with one recording."""
    one = fit.recordings[0]
    notes = [note for each in fit.recordings for note in (*each.notes, *getattr(each.events, "notes", ()))]
    messages = (*map(str, fit.warnings), *dict.fromkeys(map(str, notes)))
    out = Verdict(
        truth.seed, truth.scenario, truth.faults, str(one.status), absent=tuple(truth.absent), messages=messages
    )
    out.named = causes_named(truth.faults, messages)
    given = [each for each in PARAMETERS if each in truth.meaningful | truth.absent]
    for name in (*given, *dict.fromkeys(each for each in (*fit.parameters, *one.parameters) if DEEPER.fullmatch(each))):
        explained = any(name in EXPLAINS.get(fault, (*PARAMETERS, name)) for fault in out.named)
        estimates = [known[name] for known in (fit.parameters, one.parameters) if name in known]
        truths = [with_deeper(name, each, truth) for each in estimates]
        found = [(*verdict_of(name, *each, explained), *each) for each in zip(estimates, truths)]
        found = [each for each in found if each[0] != "declined"]
        if not found and name in given:
            out.verdicts[name] = "declined"
        if not found:
            continue
        out.verdicts[name], out.covered[name], estimate, true = max(found, key=lambda each: VERDICTS.index(each[0]))
        out.malformed += malformed(estimate)
        out.vague += [name] if vague(name, estimate) else []
        out.widths[name] = 0.5 * (estimate.high - estimate.low) / tolerance(name, true)
        out.details[name] = (estimate.value, estimate.low, estimate.high, true.values.get(name))
    if one.events is not None and one.status != "unreadable":
        count_punctures(one.events.punctures, truth, out)
    return out


def trial(seed, scenario=None, n=1, **options):
    """The verdict of one recording, or of ``n`` repeats, with options of ``identify``: a refusal declines all, an
    exception is a crash."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        verdict = unguarded(repeats(seed, scenario, n), options)
    verdict.numeric = tuple(f"{w.category.__name__}: {w.message}" for w in caught)
    return verdict


def unguarded(found, options):
    truth = found[0][3]
    declined = {name: "declined" for name in PARAMETERS if name in truth.meaningful | truth.absent}
    refused = Verdict(truth.seed, truth.scenario, truth.faults, "refused", declined, tuple(truth.absent))
    card = Card(filter_length=truth.filter_length)
    recordings = [nf.Recording(time=time, depth=depth, force=force, card=card) for time, depth, force, _ in found]
    try:
        return judged(nf.identify(recordings, **options), truth)
    except nf.InputError as error:
        refused.messages = (str(error),)
        refused.named = causes_named(truth.faults, refused.messages)
    except Exception as error:  # the trial counts it
        refused.status, refused.crash = "crash", f"{type(error).__name__}: {error}"
    return refused


def share(verdicts, name=None):
    """Counts of each verdict over all parameters, or of one."""
    return Counter(v for one in verdicts for key, v in one.verdicts.items() if name in (None, key))


def declined_shares(verdicts):
    """Share of judged parameters that are declined, and the same of those that exist: to decline another is right."""
    judged = [(name in v.absent, each == "declined") for v in verdicts for name, each in v.verdicts.items()]
    existing = [declined for absent, declined in judged if not absent]
    return sum(declined for _, declined in judged) / max(len(judged), 1), sum(existing) / max(len(existing), 1)


def wrong_share(verdicts):
    """Share of judged parameters that are wrong and not warned of."""
    counts = share(verdicts)
    return counts["wrong"] / max(sum(counts.values()), 1)
