# SPDX-License-Identifier: Apache-2.0
"""Laws with values, in layers: a model, and what it gives along a motion."""
