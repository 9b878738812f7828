# SPDX-License-Identifier: Apache-2.0
"""A protocol as plain values in SI: what is done where, before anything is done."""

from dataclasses import dataclass


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
