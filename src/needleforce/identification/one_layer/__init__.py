# SPDX-License-Identifier: Apache-2.0
"""The one-layer model fitted to one recording: loading curve, puncture, friction and cutting."""
