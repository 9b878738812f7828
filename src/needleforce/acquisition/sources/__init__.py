# SPDX-License-Identifier: Apache-2.0
"""Where force and motion come from: a sensor or an axis on the network, gauge voltages, standard input."""
