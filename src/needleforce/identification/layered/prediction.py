# SPDX-License-Identifier: Apache-2.0
"""The force that a layered fit expects along a motion: without events over the scatter of the rupture depths between
repeats, in a replay with the punctures of the recording, where they are plausible ones of the layers."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ... import core
from ...segmentation import Events
from ...vocabulary import SMALLEST
from ..replay import STIFFER, times_as_stiff
from ..statistics.noise import student_quantile
from .binned_cycle import RecordedPuncture
from .parameters import MIN_INDENTATION_M, MM, LayerRow
from .search import Solved

MAX_MATCH_DISTANCE = 2e-3  # [m] a puncture farther from the fitted rupture of its own run belongs to no layer
MAX_PAST_PEAK = 0.4e-3  # [m] from the peak to the steep fall; a larger distance is another rupture
MAX_JOINT_DISTANCE = 0.7e-3  # [m] within, two layers rupture together
MIN_SPREAD = 0.05e-3  # [m] of a rupture depth: no bin and no sample is shorter
DROP_SPREAD = np.log(2.0)  # of the logarithm of a drop, counted as one repeat: a factor of two is nothing unusual
DEPTH_SPREAD = 0.05  # [of the indentation] of a rupture depth between repeats, counted as one repeat
N_NODES = 9  # rupture depths of equal probability for a mean force: its error is below 1 % of that of one depth
MIN_MATCHED = 2  # repeats whose puncture belongs to a layer, for its rupture to be known from a puncture
ANOTHER_ZERO = 0.999  # level at which a contact is outside the scatter of the repeats
MAX_STIFFER = 2.0  # of one repeat over all: beyond, it is not the contact that makes the force another
Path = tuple[np.ndarray, np.ndarray]
"""Depths (n,) [m], and the steps (n,) [s] before them."""
Own = Sequence[RecordedPuncture | None]
"""The puncture of each layer in a recording, None where it is not known."""


@dataclass(frozen=True, eq=False, kw_only=True)
class LayerScatter:
    """One layer's rupture between repeats. Depths [m] in the recordings' zero.

    Attributes
    ----------
    mean, spread : float
        Mean and standard deviation of its fitted rupture depth.
    expected_spread : float
        The same with a scatter of ``DEPTH_SPREAD`` as one further repeat: that of few repeats may be small by chance.
    count : int
        Repeats.
    past, past_spread : float
        Its mean distance past the force peak that segmentation finds, and the scatter of that distance.
    drop, drop_spread : float
        Logarithm of the drop of these punctures [N], and its scatter.
    matched : int
        Repeats in which a puncture belongs to it.
    """

    mean: float
    spread: float
    expected_spread: float
    count: int
    past: float = 0.0
    past_spread: float = 0.0
    drop: float = 0.0
    drop_spread: float = DROP_SPREAD
    matched: int = 0

    @property
    def known(self) -> bool:
        """Whether a puncture shows its rupture."""
        return self.matched >= min(MIN_MATCHED, self.count)

    @property
    def held_out_spread(self) -> float:
        """Standard error [m] of the mean as the depth of a rupture that was not recorded."""
        return self.spread * np.sqrt(1.0 + 1.0 / self.count)

    @property
    def gate(self) -> float:
        """Largest distance in standard errors of a rupture that belongs to the layer, at the level of an interval."""
        return student_quantile(self.count - 1) if self.count > 1 else MAX_MATCH_DISTANCE / MIN_SPREAD

    def rupture_by(self, puncture: RecordedPuncture) -> tuple[float, float]:
        """Expected depth [m] of the layer's rupture and its standard error, by a puncture that belongs to it: between
        the mean depth and that of the puncture by their variances, and not later than the end of the drop."""
        measured = min(puncture.depth + self.past, max(puncture.end, puncture.depth))
        between, error = self.held_out_spread**2, self.past_spread**2
        share = between / (between + error) if error > 0.0 else 1.0
        return self.mean + share * (measured - self.mean), float(np.sqrt(share * error))

    def distance(self, rupture: RecordedPuncture) -> float:
        """Squared distance of a puncture from this layer in standard errors, infinite beyond the gate."""
        away = (rupture.depth + self.past - self.mean) / (self.expected_spread * np.sqrt(1.0 + 1.0 / self.count))
        weaker = (np.log(max(rupture.drop, 1e-9)) - self.drop) / self.drop_spread
        return away**2 + weaker**2 if max(abs(away), abs(weaker)) <= self.gate else np.inf


@dataclass(frozen=True, eq=False)
class Ruptures:
    """Mean rupture depth (layers,) [m] of each layer, and its distance (layers,) [m] past the measured force peak.

    Attributes
    ----------
    contact : float
        Mean contact depth [m] of segmentation. All depths are in the recordings' zero.
    scatter : tuple of LayerScatter
        Each layer's rupture between the repeats.
    contact_spread : float
        Largest distance [m] of the contact of another repeat from ``contact``, in all but 0.1 %: beyond, a recording
        has another zero, and all layers move with its contact. 0 from one or two repeats: they always do.
    """

    depth: np.ndarray
    past_peak: np.ndarray
    contact: float
    scatter: tuple[LayerScatter, ...] = ()
    contact_spread: float = 0.0

    def shift(self, events: Events | None) -> float:
        """How much deeper the surface of a recording is [m]."""
        if events is None or events.contact is None:
            return 0.0
        return self.shift_of(events.contact.depth)

    def shift_of(self, contact: float) -> float:
        """The same for a contact depth [m]."""
        shift = contact - self.contact
        return shift if abs(shift) > self.contact_spread else 0.0

    def depths(self, own: Own, shift: float) -> np.ndarray:
        """The rupture depths (layers,) [m] of a recording whose surface is deeper by ``shift`` [m]: by its ``own``
        punctures of the layers, otherwise at the mean depths."""
        found = zip(own, self.scatter)
        return shift + np.array(
            [known.mean if one is None else known.rupture_by(one.moved(-shift))[0] for one, known in found]
        )

    def assigned(self, ruptures: Sequence[RecordedPuncture], shift: float = 0.0) -> list[RecordedPuncture | None]:
        """For each layer its puncture or None: those in the order of depth whose squared distances are the smallest, a
        layer without one counting as at its gate."""
        choices = [[None, *ruptures] if layer.known else [None] for layer in self.scatter]
        best: tuple[float, tuple] = (np.inf, (None,) * len(self.depth))
        for chosen in itertools.product(*choices):
            cost = self._cost(chosen, shift)
            if cost < best[0]:
                best = cost, chosen
        return list(best[1])

    def _cost(self, chosen: tuple, shift: float) -> float:
        """The sum of squared distances of an assignment, infinite for one against the order of depth."""
        given = [(one, layer) for one, layer in zip(chosen, self.scatter) if one is not None]
        for (upper, above), (lower, below) in itertools.pairwise(given):
            joint = upper is lower and abs(below.mean - above.mean) <= MAX_JOINT_DISTANCE
            if not joint and upper.depth >= lower.depth:
                return np.inf
        cost = 0.0
        for one, layer in zip(chosen, self.scatter):
            cost += 2.0 * layer.gate**2 if one is None else layer.distance(one.moved(-shift))
        return cost


@dataclass(frozen=True, eq=False, kw_only=True)
class Member:
    """One fit of an expectation: ``rows`` (layers, 14) in the order of ``LayerRow``, rupture depths (runs, layers) [m],
    and their distance (layers,) [m] from the mean depths of ``Ruptures``."""

    rows: np.ndarray
    depths: np.ndarray
    offset: np.ndarray


@dataclass(frozen=True, eq=False, kw_only=True)
class Expectation:
    """The mean force of the layers over the scatter of their rupture depths, in a ``form``.

    ``members`` are the fit with punctures of each run, which alone replays punctures, and the one with a puncture depth
    for all; their mean errs less than either, as their errors are partly independent. ``stiffness_share`` is the share,
    0 to 1, of another force at a puncture that is the stiffness of the contact up to there.
    """

    members: tuple[Member, ...]
    form: str
    ruptures: Ruptures
    stiffness_share: float = 0.0

    def force(self, path: Path, own: Own = (), shift: float = 0.0, factor: float = 1.0) -> np.ndarray:
        """The expected force (n,) [N] along a path, with the punctures of the layers if known, at a speed at which all
        forces are so many times those of the fit."""
        own = own or (None,) * len(self.ruptures.depth)
        members = self.members[:1] if any(one is not None for one in own) else self.members
        stiffer = self.stiffer(path, own, shift, factor)
        return factor * sum(self._of(member, path, own, shift, stiffer) for member in members) / len(members)

    def stiffer(self, path: Path, own: Own, shift: float, factor: float) -> np.ndarray:
        """How many times as stiff (layers,) the contacts are in a recording: each reaches the force of its puncture, of
        which the logarithm counts by ``stiffness_share``."""
        found, begin, deepest = np.ones(len(own)), 0, np.maximum.accumulate(path[0])
        for layer, one in enumerate(own if self.stiffness_share else ()):
            end = begin if one is None else int(np.searchsorted(deepest, one.end, "right")) + 1
            if one is None or end <= begin:
                continue
            tried, part = np.array([found, found]), (path[0][:end], path[1][:end])
            tried[1, layer] *= STIFFER
            both = (float(self._of(self.members[0], part, own, shift, each)[begin:].max()) for each in tried)
            times, begin = times_as_stiff(one.force / factor, *both), end
            found[layer] = times if 1.0 / MAX_STIFFER < times < MAX_STIFFER else 1.0
        return found**self.stiffness_share

    def _of(self, member: Member, path: Path, own: Own, shift: float, stiffer: np.ndarray) -> np.ndarray:
        nodes = [self._nodes(member, layer, one, shift) for layer, one in enumerate(own)]
        counts = [len(at) for at in nodes]
        tried = np.repeat(member.rows, counts, axis=0)
        tried[:, LayerRow._fields.index("stiffness_coefficient")] *= np.repeat(stiffer, counts)
        tops = tried[:, LayerRow._fields.index("top")]
        tried[:, LayerRow._fields.index("puncture_depth")] = np.maximum(np.concatenate(nodes), tops + MIN_INDENTATION_M)
        forces = core.layer_forces(tried, self.form, path[0] - shift, path[1])
        return np.repeat(1.0 / np.array(counts), counts) @ forces

    def _nodes(self, member: Member, layer: int, own: RecordedPuncture | None, shift: float) -> np.ndarray:
        """Rupture depths [m] of equal probability in the zero of the fit: those of the repeats, or normal about a
        puncture."""
        if own is None:
            return member.depths[:, layer]
        at, spread = self.ruptures.scatter[layer].rupture_by(own.moved(-shift))
        at += member.offset[layer]
        return at + spread * NODES if spread > MIN_SPREAD else np.array([at])


def _normal_nodes(count: int) -> np.ndarray:
    """Means (count,) of the parts of equal probability of the standard normal distribution."""
    from scipy.special import ndtri

    with np.errstate(over="ignore"):
        density = np.exp(-0.5 * ndtri(np.linspace(0.0, 1.0, count + 1)) ** 2) / np.sqrt(2.0 * np.pi)
    return count * (density[:-1] - density[1:])


NODES = _normal_nodes(N_NODES)


def matched(expected: np.ndarray, punctures: Sequence[RecordedPuncture]) -> list[RecordedPuncture | None]:
    """For each fitted depth (layers,) [m] the nearest puncture of its run; None without one."""
    found: list[RecordedPuncture | None] = [None] * len(expected)
    pairs = sorted(
        ((abs(z - one.depth), layer, k) for layer, z in enumerate(expected) for k, one in enumerate(punctures))
    )
    for distance, layer, k in pairs:
        taken = punctures[k] in found and distance > MAX_JOINT_DISTANCE
        if distance <= MAX_MATCH_DISTANCE and found[layer] is None and not taken:
            found[layer] = punctures[k]
    return found


def ruptures(solved: Solved) -> Ruptures:
    """The ruptures of a fit."""
    cycles, fitted = solved.problem.cycles, MM * solved.problem.unknowns.punctures(solved.x)
    peaks = [matched(own, cycle.punctures) for own, cycle in zip(fitted, cycles)]
    rows = solved.problem.unknowns.rows(solved.x[None], fitted.mean(axis=0)[None] / MM)[0]
    tops = rows[:, LayerRow._fields.index("top")]
    return _scatter(fitted, peaks, tops, np.array([cycle.contact for cycle in cycles]))


def expectation(solved: Solved, found: Ruptures | None = None, population: Solved | None = None) -> Expectation:
    """The expected force of a fit with punctures of each run, and of that of one puncture depth for all runs."""
    unknowns, x = solved.problem.unknowns, solved.x
    if found is None:
        nothing = [[None] * unknowns.layers] * unknowns.runs
        found = _scatter(MM * unknowns.punctures(x), nothing, np.zeros(unknowns.layers), np.zeros(1))
    members = tuple(_member(each, found) for each in (solved, population) if each is not None)
    return Expectation(members=members, form=solved.problem.form, ruptures=found)


def with_stiffness(expected: Expectation, solved: Solved) -> Expectation:
    """With the share of another force at a puncture that is the stiffness of the contact, by regression over the
    repeats of the fit; all of it from one recording, which shows no share."""
    known, along, squares = replace(expected, stiffness_share=1.0), 0.0, 0.0
    if len(solved.problem.cycles) == 1:
        return known
    for run, cycle in enumerate(solved.problem.cycles):
        mean, stated = (_replay(solved, run, each) for each in (expected, known))
        change = cycle.weight * (stated - mean)
        along += float(change @ (cycle.weight * (cycle.force - mean)))
        squares += float(change @ change)
    return replace(expected, stiffness_share=float(np.clip(along / max(squares, SMALLEST), 0.0, 1.0)))


def _member(solved: Solved, found: Ruptures) -> Member:
    depths = solved.problem.unknowns.punctures(solved.x)
    rows = solved.problem.unknowns.rows(solved.x[None], depths.mean(axis=0)[None])[0]
    return Member(rows=rows, depths=MM * depths, offset=MM * depths.mean(axis=0) - found.depth)


def _scatter(fitted: np.ndarray, peaks: list, tops: np.ndarray, contacts: np.ndarray) -> Ruptures:
    """The scatter of the ruptures ``fitted`` (runs, layers) [m] of layers at ``tops`` [m], with the punctures ``peaks``
    that belong to them."""
    layers = []
    for layer, own in enumerate(fitted.T):
        pairs = [(place, peak[layer]) for place, peak in zip(own, peaks) if peak[layer] is not None]
        usual = DEPTH_SPREAD * max(float(own.mean() - tops[layer]), 0.0)
        expected = float(np.sqrt((usual**2 + ((own - own.mean()) ** 2).sum()) / len(own)))
        known = LayerScatter(
            mean=float(own.mean()), spread=_sd(own), expected_spread=max(expected, MIN_SPREAD), count=len(own)
        )
        layers.append(_with_punctures(known, pairs) if pairs else known)
    n = len(contacts)
    spread = student_quantile(n - 1, ANOTHER_ZERO) * _sd(contacts) * np.sqrt(1.0 + 1.0 / n) if n > MIN_MATCHED else 0.0
    return Ruptures(
        fitted.mean(axis=0),
        np.array([layer.past for layer in layers]),
        float(contacts.mean()),
        tuple(layers),
        contact_spread=spread,
    )


def _with_punctures(known: LayerScatter, pairs: list[tuple[float, RecordedPuncture]]) -> LayerScatter:
    past = np.array([place - one.depth for place, one in pairs])
    drops = np.log([max(one.drop, 1e-9) for _, one in pairs])
    middle = float(np.clip(np.median(past), -MAX_PAST_PEAK, MAX_PAST_PEAK))
    return replace(
        known,
        past=middle,
        past_spread=float(np.sqrt(np.mean((past - middle) ** 2))),
        drop=float(drops.mean()),
        drop_spread=float(np.sqrt((DROP_SPREAD**2 + ((drops - drops.mean()) ** 2).sum()) / len(drops))),
        matched=len(pairs),
    )


def _sd(values: np.ndarray) -> float:
    return float(values.std(ddof=1)) if len(values) > 1 else 0.0


def _replay(solved: Solved, run: int, expected: Expectation) -> np.ndarray:
    """The force (m,) [N] along the cycle of a run with its own punctures."""
    cycle = solved.problem.cycles[run]
    shift = expected.ruptures.shift_of(cycle.contact)
    own = expected.ruptures.assigned(cycle.punctures, shift)
    return expected.force((cycle.depth, cycle.dt), own, shift, solved.problem.speed_factor(cycle, solved.x))
