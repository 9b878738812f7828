# SPDX-License-Identifier: Apache-2.0
"""The formats of recordings: one module a format, which gives the tables of a file."""
