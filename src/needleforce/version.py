# SPDX-License-Identifier: Apache-2.0
"""The version, as the compiled core states it."""

from .core import version as __version__

__all__ = ["__version__"]
