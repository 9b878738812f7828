# SPDX-License-Identifier: Apache-2.0
"""The report of a fit: its sentences, tables and figures."""
