# SPDX-License-Identifier: Apache-2.0
"""The layered law fitted to whole cycles: shared numbers, a puncture depth of its own for every run and layer."""
