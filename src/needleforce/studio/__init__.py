# SPDX-License-Identifier: Apache-2.0
"""The studio: a page on which a model is felt and a recording identified. Its files, what it knows of laws and presets,
and its server."""
