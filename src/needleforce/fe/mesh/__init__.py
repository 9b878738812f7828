# SPDX-License-Identifier: Apache-2.0
"""Meshes: blocks, cylinders, and those of files."""
