#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds the plugin against the headers and the library of the mujoco wheel of PYTHON:
#   integrations/mujoco/build.sh [FOLDER]      writes FOLDER/libneedleforce_mujoco.so and says its path
set -eu
python=${PYTHON:-python3}
compiler=${CXX:-g++}
folder=${1:-.}
here=$(cd "$(dirname "$0")" && pwd)
root=$here/../..
wheel=$("$python" -c 'import importlib.util, os; print(os.path.dirname(importlib.util.find_spec("mujoco").origin))' 2> /dev/null) || {
  echo "$python has no mujoco: pip install mujoco, or say PYTHON=.venv/bin/python" >&2
  exit 1
}
library=$(ls "$wheel"/libmujoco.so.* | head -n 1)
mkdir -p "$folder"
"$compiler" -std=c++20 -O2 -fPIC -shared -Wall -Wextra -I"$root/include" -I"$root/bindings/c" -isystem "$wheel/include" \
  "$here/needle_plugin.cpp" "$library" -Wl,-rpath,"$wheel" -o "$folder/libneedleforce_mujoco.so"
echo "$folder/libneedleforce_mujoco.so"
