# SPDX-License-Identifier: Apache-2.0
"""From a sensor and an axis to a file, while it happens."""
