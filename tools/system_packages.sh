#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# What pip cannot bring: for `core` a C++20 compiler and Python with its headers, for `tests` GoogleTest and pkg-config as well, for `proof`
# clang with its sanitizers and fuzzer, what it needs for WebAssembly, and Node; for `browser` Chromium, and for `hosts` Mono and Octave, alone.
# Installs them where it may, else names in one line what to install. Without a browser or hosts the tests that need it are skipped: no fault.
set -eu
python=${PYTHON:-python3}
compiler=${CXX:-g++}
needed=()
has_header() { echo "#include <$1>" | "$compiler" -std=c++20 -x c++ -fsyntax-only - 2> /dev/null; }
ask() { "$python" -c "$1" 2> /dev/null; }

# The packages that are missing under the names of another system.
named() {
  local each
  for each in "${needed[@]}"; do
    case "$1 $each" in
      "dnf g++" | "zypper g++") echo gcc-c++ ;;
      "dnf python3-dev" | "zypper python3-dev") echo python3-devel ;;
      "dnf python3-venv" | "zypper python3-venv") echo python3 ;;
      "dnf libgtest-dev" | "zypper libgtest-dev") echo gtest-devel ;;
      "dnf pkg-config" | "zypper pkg-config") echo pkgconf-pkg-config ;;
      "pacman g++") echo gcc ;;
      "brew g++") ;;  # Xcode's tools bring it
      "pacman python3"* | "brew python3"*) echo python ;;
      "pacman libgtest-dev") echo gtest ;;
      "brew libgtest-dev") echo googletest ;;
      "pacman pkg-config" | "brew pkg-config") echo pkgconf ;;
      "brew chromium") echo --cask chromium ;;
      "dnf mono-mcs" | "zypper mono-mcs") echo mono-devel ;;
      "pacman mono-mcs" | "brew mono-mcs") echo mono ;;
      "dnf octave-dev" | "zypper octave-dev") echo octave-devel ;;
      "pacman octave-dev" | "brew octave-dev") echo octave ;;
      *) echo "$each" ;;
    esac
  done | sort -u | xargs
}
# One line with the command that installs what is missing on this system.
says_how() {
  local command
  if [ "$(uname -s)" = Darwin ]; then
    command="brew install $(named brew)"
    case " ${needed[*]} " in *" g++ "*) command="xcode-select --install; $command" ;; esac
  elif command -v apt-get > /dev/null; then command="sudo apt-get install ${needed[*]}"
  elif command -v dnf > /dev/null; then command="sudo dnf install $(named dnf)"
  elif command -v zypper > /dev/null; then command="sudo zypper install $(named zypper)"
  elif command -v pacman > /dev/null; then command="sudo pacman -S --needed $(named pacman)"
  else command="what Debian calls ${needed[*]}"; fi
  echo "needleforce needs these system packages first: ${command% install }" >&2
}

what=${1:-core}
if [ "$what" = browser ]; then
  command -v chromium > /dev/null || command -v chromium-browser > /dev/null || command -v google-chrome > /dev/null || needed+=(chromium)
elif [ "$what" = hosts ]; then
  command -v mcs > /dev/null && command -v mono > /dev/null || needed+=(mono-mcs)
  command -v mkoctfile > /dev/null || needed+=(octave-dev)
else
  command -v "$compiler" > /dev/null || needed+=(g++)
  command -v "$python" > /dev/null || needed+=(python3)
  ask 'import ensurepip' || needed+=(python3-venv)
  ask 'import sysconfig, pathlib, sys; sys.exit(not (pathlib.Path(sysconfig.get_path("include")) / "Python.h").exists())' || needed+=(python3-dev)
  [ "$what" = core ] || has_header gtest/gtest.h || needed+=(libgtest-dev)
  [ "$what" = core ] || command -v pkg-config > /dev/null || needed+=(pkg-config)
  if [ "$what" = proof ]; then
    # a header for each package that brings one
    clang=/usr/lib/llvm-19/lib/clang/19/lib wasm=/usr/include/wasm32-wasi
    command -v clang++-19 > /dev/null || needed+=(clang-19)
    [ -e $clang/linux ] || needed+=(libclang-rt-19-dev)
    command -v wasm-ld-19 > /dev/null || needed+=(lld-19)
    [ -e $clang/wasi ] || needed+=(libclang-rt-19-dev-wasm32)
    [ -e $wasm/stdlib.h ] || needed+=(wasi-libc)
    [ -e $wasm/c++/v1/variant ] || needed+=(libc++-19-dev-wasm32 libc++abi-19-dev-wasm32)
    command -v node > /dev/null || needed+=(nodejs)
  fi
fi

if [ ${#needed[@]} -gt 0 ]; then
  if [ "$(id -u)" = 0 ] && command -v apt-get > /dev/null; then
    echo "installing ${needed[*]}"
    (while sleep 5; do echo "installing system packages, $SECONDS s"; done) &
    clock=$!
    trap 'kill $clock' EXIT
    apt-get update -qq
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${needed[@]}" > /dev/null
    kill $clock
    trap - EXIT
    echo "system packages: done after $SECONDS s"
  else
    says_how
    exit 1
  fi
fi
ask 'import sys; sys.exit(sys.version_info < (3, 11))' || {
  echo "needleforce needs Python 3.11 or newer, $("$python" --version) is too old: make PYTHON=python3.12 ..." >&2
  exit 1
}
