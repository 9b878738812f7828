# SPDX-License-Identifier: Apache-2.0
"""The force that a layered fit expects along a motion: without events over the scatter of the rupture depths between
repeats, in a replay with the punctures of the recording, where they are plausible ones of the layers."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ... import core
from ...recording import Recording
from ...segmentation import Events
from ..statistics.noise import student_quantile
from .binned_cycle import RecordedPuncture, recorded_punctures
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
    replayed : tuple of bool
        Whether a replay takes the depth of a layer's rupture from a puncture: where that predicts held-out repeats of
        the fit better than the mean depth.
    contact_spread : float
        Standard error [m] of ``contact`` as the contact of another repeat.
    shifts : bool
        Whether a replay moves all layers with the contact; otherwise only for a contact outside its scatter, which is
        another zero.
    """

    depth: np.ndarray
    past_peak: np.ndarray
    contact: float
    scatter: tuple[LayerScatter, ...] = ()
    replayed: tuple[bool, ...] = ()
    contact_spread: float = 0.0
    shifts: bool = True

    def shift(self, events: Events | None) -> float:
        """How much deeper the surface of a recording is [m]."""
        if events is None or events.contact is None:
            return 0.0
        return self.shift_of(events.contact.depth)

    def shift_of(self, contact: float) -> float:
        """The same for a contact depth [m]."""
        shift = contact - self.contact
        return shift if self.shifts or abs(shift) > self.contact_spread else 0.0

    def of(self, events: Events, recording: Recording) -> tuple[float, np.ndarray]:
        """How much deeper the surface of a recording is [m], and the rupture depths (layers,) [m] of its layers: at its
        own punctures where these are plausible, otherwise at the mean depths."""
        shift = self.shift(events)
        own = self.assigned(recorded_punctures(events, recording), shift)
        found = zip(own, self.scatter)
        return shift, np.array(
            [shift + (known.mean if one is None else known.rupture_by(one.moved(-shift))[0]) for one, known in found]
        )

    def assigned(self, ruptures: Sequence[RecordedPuncture], shift: float = 0.0) -> list[RecordedPuncture | None]:
        """For each layer its puncture or None: those in the order of depth whose squared distances are the smallest, a
        layer without one counting as at its gate."""
        replayed = self.replayed or (True,) * len(self.depth)
        choices = [[None, *ruptures] if used else [None] for used in replayed]
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

    ``members`` are the fit with punctures of each run, whose mean is taken over these, and the one with a puncture
    depth for all; their mean errs less than either, as their errors are partly independent. ``replays_all`` is False
    where the first alone replays the repeats of the fit better.
    """

    members: tuple[Member, ...]
    form: str
    ruptures: Ruptures
    replays_all: bool = True

    def force(
        self, depth: np.ndarray, dt: np.ndarray, own: Sequence[RecordedPuncture | None] = (), shift: float = 0.0
    ) -> np.ndarray:
        """The expected force (n,) [N] along depths [m] after steps [s], with the punctures of the layers if known."""
        own = own or (None,) * len(self.ruptures.depth)
        known = any(one is not None for one in own) and not self.replays_all
        members = self.members[:1] if known else self.members
        forces = [self._of(member, depth - shift, dt, own, shift) for member in members]
        return sum(forces) / len(forces)

    def _of(
        self, member: Member, depth: np.ndarray, dt: np.ndarray, own: Sequence[RecordedPuncture | None], shift: float
    ) -> np.ndarray:
        nodes = [self._nodes(member, layer, one, shift) for layer, one in enumerate(own)]
        tried = np.concatenate([np.tile(row, (len(at), 1)) for row, at in zip(member.rows, nodes)])
        tops = tried[:, LayerRow._fields.index("top")]
        tried[:, LayerRow._fields.index("puncture_depth")] = np.maximum(np.concatenate(nodes), tops + MIN_INDENTATION_M)
        weight = np.concatenate([np.full(len(at), 1.0 / len(at)) for at in nodes])
        return weight @ core.layer_forces(tried, self.form, depth, dt)

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
    """The ruptures of a fit, and which of them a replay takes from punctures."""
    cycles, fitted = solved.problem.cycles, MM * solved.problem.unknowns.punctures(solved.x)
    peaks = [matched(own, cycle.punctures) for own, cycle in zip(fitted, cycles)]
    rows = solved.problem.unknowns.rows(solved.x[None], fitted.mean(axis=0)[None] / MM)[0]
    tops = rows[:, LayerRow._fields.index("top")]
    found = _scatter(fitted, peaks, tops, np.array([cycle.contact for cycle in cycles]))
    return _with_rules(solved, found, fitted, peaks, tops)


def expectation(solved: Solved, found: Ruptures | None = None) -> Expectation:
    """The expected force of a fit with punctures of each run."""
    unknowns, x = solved.problem.unknowns, solved.x
    if found is None:
        nothing = [[None] * unknowns.layers] * unknowns.runs
        found = _scatter(MM * unknowns.punctures(x), nothing, np.zeros(unknowns.layers), np.zeros(1))
    return Expectation(members=(_member(solved, found),), form=solved.problem.form, ruptures=found)


def with_population(expected: Expectation, solved: Solved, population: Solved) -> Expectation:
    """With the fit of one puncture depth for all runs as a second member."""
    both = replace(expected, members=(*expected.members, _member(population, expected.ruptures)))
    if not any(expected.ruptures.replayed):
        return both
    alone, together = (_replay_error(solved, [each] * len(solved.problem.cycles)) for each in (expected, both))
    return replace(both, replays_all=together < alone)


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
    spread = student_quantile(n - 1) * _sd(contacts) * np.sqrt(1.0 + 1.0 / n) if n > 1 else 0.0
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


def _with_rules(solved: Solved, found: Ruptures, fitted: np.ndarray, peaks: list, tops: np.ndarray) -> Ruptures:
    """With the layers whose punctures, and the contact if it, predict each repeat better by what the others say."""
    cycles, layers = solved.problem.cycles, fitted.shape[1]
    if len(cycles) < MIN_MATCHED + 1:
        known = tuple(layer.matched == len(cycles) for layer in found.scatter)
        return replace(found, replayed=known)
    contacts = np.array([cycle.contact for cycle in cycles])
    others = [
        _scatter(np.delete(fitted, run, axis=0), peaks[:run] + peaks[run + 1 :], tops, np.delete(contacts, run))
        for run in range(len(cycles))
    ]
    usable = [all(each.scatter[layer].matched >= MIN_MATCHED for each in others) for layer in range(layers)]
    tried = itertools.product(*((False, True) if use else (False,) for use in usable), (False, True))
    rules = list(tried)
    errors = [_replay_error(solved, _held_out(solved, others, rule[:-1], rule[-1])) for rule in rules]
    best = rules[int(np.argmin(errors))]
    return replace(found, replayed=tuple(best[:-1]), shifts=bool(best[-1]))


def _held_out(solved: Solved, others: list[Ruptures], replayed: tuple[bool, ...], shifts: bool) -> list[Expectation]:
    """The expectation for each repeat by the ruptures of the others."""
    return [expectation(solved, replace(found, replayed=replayed, shifts=shifts)) for found in others]


def _replay_error(solved: Solved, expected: list[Expectation]) -> float:
    """Sum of squares of the replays of all repeats, each by its expectation."""
    total = 0.0
    for cycle, each in zip(solved.problem.cycles, expected):
        shift = each.ruptures.shift_of(cycle.contact)
        own = each.ruptures.assigned(cycle.punctures, shift)
        force = solved.problem.speed_factor(cycle, solved.x) * each.force(cycle.depth, cycle.dt, own, shift)
        total += float((((force - cycle.force) * cycle.weight) ** 2).sum())
    return total
