# SPDX-License-Identifier: Apache-2.0
"""A model as a C or C++ header of constants, so that a controller needs no file, as C# or as JSON."""

from ..preset_files.presets import ModelSource, model_source
from .headers import LANGUAGES, by_name, header, identifier

__all__ = ["LANGUAGES", "ModelSource", "by_name", "header", "identifier", "model_source"]
