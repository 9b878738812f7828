# SPDX-License-Identifier: Apache-2.0
"""Recording of a force sensor and a motion axis into a file during a run."""
