# SPDX-License-Identifier: Apache-2.0
"""Sphinx: the pages of this folder and those made from the laws. Nothing is loaded from the network."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # for law_pages and mathml

project = "needleforce"
author = "The needleforce developers"
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_gallery.gen_gallery"]
extensions += ["law_pages", "api_reference", "program_reference", "mathml", "notebook_files", "studio_page"]
html_theme = "furo"
html_title = "needleforce"
html_static_path = ["_static"]
html_css_files = ["law_pages.css", "notebooks.css", "pages.css"]
html_show_copyright = False
html_math_renderer = "mathml"
exclude_patterns = ["figures", "gallery/pictures/*.py", "gallery/pictures/sg_execution_times.rst", "tutorials/files"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 2
napoleon_google_docstring = False
napoleon_use_ivar = True  # the attributes of a result are listed once
autodoc_typehints = "none"  # the docstrings have types, shapes and units
autodoc_member_order = "bysource"
smartquotes = False  # f' is a force per length, not a quotation mark
suppress_warnings = ["myst.xref_missing", "ref.python", "toc.empty_glob"]  # a type in numpydoc form may match two attributes

# The notebooks of tutorials/ run in the build, and one that fails ends it. They write into a folder of their own.
nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_timeout = 600  # s for a cell, also on a busy computer
nb_execution_raise_on_error = True
nb_ipywidgets_js = {}  # there are none, and their scripts would come from the network

# The pictures of examples/gallery are drawn in the build, and one that fails ends it.
sphinx_gallery_conf = {
    "examples_dirs": "../examples/gallery",
    "gallery_dirs": "gallery/pictures",
    "backreferences_dir": "gallery/pictures/used",
    "filename_pattern": r"\.py$",
    "reset_modules": ("gallery_style.plain",),
    "image_scrapers": ("gallery_style.scraper",),
    "within_subsection_order": "FileNameSortKey",
    "notebook_extensions": set(),  # a notebook would be read as a page, and run again
    "abort_on_example_error": True,
    "write_computation_times": False,
    "min_reported_time": 3600,  # s: how long an example took is not shown
    "show_signature": False,
    "download_all_examples": False,
    "remove_config_comments": True,
}
