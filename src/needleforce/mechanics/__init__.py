# SPDX-License-Identifier: Apache-2.0
"""Closed forms: contact over arrays, foundation, buckling, work of a cycle; limits of validity."""
