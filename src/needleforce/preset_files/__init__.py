# SPDX-License-Identifier: Apache-2.0
"""Presets: models with parameter values, one TOML file per source."""

from .presets import preset, preset_of, presets

__all__ = ["preset", "preset_of", "presets"]
