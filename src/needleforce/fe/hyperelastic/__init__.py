# SPDX-License-Identifier: Apache-2.0
"""Tissue under large strain."""
