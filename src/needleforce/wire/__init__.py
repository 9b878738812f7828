# SPDX-License-Identifier: Apache-2.0
"""Network protocols between a rig and the recorder: packets, configuration, lines; no sockets."""
