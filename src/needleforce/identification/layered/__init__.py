# SPDX-License-Identifier: Apache-2.0
"""The layered law fitted to complete cycles: shared parameters, and a puncture depth for every run and layer."""
