#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# sanitizers.sh WITHOUT PROGRAM...: the C++ tests that were compiled with sanitizers, but not those whose names have one of the words between
# the bars of WITHOUT. Many tests a process, for one takes longer to start with sanitizers than most tests to run; `make test` has each in
# a process of its own.
set -eu
cd "$(dirname "$0")/../.."
export without="-*${1//|/*:*}*" GTEST_TOTAL_SHARDS=4
passed=$(dirname "$2")/passed
trap 'cat "$passed"' ERR
set -o pipefail
for share in 0 1 2 3; do
  for each in "${@:2}"; do echo "$share $each"; done
done | xargs -P "$(nproc)" -L 1 bash -c 'GTEST_SHARD_INDEX=$0 "$1" --gtest_brief=1 --gtest_filter="$without"' > "$passed" 2>&1
awk '/^\[  PASSED  \]/ {n += $4} END {if (!n) exit 1; print n " tests passed"}' "$passed"
