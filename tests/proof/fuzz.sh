#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# fuzz.sh SECONDS [SEED]: first a planted fault that the seeds alone must find, then the fuzzer from them on for half of the
# time; at the same time needles that bend, models that are replaced while the loop runs, condensed solids, and what learns. What it found useful
# stays in build/fuzz/corpus; an input that breaks a property is kept in build/fuzz.
set -eu
cd "$(dirname "$0")/../.."
folder=build/fuzz
chance=${2:-0}  # 0: another each time
# plant FILE FOLDER: one input a line, its bytes as hexadecimal digits
plant() {
  mkdir -p "$2"
  local n=0
  sed 's/../\\x&/g' "$1" | while read -r seed; do printf %b "$seed" > "$2/$((n += 1))"; done
}
# the last seven of the seeds once broke a property, the six before them take NaN
seeds=$folder/seeds
plant tests/proof/seeds.txt $seeds
plant tests/proof/seeds_bend.txt ${seeds}_bend
mkdir -p $folder/corpus $folder/corpus_live $folder/corpus_bend $folder/corpus_solid $folder/corpus_online
planted=$folder/planted
rm -rf $planted && mkdir -p $planted/tests $planted/bindings
cp -r include $planted/ && cp -r tests/proof $planted/tests/ && cp -r bindings/c $planted/bindings/
sed -i 's|if (!ordinary(depth, velocity, dt)) return refusal|if (depth > 1e308) return refusal|' \
  $planted/include/needleforce/prepared_insertion.hpp
cmp -s {,$planted/}include/needleforce/prepared_insertion.hpp && echo "nothing was planted" && exit 1

# division by zero is defined for floating-point numbers; what comes of it is checked at every step
export compiler="clang++-19 -std=c++20 -O2 -g1 -fsanitize=address,undefined,float-cast-overflow -fno-sanitize-recover=all"
# of each source the place it is taken from, where its object goes, and other options: a property, no sanitizer, is to see the planted fault.
# Two at a time, the longest first
plain="-O1 -fno-sanitize=all"
objects=$folder/objects
mkdir -p $objects
# the C face as one unit: each of its files includes the engine
printf "#include \"$PWD/bindings/c/needleforce%s.cpp\"\n" "" _bend _solid _events _online > $objects/face.cpp
xargs -P 2 -L 1 bash -c '$compiler ${*:3} -fsanitize=fuzzer-no-link "-I$1/include" -c "$1/$0.cpp" -o "$2/$(basename "$0").o"' << END
tests/proof/fuzz_bend . $objects
$objects/face . $objects
tests/proof/fuzz . $objects
tests/proof/fuzz_live . $objects
tests/proof/fuzz_solid . $objects
tests/proof/fuzz_online . $objects
bindings/c/needleforce $planted $planted $plain
tests/proof/fuzz $planted $planted $plain
END
link() { $compiler -fsanitize=fuzzer "$@"; }
link $planted/fuzz.o $planted/needleforce.o -o $planted/fuzz
for name in fuzz fuzz_live fuzz_bend fuzz_solid fuzz_online; do link $objects/$name.o $objects/face.o -o $folder/$name; done
if $planted/fuzz -artifact_prefix=$planted/ $seeds/* > $folder/planted.log 2>&1; then
  echo "a step that takes NaN was not seen from the seeds"
  exit 1
fi

# hunt NAME SECONDS CORPUS WHAT SEEDS
hunt() {
  local log=$folder/$1.log
  if ! $folder/$1 -seed="$chance" -max_total_time="$2" -max_len=3000 -len_control=0 -artifact_prefix=$folder/ "$3" "$5" > $log 2>&1; then
    grep -E 'property broken|runtime error|ERROR|SUMMARY|Test unit' $log
    exit 1
  fi
  awk -v what="$4" '/ counters\)/ {match($0, /\(([0-9]+) inline/); total = substr($0, RSTART + 1, RLENGTH - 8)}
    / cov: / {for (i = 1; i < NF; ++i) if ($i == "cov:") seen = $(i + 1)}
    /^Done/ {print "fuzz, " what ": " $2 " inputs in " $5 " s, " seen " of " total " edges, nothing found"}' $log
}
others() {
  hunt fuzz_bend $(($1 * 2 / 10)) $folder/corpus_bend "needles that bend" ${seeds}_bend
  hunt fuzz_live $(($1 / 10)) $folder/corpus_live "replaced models" $seeds
  hunt fuzz_solid $(($1 / 10)) $folder/corpus_solid "condensed solids" $seeds
  hunt fuzz_online $(($1 / 10)) $folder/corpus_online "what learns" $seeds
}
echo "fuzz: a planted fault was seen"
# side by side; an exit of either is one of this script
others "$1" &
hunt fuzz $(($1 / 2)) $folder/corpus "engine, C face and guard" $seeds
wait $!
