# SPDX-License-Identifier: Apache-2.0
"""Moduli and forces from what was measured."""
