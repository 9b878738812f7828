# SPDX-License-Identifier: Apache-2.0
"""A model as a C or C++ header of constants, so that a controller needs no file."""

from .headers import LANGUAGES, header, identifier
from .source import ModelSource, model_source

__all__ = ["LANGUAGES", "ModelSource", "header", "identifier", "model_source"]
