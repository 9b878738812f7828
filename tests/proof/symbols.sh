#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# What the C face needs from outside. Beside what a step may need (tests/cpp/undefined_symbols.sh) there is
# what nf_init alone calls, before the loop: strcmp for names; the trigonometry and special functions of contact
# integrals; abort, where std::visit would meet a variant without a value, which layers read by name never have.
# Then the same for objects with an allocation, a lock and an output planted in them, which must be refused.
set -eu
cd "$(dirname "$0")/../.."
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
before_the_loop=(strcmp abort atan atan2 ceil cos sin sincos tan tgamma)
compile() {
  "${CXX:-g++}" -std=c++20 -O2 -fno-exceptions -fno-rtti -fno-stack-protector -U_FORTIFY_SOURCE -Iinclude \
    -c "$1" -o "$folder/object.o"
}
check() { tests/cpp/undefined_symbols.sh "$folder/object.o" "$1" "${before_the_loop[@]}"; }

# as one unit: each of the files includes the engine
printf "#include \"$PWD/bindings/c/needleforce%s.cpp\"\n" "" _guard _bend _solid _events _online > "$folder/all.cpp"
compile "$folder/all.cpp"
for step in nf_step_v2 nf_guard_step_v2 nf_base_guard_step_v2 nf_bend_step_v2 nf_solid_step_v2 nf_events_step_v2 nf_online_step_v2; do check $step; done
planted() {
  printf 'extern "C" void nf_step() {}\n%s\n' "$1" > "$folder/planted.cpp"
  compile "$folder/planted.cpp"
  if check nf_step > /dev/null; then
    echo "the symbols of a planted '$1' were not seen"
    exit 1
  fi
}
planted 'double* planted() { return new double(1.0); }'
planted 'extern "C" int pthread_mutex_lock(void*); int planted(void* lock) { return pthread_mutex_lock(lock); }'
planted 'extern "C" int puts(const char*); int planted() { return puts("said in the loop"); }'
echo "symbols: the C face needs arithmetic and strcmp; three planted faults were seen"
