# SPDX-License-Identifier: Apache-2.0
"""A protocol as plain values in SI: what is done where, and the list of runs that follows from it."""

from dataclasses import dataclass

ENDING = ".mcap"


@dataclass(frozen=True)
class Series:
    """Insertions at one ``speed`` [m/s] at sites of their own, with a ``hold`` [s] at the deepest point.

    ``depths`` [m], past the surface as the axis has it, with the numbers of their ``sites``: a site is for one depth.
    There are ``passes`` insertions at a site, ``pause`` [s] apart; all but the first end ``short`` [m] above the depth.
    """

    speed: float
    depths: tuple[float, ...]
    sites: tuple[tuple[int, ...], ...]
    hold: float
    passes: int
    short: float
    pause: float


@dataclass(frozen=True)
class Protocol:
    """An experiment. ``start`` [m], below 0 above the surface, is where each insertion begins and ends.

    ``deepest`` [m] and ``max_speed`` [m/s] are the axis' as the file says them, None where it does not; ``axial``,
    ``filter_length`` [samples] and ``bias_time`` [s] are for the sensor; ``force_limit`` [N] stops the axis. ``spares``
    are the sites that take the place of a spoiled one, in their order. ``sha256`` is that of the file.
    """

    title: str
    reference: str
    needle: str
    tissue: str
    rig: str
    start: float
    deepest: float | None
    max_speed: float | None
    axial: str
    filter_length: int
    bias_time: float
    force_limit: float
    series: tuple[Series, ...]
    spares: tuple[int, ...]
    name_prefix: str
    sha256: str


@dataclass(frozen=True)
class RunPlan:
    """One insertion. ``series`` counts from 0, ``site`` and ``pass_number`` from 1; SI.

    ``moves`` are (depth [m], speed [m/s]); a move to where the tip is waits, its speed a time [s]. ``planned_site`` is
    the site that ``site`` takes the place of, or itself. ``card`` lacks what is known only when it is run.
    """

    name: str
    series: int
    site: int
    planned_site: int
    pass_number: int
    speed: float
    depth: float
    hold: float
    pause: float
    moves: tuple[tuple[float, float], ...]
    card: dict[str, str]


def plan(protocol: Protocol) -> list[RunPlan]:
    """All runs of a protocol in their order: series by series, depth by depth, site by site, pass by pass."""
    return [run for series, depth, site in slots(protocol) for run in passes_at(protocol, series, depth, site)]


def slots(protocol: Protocol) -> list[tuple[int, int, int]]:
    """The index of the series, that of the depth, and the planned site, in their order."""
    return [
        (k, d, site)
        for k, series in enumerate(protocol.series)
        for d, sites in enumerate(series.sites)
        for site in sites
    ]


def passes_at(protocol: Protocol, k: int, d: int, planned: int, site: int | None = None) -> list[RunPlan]:
    """The runs planned for a site, at that site or at the spare one ``site``."""
    return [_run(protocol, k, d, planned, planned if site is None else site, n) for n in _numbers(protocol.series[k])]


def name_pattern_of(protocol: Protocol) -> str:
    """The names of a protocol's files as a pattern for a campaign: sites are repeats of one condition."""
    depth = "{depth_mm}mm_" if _many_depths(protocol) else ""
    return protocol.name_prefix + "{speed_mm_s}mm_s_" + depth + "site{repeat}_pass{pass}"


def _numbers(series: Series) -> range:
    return range(1, series.passes + 1)


def _many_depths(protocol: Protocol) -> bool:
    return len({depth for series in protocol.series for depth in series.depths}) > 1


def _run(protocol: Protocol, k: int, d: int, planned: int, site: int, number: int) -> RunPlan:
    series = protocol.series[k]
    speed, start = series.speed, protocol.start
    depth = series.depths[d] - (series.short if number > 1 else 0.0)
    said = {"speed_mm_s": f"{speed * 1e3:.6g}", "depth_mm": f"{series.depths[d] * 1e3:.6g}", "repeat": site}
    name = name_pattern_of(protocol).format(**said, **{"pass": number}) + ENDING
    moves = ((depth, speed), (depth, series.hold), (start, speed)) if series.hold else ((depth, speed), (start, speed))
    about = [protocol.needle, protocol.tissue, protocol.rig, protocol.title, protocol.sha256]
    card = dict(zip(("needle", "tissue", "rig", "protocol", "protocol_sha256"), about))
    card |= {"filter_length": str(protocol.filter_length), "axial": protocol.axial}
    card |= {"site": str(site), "pass": str(number), "speed_mm_s": said["speed_mm_s"]}
    card |= {"depth_mm": f"{depth * 1e3:.6g}", "hold_s": f"{series.hold:.6g}"}
    card |= {"replaces": str(planned)} if site != planned else {}
    return RunPlan(name, k, site, planned, number, speed, depth, series.hold, series.pause, moves, card)
