# SPDX-License-Identifier: Apache-2.0
"""Models: laws with parameter values, in layers, and their simulation along a motion."""
