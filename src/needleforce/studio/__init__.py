# SPDX-License-Identifier: Apache-2.0
"""The studio: a page on which a model is felt and a recording identified. Its files, what it knows of laws and presets,
its server, and its plots in a notebook."""

from .force_widget import force_widget

__all__ = ["force_widget"]
