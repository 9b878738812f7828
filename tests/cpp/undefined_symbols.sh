#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# undefined_symbols.sh OBJECT [DEFINED [ALSO ALLOWED...]]: fails if an object file needs anything but memory copies,
# arithmetic and what the mathematics library computes without memory, lock or system call: relaxation and rate laws are
# exact exponentials (exp, expm1, pow), stick-slip asks when its crack will stop (log), a passive spring how far a stored
# energy stretches it, and a tabulated contact is a polynomial of the root of the depth (sqrt, called for errno alone,
# never with a negative number); the energy of a nonlinear foundation is made of logarithms and hyperbolic functions
# (log1p, tanh, atanh, sinh); a bevel has a direction, a beam-column waves (sin, cos, cosh); noise and texture of
# a tissue add by their squares (hypot). DEFINED must stand in the object, lest an empty one pass.
set -eu
object=$1 defined=${2:-needleforce_one_step}
allowed='memcpy|memset|memmove|exp|expm1|log|log1p|pow|sqrt|tanh|atanh|sinh|cosh|sin|cos|sincos|hypot|_GLOBAL_OFFSET_TABLE_'
for symbol in "${@:3}"; do allowed+="|$symbol"; done
undefined=$(nm --undefined-only --format=posix "$object" | awk '{print $1}')
forbidden=$(printf '%s\n' "$undefined" | grep -vxE "$allowed" | sed '/^$/d' || true)
if [ -n "$forbidden" ]; then
  echo "$object needs symbols that are not on the allow-list:" $forbidden
  exit 1
fi
nm --defined-only --format=posix "$object" | awk '{print $1}' | grep -qx "$defined" || {
  echo "$object does not define $defined"
  exit 1
}
