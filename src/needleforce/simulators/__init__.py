# SPDX-License-Identifier: Apache-2.0
"""needleforce where others simulate and train: environments for Gymnasium, and the laws as a function for Warp.

``environments`` and ``policies`` need the extra ``gym``, ``warp`` the extra ``warp``; each is imported by its name.
"""
