# SPDX-License-Identifier: Apache-2.0
"""Presets: models with parameter values, one TOML file per source."""

from .presets import model_name, models_of, needle_of, preset, preset_of, presets

__all__ = ["model_name", "models_of", "needle_of", "preset", "preset_of", "presets"]
