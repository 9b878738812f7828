# SPDX-License-Identifier: Apache-2.0
"""Sphinx: the pages of this folder, without anything from the network."""

project = "needleforce"
author = "The needleforce developers"
extensions = ["myst_parser"]
html_theme = "furo"
html_title = "needleforce"
exclude_patterns = ["figures"]
myst_heading_anchors = 2
suppress_warnings = ["myst.xref_missing"]
