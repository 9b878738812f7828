#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Fails if an object file needs anything but memory copies, arithmetic and what the mathematics library computes
# without memory, lock or system call: relaxation and rate laws are exact exponentials (exp, expm1, pow), stick-slip asks
# when its crack will stop (log), a passive spring how far a stored energy stretches it, and a
# tabulated contact is a polynomial of the root of the depth (sqrt, called for errno alone, never with a negative number).
set -eu
allowed='^(memcpy|memset|memmove|exp|expm1|log|pow|sqrt|_GLOBAL_OFFSET_TABLE_)$'
undefined=$(nm --undefined-only --format=posix "$1" | awk '{print $1}')
forbidden=$(printf '%s\n' "$undefined" | grep -vE "$allowed" | sed '/^$/d' || true)
if [ -n "$forbidden" ]; then
  echo "step needs symbols that are not on the allow-list:" && echo "$forbidden"
  exit 1
fi
defined=$(nm --defined-only --format=posix "$1" | awk '{print $1}' | grep -c needleforce_one_step)
[ "$defined" = 1 ]
