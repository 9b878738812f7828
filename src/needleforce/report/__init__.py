# SPDX-License-Identifier: Apache-2.0
"""Reports of an identification, a comparison or a campaign: one HTML file each, for screen and print, offline."""

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..bench_tests.penetration_statistics import PenetrationTests
    from ..bench_tests.stress_fit import StressFit
    from ..campaign.result import Campaign
    from ..identification.compare import ModelRow
    from ..identification.result import Fit
    from ..steering import Plan, SteeredRun, SteeringResult

__all__ = [
    "write_campaign_report",
    "write_comparison",
    "write_penetration_report",
    "write_plan_report",
    "write_report",
    "write_run_report",
    "write_steering_report",
    "write_stress_report",
]


def write_report(
    fit: "Fit", path: str | os.PathLike, *, title: str | None = None, table: list[dict[str, Any]] | None = None
) -> None:
    """Write the report of a fit as one HTML file that opens offline; the same input gives the same bytes.

    Parameters
    ----------
    fit : Fit
        Result of ``identify``.
    path : path-like
        File to write; nothing is written if the page cannot be made.
    title : str, optional
        Title of the page; None names the recordings.
    table : list of dict, optional
        Comparison with known true values: rows with the keys quantity, unit, paper, paper_sd, true, identified, low
        and high. Values are in SI units, None, or text such as "not yet".
    """
    from .page import page  # loads matplotlib, which importing needleforce must not do

    _write(page(fit, title, table), path)


def write_comparison(
    rows: "Sequence[ModelRow]", path: str | os.PathLike, *, files: Sequence[str | os.PathLike] = ()
) -> None:
    """Write a comparison of models as one HTML file that opens offline; the same input gives the same bytes.

    Parameters
    ----------
    rows : sequence of ModelRow
        Result of ``compare``.
    path : path-like
        File to write.
    files : sequence of path-like
        Names of the recordings, for a list on the page.
    """
    from .models_page import models_page

    _write(models_page(rows, files), path)


def write_campaign_report(campaign: "Campaign", path: str | os.PathLike, *, title: str | None = None) -> None:
    """Write the report of a campaign as one HTML file that opens offline; the same input gives the same bytes.

    Parameters
    ----------
    campaign : Campaign
        Result of ``campaign``.
    path : path-like
        File to write.
    title : str, optional
        Title of the page; None gives the numbers of recordings and conditions.
    """
    from .campaign_page import campaign_page

    _write(campaign_page(campaign, title), path)


def write_stress_report(
    fit: "StressFit", path: str | os.PathLike, *, assumptions: Sequence[str] = (), mode_assumed: bool = False
) -> None:
    """Write the report of a tension or compression test as one HTML file that opens offline.

    Parameters
    ----------
    fit : StressFit
        Result of ``fit_stress``.
    path : path-like
        File to write.
    assumptions : sequence of str
        What reading the file assumed, for a list on the page.
    mode_assumed : bool
        Whether the loading mode was assumed, which the result then states.
    """
    from .bench_page import stress_page

    _write(stress_page(fit, assumptions, mode_assumed), path)


def write_penetration_report(tests: "PenetrationTests", path: str | os.PathLike, *, title: str | None = None) -> None:
    """Write the report of penetration tests as one HTML file that opens offline; the same input gives the same bytes.

    Parameters
    ----------
    tests : PenetrationTests
        Result of ``penetration_tests``.
    path : path-like
        File to write.
    title : str, optional
        Title of the page; None gives the numbers of needles and groups.
    """
    from .penetration_page import penetration_page

    _write(penetration_page(tests, title), path)


def write_steering_report(result: "SteeringResult", path: str | os.PathLike) -> None:
    """Write the report of an identified steered needle as one HTML file that opens offline.

    Parameters
    ----------
    result : SteeringResult
        Result of ``nf.steering.identify``.
    path : path-like
        File to write.
    """
    from .steering_page import steering_page

    _write(steering_page(result), path)


def write_plan_report(plan: "Plan", path: str | os.PathLike) -> None:
    """Write the report of a planned insertion as one HTML file that opens offline.

    Parameters
    ----------
    plan : Plan
        Result of ``nf.steering.plan``.
    path : path-like
        File to write.
    """
    from .steering_page import plan_page

    _write(plan_page(plan), path)


def write_run_report(run: "SteeredRun", path: str | os.PathLike) -> None:
    """Write the report of a simulated insertion of a steered needle as one HTML file that opens offline.

    Parameters
    ----------
    run : SteeredRun
        Result of ``nf.steering.simulate``.
    path : path-like
        File to write.
    """
    from .steering_page import run_page

    _write(run_page(run), path)


def _write(text: str, path: str | os.PathLike) -> None:
    from ..files import atomic_write

    with atomic_write(path) as file:
        file.write(text)
