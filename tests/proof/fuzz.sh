#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# fuzz.sh SECONDS [SEED]: first a planted fault that the seeds alone must find, then the fuzzer from them on; then, for a third
# of the time, models that are replaced while the loop runs. What it found useful stays in build/fuzz/corpus; an input
# that breaks a property is kept in build/fuzz.
set -eu
cd "$(dirname "$0")/../.."
folder=build/fuzz
chance=${2:-0}  # 0: another each time
seeds=$folder/seeds
mkdir -p $folder/corpus $folder/corpus_live $seeds
# one input a line, its bytes as hexadecimal digits; the last five once broke a property, the six before them take NaN
n=0
sed 's/../\\x&/g' tests/proof/seeds.txt | while read -r seed; do printf %b "$seed" > "$seeds/$((n += 1))"; done
# division by zero is defined for floating-point numbers; what comes of it is checked at every step
build() {
  clang++-19 -std=c++20 -O2 -g1 -fsanitize=fuzzer,address,undefined,float-cast-overflow -fno-sanitize-recover=all \
    "-I$1/include" "$1/tests/proof/$3.cpp" "$1/bindings/c/needleforce.cpp" -o "$2"
}

planted=$folder/planted
rm -rf $planted && mkdir -p $planted/tests $planted/bindings
cp -r include $planted/ && cp -r tests/proof $planted/tests/ && cp -r bindings/c $planted/bindings/
sed -i 's|if (!ordinary(depth, velocity, dt)) return refusal|if (depth > 1e308) return refusal|' \
  $planted/include/needleforce/insertion.hpp
cmp -s include/needleforce/insertion.hpp $planted/include/needleforce/insertion.hpp && echo "nothing was planted" && exit 1
build $planted $planted/fuzz fuzz &
build . $folder/fuzz fuzz
build . $folder/fuzz_live fuzz_live
wait $!
if $planted/fuzz -artifact_prefix=$planted/ $seeds/* > $folder/planted.log 2>&1; then
  echo "a step that takes NaN was not seen from the seeds"
  exit 1
fi

# hunt NAME SECONDS CORPUS WHAT
hunt() {
  if ! $folder/$1 -seed="$chance" -max_total_time="$2" -max_len=3000 -len_control=0 -artifact_prefix=$folder/ "$3" $seeds > $folder/log 2>&1; then
    grep -E 'property broken|runtime error|ERROR|SUMMARY|Test unit' $folder/log
    exit 1
  fi
  awk -v what="$4" '/ counters\)/ {match($0, /\(([0-9]+) inline/); total = substr($0, RSTART + 1, RLENGTH - 8)}
    / cov: / {for (i = 1; i < NF; ++i) if ($i == "cov:") seen = $(i + 1)}
    /^Done/ {print "fuzz, " what ": " $2 " inputs in " $5 " s, " seen " of " total " edges, nothing found"}' $folder/log
}
echo "fuzz: a planted fault was seen"
hunt fuzz "$1" $folder/corpus "engine, C face and guard"
hunt fuzz_live $(($1 / 3)) $folder/corpus_live "replaced models"
