# SPDX-License-Identifier: Apache-2.0
"""Tissue with mass and damping, and a needle that moves in it."""
