# SPDX-License-Identifier: Apache-2.0
"""Noise of a recording, least squares, exact posteriors and draws."""
