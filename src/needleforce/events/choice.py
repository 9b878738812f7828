# SPDX-License-Identifier: Apache-2.0
"""Which settings of the detector fit recordings: misses, false alarms and delays over a grid of settings."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from ..acquisition.stop_at import detector_of
from ..checks import not_below_zero
from ..core import EventSettings
from ..display.result import Result
from ..errors import InputError
from ..recording.source import recording_of
from ..segmentation import segment

if TYPE_CHECKING:
    import pandas

    from ..recording import Recording

FALLS = (0.03, 0.05, 0.08, 0.12, 0.15, 0.2, 0.3, 0.5)  # [N]
SHARES = (0.03, 0.1, 0.3)
FALSE_ALARMS = (1e-6, 1e-3)  # [1/s]
ALLOWED = 0.02  # false alarms an insertion
_USUAL = EventSettings()


@dataclass(frozen=True)
class _Truth:
    """A recording with the spans of its punctures and of its smaller falls: times from the peak to the end [s]."""

    rows: list[tuple[float, float, float]]  # force, depth, time since the row before
    time: list[float]
    punctures: list[tuple[float, float]]
    minor: list[tuple[float, float]]
    end: float  # of the insertion


@dataclass(frozen=True)
class _Score:
    """What one setting found in one recording."""

    found: int
    punctures: int
    false: int
    minor: int  # alarms in falls that are no punctures
    delays: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class SettingsRow:
    """What one setting found in all recordings.

    Parameters
    ----------
    fall, share, false_alarms : float
        The setting: [N], [1], [1/s].
    found, punctures : int
        Punctures that it found, and all.
    false, minor : int
        Alarms outside every fall, and in falls that are smaller than a puncture.
    insertions : int
        Recordings.
    delay, delay_90 : float
        Median and 90th percentile from the peak of the force to the sample that showed it [s]; NaN if none was found.
    """

    fall: float
    share: float
    false_alarms: float
    found: int
    punctures: int
    false: int
    minor: int
    insertions: int
    delay: float
    delay_90: float
    scores: tuple[_Score, ...] = field(default=(), repr=False)

    @property
    def missed(self) -> int:
        """Punctures that it did not find."""
        return self.punctures - self.found


def choose(
    recordings: Iterable["Recording"],
    *,
    fall: Sequence[float] = FALLS,
    share: Sequence[float] = SHARES,
    false_alarms: Sequence[float] = FALSE_ALARMS,
    allowed: float = ALLOWED,
    progress: Callable[[Iterable[Any], str], Iterable[Any]] | None = None,
) -> "SettingsChoice":
    """Choose the settings of ``nf.EventDetector`` on recordings.

    Every recording is replayed sample by sample with every setting. Its punctures are those of ``nf.segment``, or those
    given by ``Recording.with_events``. Chosen are the settings that miss the fewest among those with at most
    ``allowed`` false alarms; among equal ones the usual ``fall``, or else the middle one.

    Parameters
    ----------
    recordings : iterable of Recording or path
        One insertion each.
    fall, share, false_alarms : sequence of float, optional
        The settings to compare [N], [1], [1/s].
    allowed : float, optional
        False alarms an insertion, at least 0.
    progress : callable, optional
        Wraps the work, as ``progress(work, text)``.

    Returns
    -------
    SettingsChoice

    Raises
    ------
    InputError
        If a setting is outside its range, or no recording has a puncture.
    """
    not_below_zero("allowed", allowed)
    grid = [EventSettings(fall=f, share=s, false_alarms=a) for f, s, a in product(fall, share, false_alarms)]
    truths = [_truth(recording_of(each)) for each in recordings]
    if not any(each.punctures for each in truths):
        step = "Give recordings with punctures, or their times by Recording.with_events."
        raise InputError("punctures", 0, f"none in {len(truths)} recordings", next_step=step)
    work = grid if progress is None else progress(grid, "settings")
    rows = tuple(_row(each, [_score(each, truth) for truth in truths]) for each in work)
    return SettingsChoice(rows=rows, allowed=allowed)


def _truth(recording: "Recording") -> _Truth:
    events, time = segment(recording), recording.time.tolist()
    steps = np.diff(recording.time, prepend=recording.time[0])
    spans = [[(each.time, time[each.end] if each.end >= 0 else each.time) for each in falls]
             for falls in (events.punctures, events.minor)]  # fmt: skip
    rows = list(zip(recording.force.tolist(), recording.depth.tolist(), steps.tolist(), strict=True))
    return _Truth(rows, time, *spans, time[-1] if events.exit is None else events.exit.time)


def _score(settings: EventSettings, truth: _Truth) -> _Score:
    """What a detector finds; alarms within ``within`` of a fall are of that fall."""
    step, margin = detector_of(settings).step, settings.within
    found = [(at, step(*row)) for at, row in zip(truth.time, truth.rows, strict=True) if at <= truth.end]
    alarms = [at for at, each in found if each is not None and each.kind == "puncture" and each.probability > 0.5]
    first: dict[int, float] = {}
    false = minor = 0
    for at in alarms:
        of = next((k for k, (peak, end) in enumerate(truth.punctures) if peak - margin <= at <= end + margin), None)
        if of is not None:
            first.setdefault(of, at - truth.punctures[of][0])
        elif any(peak - margin <= at <= end + margin for peak, end in truth.minor):
            minor += 1
        else:
            false += 1
    return _Score(len(first), len(truth.punctures), false, minor, tuple(first.values()))


def _row(settings: EventSettings, scores: Sequence[_Score]) -> SettingsRow:
    delays = [each for score in scores for each in score.delays]
    median, late = np.percentile(delays, [50, 90]) if delays else (math.nan, math.nan)
    return SettingsRow(
        fall=settings.fall,
        share=settings.share,
        false_alarms=settings.false_alarms,
        found=sum(each.found for each in scores),
        punctures=sum(each.punctures for each in scores),
        false=sum(each.false for each in scores),
        minor=sum(each.minor for each in scores),
        insertions=len(scores),
        delay=float(median),
        delay_90=float(late),
        scores=tuple(scores),
    )


def _best(rows: Sequence[SettingsRow], allowed: float) -> SettingsRow:
    """The fewest misses within the allowed false alarms; among equal ones the usual, or the middle, fall."""

    def cost(row: SettingsRow) -> tuple:
        over = max(0.0, row.false - allowed * row.insertions)
        unusual = abs(math.log(row.share / _USUAL.share)) + 0.1 * abs(math.log(row.false_alarms / _USUAL.false_alarms))
        return over, row.missed, row.false, row.minor, round(unusual, 9)

    fewest = min(map(cost, rows))
    equal = sorted((row for row in rows if cost(row) == fewest), key=lambda row: row.fall)
    usual = [row for row in equal if row.fall == _USUAL.fall]
    return usual[0] if usual else equal[(len(equal) - 1) // 2]


@dataclass(frozen=True, repr=False, kw_only=True)
class SettingsChoice(Result):
    """Misses, false alarms and delays of settings on recordings, and the settings that are chosen.

    Parameters
    ----------
    rows : tuple of SettingsRow
        All settings.
    allowed : float
        False alarms an insertion.
    """

    rows: tuple[SettingsRow, ...]
    allowed: float

    @property
    def best(self) -> SettingsRow:
        """The row of the settings that are chosen."""
        return _best(self.rows, self.allowed)

    @property
    def settings(self) -> EventSettings:
        """The settings that are chosen, for ``nf.EventDetector``."""
        best = self.best
        return EventSettings(fall=best.fall, share=best.share, false_alarms=best.false_alarms)

    @property
    def options(self) -> str:
        """The same as options of ``needleforce watch`` and ``record``."""
        best = self.best
        return f"--fall-N {best.fall:g} --fall-share {best.share:g} --false-alarms {best.false_alarms:g}"

    def held_out(self) -> tuple[int, int, int]:
        """Punctures found, all punctures and false alarms, each recording with the settings chosen on the others."""
        found = punctures = false = 0
        for k in range(self.best.insertions):
            others = [(row, _row(row, [*row.scores[:k], *row.scores[k + 1 :]])) for row in self.rows]
            best = _best([less for _, less in others], self.allowed)
            score = next(row.scores[k] for row, less in others if less is best)
            found, punctures, false = found + score.found, punctures + score.punctures, false + score.false
        return found, punctures, false

    def _heading(self) -> str:
        best = self.best
        found = f"{best.found} of {best.punctures} punctures found, {best.false} false alarms in {best.insertions}"
        return f"{self.options}: {found} insertions"

    def _cells(self) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
        columns = ("fall [N]", "share", "rate [1/s]", "missed", "false", "smaller falls", "median delay [ms]", "90 %")
        best = self.best
        rows = [row for row in self.rows if (row.share, row.false_alarms) == (best.share, best.false_alarms)]
        return columns, [_row_cells(row, row is best) for row in rows]

    def _remarks(self) -> Iterable[tuple[str, Iterable[str]]]:
        best, (found, punctures, false) = self.best, self.held_out()
        misses, alarms = 100 * _upper(best.missed, best.punctures), _upper_rate(best.false) / best.insertions
        sentences = [
            f"With {best.missed} misses among {best.punctures}, at most {misses:.2g} % of the punctures in such tissue "
            f"are missed; with {best.false} false alarms, at most {alarms:.2g} come an insertion. Both with a "
            "confidence of 95 %."
        ]
        if best.insertions > 1:
            sentences.append(
                f"Each recording with the settings chosen on the others: {found} of {punctures} found, {false} false."
            )
        return [("What it is worth", sentences)]

    def _draw(self, axes: Any) -> tuple[str, ...]:
        """Misses and alarms an insertion over the fall, and the delay on an axis of its own."""
        from ..display.canvas import MEASURED, MODEL, SECOND

        best = self.best
        rows = sorted(
            (row for row in self.rows if (row.share, row.false_alarms) == (best.share, best.false_alarms)),
            key=lambda row: row.fall,
        )
        falls, n = [row.fall for row in rows], best.insertions
        axes.plot(falls, [row.missed / n for row in rows], "o-", color=MODEL, label="missed")
        axes.plot(falls, [row.false / n for row in rows], "s-", color=SECOND, label="false alarms")
        axes.plot(falls, [row.minor / n for row in rows], ":", color=SECOND, label="alarms in smaller falls")
        axes.axvline(best.fall, color=MEASURED, lw=0.9, ls="--")
        axes.set_xscale("log")
        shown = falls[:: 1 + (len(falls) - 1) // 5]
        axes.set_xticks(shown, [f"{each:g}" for each in shown])
        axes.set_xticks([], minor=True)
        axes.set_ylim(bottom=-0.02)
        return "fall that counts as a puncture [N]", "missed and alarms, an insertion"

    def _draw_trade(self, axes: Any) -> tuple[str, str]:
        """Misses over false alarms, a circle a setting, the larger the later it finds."""
        from ..display.canvas import MODEL, SECOND

        known = [row for row in self.rows if math.isfinite(row.delay_90)]
        slowest = max([row.delay_90 for row in known] + [1e-9])
        for row in known:
            chosen, at = row is self.best, (row.false / row.insertions, 100.0 * row.missed / row.punctures)
            axes.plot(*at, "o", ms=3.0 + 9.0 * row.delay_90 / slowest, mfc="none", mec=MODEL if chosen else SECOND,
                      mew=2.0 if chosen else 0.8, zorder=3 if chosen else 2)  # fmt: skip
        axes.set_xlim(left=min(-0.01, axes.get_xlim()[0]))
        return f"false alarms an insertion; largest circle: 90 % within {1e3 * slowest:.0f} ms", "missed [%]"

    def _draw_sheet(self, figure: Any, sheet: Any) -> None:
        """Both drawings; on a narrow screen the first."""
        from ..display.canvas import axis_names, panels

        both = panels(figure, sheet, 1, 1 if sheet.narrow else 2)[0]
        for axes, draw in zip(both, (self._draw, self._draw_trade)):
            axis_names(axes, *draw(axes)[:2])
        both[0].legend(frameon=False)

    def document(self) -> dict:
        """The numbers in SI as dicts and lists."""
        names = ("fall", "share", "false_alarms", "found", "punctures", "false", "minor", "insertions", "delay")
        rows = [{name: getattr(row, name) for name in (*names, "delay_90")} for row in self.rows]
        best = self.best
        chosen = {"fall_N": best.fall, "share": best.share, "false_alarms_per_s": best.false_alarms}
        return {"chosen": chosen, "options": self.options, "allowed": self.allowed, "rows": rows}

    def to_dataframe(self) -> "pandas.DataFrame":
        """All settings, a row each, in SI."""
        import pandas

        return pandas.DataFrame(self.document()["rows"])


def _row_cells(row: SettingsRow, chosen: bool) -> list[str]:
    delays = [f"{1e3 * each:.1f}" if math.isfinite(each) else "-" for each in (row.delay, row.delay_90)]
    mark = " (chosen)" if chosen else ""
    cells = [f"{row.fall:g}{mark}", f"{row.share:g}", f"{row.false_alarms:g}", f"{row.missed} of {row.punctures}"]
    return [*cells, str(row.false), str(row.minor), *delays]


def _upper(events: int, trials: int) -> float:
    """The share that exceeds so many events in so many trials with a probability of 5 % (Clopper and Pearson)."""
    from scipy.special import betaincinv

    return 1.0 if events >= trials else float(betaincinv(events + 1, trials - events, 0.95))


def _upper_rate(events: int) -> float:
    """The mean of Poisson's distribution that gives at most so many events with a probability of 5 %."""
    from scipy.special import gammaincinv

    return float(gammaincinv(events + 1, 0.95))
