# SPDX-License-Identifier: Apache-2.0
"""The paper's procedure: friction from a second insertion, cutting by subtraction (secs. 2.2 and 2.3)."""
