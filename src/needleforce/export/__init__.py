# SPDX-License-Identifier: Apache-2.0
"""A model as a C or C++ header of constants, so that a controller needs no file; as C#, JSON, or an FMU for other
simulators."""

from ..preset_files.presets import ModelSource, model_source
from .fmu import fmu
from .headers import LANGUAGES, by_name, header, identifier

__all__ = ["LANGUAGES", "ModelSource", "by_name", "fmu", "header", "identifier", "model_source"]
