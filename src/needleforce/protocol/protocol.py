# SPDX-License-Identifier: Apache-2.0
"""A protocol as plain values in SI, and the list of runs that follows from it."""

from dataclasses import dataclass

ENDING = ".mcap"


@dataclass(frozen=True, kw_only=True)
class Series:
    """Insertions at one ``speed`` [m/s] at their own sites, with a ``hold`` [s] at the deepest point.

    ``depths`` [m] are measured from the surface, the zero of the axis; ``sites`` are the numbers of the sites for each
    depth. There are ``passes`` insertions at a site, ``pause`` [s] apart; all but the first end ``short`` [m] above the
    depth.
    """

    speed: float
    depths: tuple[float, ...]
    sites: tuple[tuple[int, ...], ...]
    hold: float
    passes: int
    short: float
    pause: float


@dataclass(frozen=True, kw_only=True)
class Protocol:
    """An experiment.

    Attributes
    ----------
    title, reference, needle, tissue, rig : str
        Descriptions for the cards of the recordings.
    start : float
        Depth at which each insertion begins and ends [m], negative: above the surface.
    deepest, max_speed : float or None
        Range [m] and speed [m/s] of the axis if the file gives them.
    axial : str
        The sensor's axis along the needle.
    filter_length : int
        Samples in the sensor's moving-average filter.
    bias_time : float
        Time at rest for the bias [s].
    force_limit : float
        Axial force at which the axis is stopped [N].
    series : tuple of Series
        The insertions.
    spares : tuple of int
        Sites that replace one at which an insertion was interrupted in the tissue, in their order.
    name_prefix : str
        Prefix of the names of the recordings.
    sha256 : str
        SHA-256 of the protocol file.
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


@dataclass(frozen=True, kw_only=True)
class RunPlan:
    """One insertion. ``series`` counts from 0, ``site`` and ``pass_number`` from 1; SI.

    ``moves`` are (depth [m], speed [m/s]); a move to the present depth is a hold, its second number the duration [s].
    ``planned_site`` is the site that ``site`` replaces, or ``site`` itself. ``card`` has all entries that are known
    before the run.
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
    """All runs of a protocol in their order.

    Parameters
    ----------
    protocol : Protocol
        The protocol.

    Returns
    -------
    list of RunPlan
        The runs, series by series, depth by depth, site by site, pass by pass.
    """
    return [run for series, depth, site in slots(protocol) for run in passes_at(protocol, series, depth, site)]


def slots(protocol: Protocol) -> list[tuple[int, int, int]]:
    """Index of the series, index of the depth, and planned site, for every site in order."""
    return [
        (k, d, site)
        for k, series in enumerate(protocol.series)
        for d, sites in enumerate(series.sites)
        for site in sites
    ]


def passes_at(protocol: Protocol, series: int, depth: int, planned: int, site: int | None = None) -> list[RunPlan]:
    """The runs planned for the site ``planned`` of a series and depth (indices), there or at the spare ``site``."""
    slot = series, depth, planned
    actual = planned if site is None else site
    return [_run(protocol, slot, actual, number) for number in range(1, protocol.series[series].passes + 1)]


def name_pattern_of(protocol: Protocol) -> str:
    """The pattern of a protocol's file names for a campaign: sites are repeats of one condition."""
    depths = {depth for series in protocol.series for depth in series.depths}
    depth = "{depth_mm}mm_" if len(depths) > 1 else ""
    return protocol.name_prefix + "{speed_mm_s}mm_s_" + depth + "site{repeat}_pass{pass}"


def _run(protocol: Protocol, slot: tuple[int, int, int], site: int, number: int) -> RunPlan:
    """Pass ``number`` at ``site`` for a slot (series, depth, planned site)."""
    series_index, depth_index, planned = slot
    series = protocol.series[series_index]
    speed, start = series.speed, protocol.start
    depth = series.depths[depth_index] - (series.short if number > 1 else 0.0)
    fields = {"speed_mm_s": f"{speed * 1e3:.6g}", "depth_mm": f"{series.depths[depth_index] * 1e3:.6g}"}
    name = name_pattern_of(protocol).format(**fields, **{"repeat": site, "pass": number}) + ENDING
    moves = ((depth, speed), (depth, series.hold), (start, speed)) if series.hold else ((depth, speed), (start, speed))
    card = {"needle": protocol.needle, "tissue": protocol.tissue, "rig": protocol.rig}
    card |= {"protocol": protocol.title, "protocol_sha256": protocol.sha256}
    card |= {"filter_length": str(protocol.filter_length), "axial": protocol.axial}
    card |= {"site": str(site), "pass": str(number), "speed_mm_s": fields["speed_mm_s"]}
    card |= {"depth_mm": f"{depth * 1e3:.6g}", "hold_s": f"{series.hold:.6g}"}
    card |= {"replaces": str(planned)} if site != planned else {}
    return RunPlan(
        name=name,
        series=series_index,
        site=site,
        planned_site=planned,
        pass_number=number,
        speed=speed,
        depth=depth,
        hold=series.hold,
        pause=series.pause,
        moves=moves,
        card=card,
    )
