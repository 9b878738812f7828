#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# threads.sh SOURCE...: GoogleTest sources under the thread sanitizer, after a planted race that it must see.
set -eu
cd "$(dirname "$0")/../.."
folder=build/threads
mkdir -p $folder
# the test libraries are not instrumented: what they do between the tests is no race of ours. All sources as one, for each includes the engine
run() {
  printf '#include "%s"\n' tests/cpp/quick_to_compile.hpp "$@" > $folder/all.cpp
  clang++-19 -std=c++20 -O1 -g1 -fsanitize=thread -I. -Iinclude -Itests/cpp $folder/all.cpp -lgtest_main -lgtest -pthread -o $folder/tests
  TSAN_OPTIONS="halt_on_error=1 exitcode=66" $folder/tests --gtest_brief=1
}
if run tests/proof/planted_race.cpp > $folder/planted.log 2>&1 || ! grep -q 'data race' $folder/planted.log; then
  echo "a planted race was not seen:" && tail -5 $folder/planted.log
  exit 1
fi
[ $# -eq 0 ] || run "$@"
echo "threads: a planted race was seen, and none in ${*:-nothing}"
