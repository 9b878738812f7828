# SPDX-License-Identifier: Apache-2.0
"""What goes over the network between a rig and who records it: packets, configuration, lines; no sockets."""
