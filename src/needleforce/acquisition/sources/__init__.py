# SPDX-License-Identifier: Apache-2.0
"""Sources of force and motion: a sensor or an axis on the network, gauge voltages, standard input."""
