# SPDX-License-Identifier: Apache-2.0
"""The shortest possible protocol."""

SMALL = """
title = "two sites"
reference = "none"
force_limit_N = 2
spare_sites = 1
[needle]
diameter_mm = 0.7
length_mm = 80
tip = "bevel"
[tissue]
text = "gel"
[axis]
start_mm = -4
[[series]]
speed_mm_s = 3
sites = 2
depths_mm = [16]
hold_s = 1
passes = 2
second_pass_short_mm = 0.3
"""
