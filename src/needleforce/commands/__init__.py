# SPDX-License-Identifier: Apache-2.0
"""One module for each command, with a ``NAME`` and a ``run``. Commands use only functions that a script can call."""
