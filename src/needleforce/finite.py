# SPDX-License-Identifier: Apache-2.0
"""Documents without numbers that JSON cannot say."""

import math


def finite(value):
    """The same document with None for what JSON cannot say."""
    if isinstance(value, dict):
        return {key: finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [finite(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return finite(value.tolist()) if hasattr(value, "tolist") else value
