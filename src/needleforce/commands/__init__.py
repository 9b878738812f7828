# SPDX-License-Identifier: Apache-2.0
"""One file for each command; each has a ``NAME`` and a ``run``. They only call what a script could call."""
