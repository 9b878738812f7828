# SPDX-License-Identifier: Apache-2.0
"""A model as a header of constants, so that a controller reads no file."""

from .headers import LANGUAGES, header, identifier
from .source import Given, given

__all__ = ["LANGUAGES", "Given", "given", "header", "identifier"]
