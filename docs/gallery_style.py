# SPDX-License-Identifier: Apache-2.0
"""Sphinx: the pictures of examples/gallery look as the figures of the notebooks."""

from pathlib import Path


def plain(conf: dict, name: str) -> None:
    """Before each example, the style of ``matplotlibrc``, without what the one before it changed."""
    import matplotlib

    matplotlib.use("agg")
    matplotlib.rc_file(Path(__file__).with_name("matplotlibrc"))
