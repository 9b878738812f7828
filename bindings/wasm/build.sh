#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# build.sh FOLDER: the core for WebAssembly, and the module that loads it.
set -eu
cd "$(dirname "$0")/../.."
mkdir -p "$1"
compiler=${WASM_CXX:-clang++-19}
# the C library as one unit: each of its files includes the engine
printf '#include "bindings/c/needleforce%s.cpp"\n' "" _bend _solid _events _online | "$compiler" --target=wasm32-wasi -std=c++20 -O2 -fno-exceptions \
  -fno-rtti -ffp-contract=off -Wall -Wextra -Werror -mexec-model=reactor -Iinclude -x c++ - bindings/wasm/pieces.cpp \
  bindings/wasm/bend_pieces.cpp bindings/wasm/solid_pieces.cpp bindings/wasm/event_pieces.cpp bindings/wasm/online_pieces.cpp -o "$1/needleforce.wasm" \
  -Wl,--strip-all -Wl,-z,stack-size=1048576 -Wl,--stack-first
cp bindings/wasm/{needleforce,pieces,online}.mjs "$1/"
