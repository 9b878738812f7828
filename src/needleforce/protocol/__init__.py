# SPDX-License-Identifier: Apache-2.0
"""An experiment as a file: sites, speeds, depths, holds, passes; and its runner."""
