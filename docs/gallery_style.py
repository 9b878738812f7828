# SPDX-License-Identifier: Apache-2.0
"""Sphinx: the pictures of examples/gallery look as the figures of the notebooks, and are described in words."""

import re
from pathlib import Path
from typing import Any


def plain(conf: dict, name: str) -> None:
    """Before each example, the style of ``matplotlibrc``, without what the one before it changed."""
    import matplotlib

    matplotlib.use("agg")
    matplotlib.rc_file(Path(__file__).with_name("matplotlibrc"))


def scraper(block: Any, block_vars: dict, gallery_conf: dict) -> str:
    """The figures of an example as images; their text alternative is what their axes show, not the name of a file."""
    from matplotlib import pyplot
    from sphinx_gallery.scrapers import matplotlib_scraper

    shown = iter([axes_in_words(pyplot.figure(number)) for number in pyplot.get_fignums()])
    return re.sub(r"(?<=:alt: ).*", lambda _: next(shown), matplotlib_scraper(block, block_vars, gallery_conf))


def axes_in_words(figure: Any) -> str:
    """What a figure shows: "force [N] over depth [mm]", one after the other."""
    pairs = [(axes.get_ylabel(), axes.get_xlabel()) for axes in figure.axes]
    words = [" over ".join(filter(None, pair)) or "values" for pair in pairs]
    return "; ".join(dict.fromkeys(words))
