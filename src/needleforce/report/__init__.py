# SPDX-License-Identifier: Apache-2.0
"""The report of an identification, a comparison or a campaign: one HTML file, offline, on a phone and on paper."""

from collections.abc import Sequence

__all__ = ["write_campaign_report", "write_comparison", "write_report"]


def write_report(fit, path, *, title: str | None = None, table: list[dict] | None = None) -> None:
    """Writes the report of ``fit`` to ``path``: one HTML file without any reference to the outside.

    ``title`` heads the page; None names the recordings. ``table`` is a comparison with known truth, rows of
    {quantity, unit, paper, paper_sd, true, identified, low, high}, any value None or text such as "not yet".
    The same input gives the same bytes. Nothing is written if the page cannot be made.
    """
    from ..files import atomic_write
    from .page import page  # here, because drawing loads matplotlib, which importing needleforce must not cost

    text = page(fit, title, table)
    with atomic_write(path) as file:
        file.write(text)


def write_comparison(rows, path, *, files: Sequence = ()) -> None:
    """Writes what ``compare`` gave to ``path``: table and figure in one HTML file without any reference to the outside.

    ``files`` are the recordings' names, to be listed. The same input gives the same bytes.
    """
    from ..files import atomic_write
    from .models_page import models_page

    text = models_page(rows, files)
    with atomic_write(path) as file:
        file.write(text)


def write_campaign_report(campaign, path, *, title: str | None = None) -> None:
    """Writes the report of a ``campaign`` to ``path``: one HTML file without any reference to the outside.

    ``title`` heads the page; None counts recordings and conditions. The same input gives the same bytes.
    """
    from ..files import atomic_write
    from .campaign_page import campaign_page

    text = campaign_page(campaign, title)
    with atomic_write(path) as file:
        file.write(text)
