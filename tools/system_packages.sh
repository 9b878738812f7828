#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# What pip cannot bring: a C++20 compiler, Python's headers and GoogleTest. Installs them where it may, else says what to install.
set -eu
needed=()
python=${PYTHON:-python3}
command -v g++ > /dev/null || needed+=(g++)
command -v "$python" > /dev/null || needed+=(python3)
"$python" -c 'import ensurepip' 2> /dev/null || needed+=(python3-venv)
"$python" -c 'import sysconfig, pathlib, sys; sys.exit(not (pathlib.Path(sysconfig.get_path("include")) / "Python.h").exists())' 2> /dev/null || needed+=(python3-dev)
[ -f /usr/include/gtest/gtest.h ] || [ -f /usr/local/include/gtest/gtest.h ] || needed+=(libgtest-dev)
[ ${#needed[@]} -eq 0 ] && exit 0
if [ "$(id -u)" = 0 ] && command -v apt-get > /dev/null; then
  echo "installing ${needed[*]}"
  apt-get update -qq && apt-get install -y -qq --no-install-recommends "${needed[@]}" > /dev/null
else
  echo "needleforce needs these system packages first: sudo apt-get install ${needed[*]}" >&2
  exit 1
fi
