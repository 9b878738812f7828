#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Compiles function_effects.cpp with a clang that checks them (20 or newer; else that of the PyPI package ziglang), then
# the same with a fault planted deep inside one law, five times, each of which must be refused.
set -eu
cd "$(dirname "$0")/../.."
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
python=.venv/bin/python
clang=$(command -v clang++-22 || command -v clang++-21 || command -v clang++-20 || true)
if [ -n "$clang" ]; then
  check=("$clang")
else
  headers=$("$python" -c 'import pathlib, ziglang; print(pathlib.Path(ziglang.__file__).parent / "lib" / "include")')
  check=("$python" -m ziglang clang "--target=$(uname -m)-linux-gnu" -x c++ -isystem "$headers")
fi
check+=(-std=c++20 -fsyntax-only -Wall -Wextra -Wfunction-effects -Werror)

"${check[@]}" -Iinclude tests/proof/function_effects.cpp
"${check[@]}" -Iinclude -fno-exceptions tests/proof/function_effects.cpp
law=include/needleforce/laws/karnopp.hpp line='const double v = move.velocity;'
[ "$(grep -c "$line" $law)" = 1 ]
planted() {
  rm -rf "$folder/include" && cp -r include "$folder/include"
  sed -i "s|$line|$line $1|; s|#include <cmath>|#include <cmath>\n#include <cstdio>\n#include <mutex>|" "$folder/$law"
  if "${check[@]}" "-I$folder/include" tests/proof/function_effects.cpp 2> "$folder/said"; then
    echo "a planted '$1' was not seen"
    exit 1
  fi
  grep -q 'Wfunction-effects' "$folder/said" || { cat "$folder/said" && exit 1; }
}
planted 'delete new int(1);'
planted 'if (v > 1.0) throw v;'
planted 'static std::mutex lock; lock.lock();'
planted 'std::puts("in the loop");'
planted 'static const double first = v; (void)first;'
echo "function effects: nothing in the loop allocates, locks, throws or calls out; five planted faults were seen"
