# SPDX-License-Identifier: Apache-2.0
"""Where the search begins: from the events, never from the user."""

from collections.abc import Iterator

import numpy as np

from .binned_cycle import Course
from .parameters import COEFFICIENT, MM, PER_LAYER, SATURATION, STIFFNESS, TOP, Unknowns

LIKE_TISSUE = (0.0, 0.0, 0.0, 0.2, 5.5, -7.8, 2.0)
"""Grip ratio, stiffness of 250 N/m, rupture within 0.4 mm, a dimple of 2 mm; the contact is set by the forces."""
SMALL = (7.6, -6.9, 0.0, 0.0, 4.6, -7.6, 1.0)
"""A weak layer, to be added: c = 2 kN/m^2, h_s = 1 mm, k_t = 100 N/m."""
COMMON = (0.2, 0.0, 0.0)
"""Half fades, half of it sooner; forces do not depend on speed."""
BEYOND = 1.0  # [mm] past the deepest point: a layer that does not give way
APART = 1.0  # [mm] between a layer's top and its puncture, at least
TOPS = (0.35, 0.7, 1.0)  # of the way from contact to the first puncture, where a second layer may begin
ADDED = 4  # places of a further layer


def first_starts(courses: tuple[Course, ...], unknowns: Unknowns) -> Iterator[np.ndarray]:
    """Vectors for one or two layers."""
    contact = np.median([course.contact for course in courses]) / MM
    deepest = np.median([course.deepest for course in courses]) / MM
    first = _seen(courses, 0.0, deepest + BEYOND)
    if unknowns.layers == 1:
        yield _start(courses, [contact], first[:, None])
        return
    middle = float(np.median(first))
    never = np.full(len(courses), deepest + BEYOND)
    for share in TOPS:
        for second in (_seen(courses, middle + APART, 0.5 * (middle + deepest)), never):
            top = min(contact + share * (middle - contact), float(np.median(second)) - APART)
            yield _start(courses, [contact, top], np.column_stack([first, second]))


def grown_starts(courses: tuple[Course, ...], before: Unknowns, x: np.ndarray) -> Iterator[np.ndarray]:
    """The vector ``x`` of a fit with one layer less, with a weak layer added at several places, that gives way or
    does not."""
    shared, common = x[: before.fading], x[before.fading : before.shared]
    deepest = np.median([course.deepest for course in courses]) / MM
    highest = shared[TOP::PER_LAYER].min()
    for top in np.linspace(highest + 1.0, deepest - 3.0, ADDED):
        for puncture in sorted({round(deepest + BEYOND, 1), round(min(top + 3.0, deepest + BEYOND), 1)}):
            added = np.array(SMALL)
            added[TOP] = top
            own = np.column_stack([before.punctures(x), np.full(before.runs, puncture)])
            yield np.concatenate([shared, added, common, own.ravel()])


def _start(courses: tuple[Course, ...], tops: list[float], punctures: np.ndarray) -> np.ndarray:
    """The vector of layers like tissue from ``tops`` [mm], that give way at ``punctures`` (runs, layers) [mm]."""
    peak = np.median([course.peak for course in courses])
    parts = []
    for layer, top in enumerate(tops):
        indentation = max(float(np.median(punctures[:, layer])) - top, 0.5) * MM
        saturation = min(6e-3, 0.5 * indentation)
        force = peak * (0.8 if layer == 0 else 0.4)
        part = np.array(LIKE_TISSUE)
        part[COEFFICIENT] = np.log(force / (saturation * (2.0 * indentation - saturation)))
        part[SATURATION], part[TOP] = np.log(saturation), top
        part[STIFFNESS] += np.log(peak / 5.0)  # a stiff tissue drags as stiffly as it resists
        parts.append(part)
    return np.concatenate([*parts, COMMON, punctures.ravel()])


def _seen(courses: tuple[Course, ...], least: float, otherwise: float) -> np.ndarray:
    """Each run's first puncture past ``least`` [mm]; the median where it has none, ``otherwise`` where none has."""
    found = [[depth / MM for depth in course.punctures if depth / MM > least] for course in courses]
    known = [depths[0] for depths in found if depths]
    middle = float(np.median(known)) if known else otherwise
    return np.array([depths[0] if depths else middle for depths in found])
