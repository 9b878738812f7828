# SPDX-License-Identifier: Apache-2.0
"""Closed forms over arrays: contact, foundation, stability, work of a cycle, limits of validity."""
