# SPDX-License-Identifier: Apache-2.0
# needleforce: `make help` lists what can be asked. Every target does its own set-up in .venv.
PYTHON ?= python3
BIN := .venv/bin
CORE_SOURCES := $(shell find include bindings -type f) CMakeLists.txt pyproject.toml
PYTHON_SOURCES := src tests benchmarks examples
CXX_SOURCES := $(shell find include bindings integrations tests examples benchmarks -name '*.hpp' -o -name '*.cpp' -o -name '*.h' -o -name '*.c')
CORE := build/python
CXX_TESTS := build/cpp
CXX_SANITIZED := build/sanitized
# every test in which threads share something, or must not
THREAD_TESTS := tests/cpp/exchange.cpp tests/cpp/swap.cpp tests/cpp/flight_recorder.cpp tests/cpp/one_thread.cpp
# a line at least every five seconds
WATCHED = $(PYTHON) tools/progress.py
# Python keeps what it compiled, whatever the shell has set: otherwise a command takes four times as long, for each compiles every module again
unexport PYTHONDONTWRITEBYTECODE
# names from requirements/, versions from constraints.txt. Python compiles what is imported when it is: all of it at once takes longer
# than the rest of the installation.
INSTALL = $(BIN)/pip install --disable-pip-version-check --no-compile --constraint constraints.txt
NINJA = -G Ninja -DCMAKE_MAKE_PROGRAM=$(CURDIR)/$(BIN)/ninja
MINUTES ?= 10
SHARE ?= 0
FILE ?= tests/reference_values.json

.DEFAULT_GOAL := help
# what runs side by side says so itself
ifndef SIDE_BY_SIDE
.NOTPARALLEL:
endif
.PHONY: help setup packages-and-core demo test test-system test-browser test-mono-octave test-wasm test-cpp test-python test-long test-hosts proof proof-long proof-tools proof-effects proof-symbols proof-sanitized proof-sanitizers proof-threads \
        proof-fuzz fuzz wasm studio-static bench bench-full wheel try-wheel lint format docs reference clean

help:  ## this list
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 14

# Each stamp in .venv is newer than what it was made from. The two that take long, packages and compiler, run side by side.
.venv/.made:
	@PYTHON=$(PYTHON) tools/system_packages.sh core
	@test -x $(BIN)/python || $(WATCHED) "setting up .venv" -- $(PYTHON) -m venv .venv
	@touch $@

.venv/.build-packages: requirements/build.txt constraints.txt | .venv/.made
	@$(WATCHED) "packages to compile with" -- $(INSTALL) --requirement requirements/build.txt
	@touch $@

.venv/.packages: requirements/run.txt .venv/.build-packages
	@$(WATCHED) "packages to run with" -- $(INSTALL) --requirement requirements/run.txt
	@touch $@

.venv/.test-packages: requirements/tests.txt .venv/.packages
	@$(WATCHED) "packages to test with" -- $(INSTALL) --requirement requirements/tests.txt
	@touch $@

.venv/.wheel-packages: requirements/wheels.txt .venv/.build-packages
	@$(WATCHED) "packages to audit wheels with" -- $(INSTALL) --requirement requirements/wheels.txt
	@touch $@

.venv/.lint-packages: requirements/lint.txt .venv/.build-packages
	@$(WATCHED) "formatters and linters" -- $(INSTALL) --requirement requirements/lint.txt
	@touch $@

# The compiled module and its stubs go into src/, where .gitignore has them.
.venv/.compiled: $(CORE_SOURCES) .venv/.build-packages
	@$(WATCHED) "configuring the core" -- $(BIN)/cmake -S . -B $(CORE) $(NINJA) -DNEEDLEFORCE_PYTHON=ON -DCMAKE_BUILD_TYPE=Release \
	  -DPython_EXECUTABLE=$(CURDIR)/$(BIN)/python -Dnanobind_DIR=$$($(BIN)/python -m nanobind --cmake_dir)
	@$(WATCHED) "compiling the core" -- $(BIN)/cmake --build $(CORE)
	@$(BIN)/cmake --install $(CORE) --prefix src > /dev/null
	@touch $@

# The package is installed as a path to src/, its command and its version: a module that is new or moved is found at once.
# An editable install that compiles would find only the modules that were there when it was made.
.venv/.editable: pyproject.toml include/needleforce/version.hpp .venv/.packages
	@$(WATCHED) "installing needleforce" -- $(INSTALL) --no-build-isolation --no-deps --config-settings=wheel.cmake=false --config-settings=editable.mode=inplace \
	  --config-settings=wheel.py-api= --editable .
	@touch $@

# where another checkout or a git clean took the compiled module away, it is put there again
ifeq ($(wildcard src/needleforce/core.*),)
.PHONY: .venv/.compiled
endif

setup:  ## virtual environment, pinned packages, compiled core
	@$(MAKE) --no-print-directory --jobs=2 SIDE_BY_SIDE=yes packages-and-core

packages-and-core: .venv/.compiled .venv/.editable
	@true

demo: setup  ## the paper's experiment reproduced: table, demo/report.html, demo/results.json
	@if [ -t 2 ]; then $(BIN)/needleforce demo --out demo; else $(WATCHED) "demo" --show -- $(BIN)/needleforce demo --out demo; fi

# what the Python tests need is fetched and compiled while the C++ tests are
test: setup  ## every test; SHARE=3 with what .ci/run takes on a day of 28
	@$(MAKE) --no-print-directory --jobs=3 SIDE_BY_SIDE=yes test-cpp .venv/.test-packages test-mono-octave .venv/.collected test-wasm
	@$(MAKE) --no-print-directory test-python

# Every C++ test is run at each run of .ci/run. Of the programs a share has two fifths as distributions compile them, with their long walks and
# what is not for sanitizers, and in `make proof` the others with sanitizers; without a share both have all.
CXX_FIFTHS := core_tests bending_tests+plain_pair_tests solid_tests+event_tests+gradient_tests real_time_tests guard_tests+swap_tests
SPACE := $(subst ,, )
CXX_ALL := $(subst +, ,$(CXX_FIFTHS))
fifth = $(subst +, ,$(word $(shell echo $$((($(SHARE) + $(1)) % 5 + 1))),$(CXX_FIFTHS)))
CXX_ORDINARY = $(if $(filter-out 0,$(SHARE)),$(call fifth,0) $(call fifth,2),$(CXX_ALL))
CXX_WITH_SANITIZERS = $(if $(filter-out 0,$(SHARE)),$(filter-out $(CXX_ORDINARY),$(CXX_ALL)),$(CXX_ALL))
labels = --label-regex "^($(subst $(SPACE),|,$(strip $(1))))$$"

# -O2, as distributions compile: -O3, which the Python module has, takes a fifth longer to compile
test-cpp: .venv/.build-packages test-system
	@$(WATCHED) "configuring the C++ tests" -- $(BIN)/cmake -S . -B $(CXX_TESTS) $(NINJA) -DNEEDLEFORCE_TESTS=ON -DCMAKE_BUILD_TYPE=Release \
	  -DCMAKE_CXX_FLAGS_RELEASE="-O2 -DNDEBUG"
	@$(WATCHED) "compiling the C++ tests" -- $(BIN)/cmake --build $(CXX_TESTS) $(addprefix --target ,step_object $(CXX_ORDINARY))
	@$(WATCHED) "C++ tests" --keep "tests passed" -- $(BIN)/ctest --test-dir $(CXX_TESTS) --parallel $$(nproc) --output-on-failure --no-tests=error $(call labels,step_object $(CXX_ORDINARY))

test-system: .venv/.made
	@PYTHON=$(PYTHON) tools/system_packages.sh tests

# after the other system packages: one installer at a time
test-browser: test-system
	@PYTHON=$(PYTHON) tools/system_packages.sh browser || echo "the tests that open a page are skipped"

test-mono-octave: test-browser
	@PYTHON=$(PYTHON) tools/system_packages.sh hosts || echo "the tests of C# and Octave are skipped"

# after an installation one process compiles what the tests import, else each of those that run them does; what cannot be imported is seen
# before the others run
.venv/.collected: .venv/.test-packages
	@$(WATCHED) "collecting the Python tests" -- $(BIN)/python -m pytest --collect-only -q
	@touch $@

# one thread of linear algebra each; one process more than processors, for some tests wait for another process. A process that crashes fails
# the run: for one in its last test pytest-xdist would start another, and wait for it without end.
PYTHON_TESTS = OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n $$(($$(nproc) + 1)) --max-worker-restart 0 --dist loadfile --lines --share $(SHARE)

# where there is a clang, the tests use what the wheel takes; one installer at a time
test-wasm: test-mono-octave
	@! command -v clang++-19 > /dev/null || $(MAKE) --no-print-directory wasm

test-python: setup .venv/.test-packages test-wasm
	@$(PYTHON_TESTS)

test-long: setup .venv/.test-packages  ## the tests that repeat themselves, with all repetitions; SHARE=3 of 28 for a third day
	@$(PYTHON_TESTS) --long

test-hosts: setup .venv/.test-packages  ## hosts that are too heavy for every run: Warp, MuJoCo Warp
	@$(WATCHED) "packages of hosts" -- $(INSTALL) --requirement requirements/hosts.txt
	@OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest tests/simulators/test_warp.py

proof: proof-tools  ## the real-time claims, by compiler, sanitizers and fuzzer
	@$(MAKE) --no-print-directory --jobs=2 SIDE_BY_SIDE=yes proof-effects proof-threads proof-symbols proof-sanitized
	@$(MAKE) --no-print-directory proof-sanitizers proof-fuzz

proof-tools: .venv/.proof-packages
	@PYTHON=$(PYTHON) tools/system_packages.sh proof

.venv/.proof-packages: tests/proof/requirements.txt .venv/.build-packages
	@$(WATCHED) "packages to prove with" -- $(INSTALL) --requirement tests/proof/requirements.txt
	@touch $@

proof-effects: proof-tools
	@$(WATCHED) "function effects" --show -- tests/proof/function_effects.sh

proof-symbols: .venv/.made
	@$(WATCHED) "symbols" --show -- tests/proof/symbols.sh

# Long walks repeat, in an ordinary build, what the fuzzers do with the same sanitizers, faster, or what a shorter test does. With sanitizers
# a share has a part of them.
REPEATED := EnergyController|MillionStepsOfANeedle|ReturnNoEnergy|ReturnsNoEnergyOverAnyMotion|NoiseOf|HourOfHold|EveryLawInEightLayers|CondensedSolidAllocates|OfAllAxes|EquilibriumOfEachNonlinear|RandomMotionsWithFriction|SwappedLaws|EveryModelKeepsItsForce|NoClosedPathReturns|StrokesOfTheWholeRange

# Without a limit the compiler inlines, and then instruments again, what every test of every law calls: they take a sixth longer to compile.
INLINED := -mllvm -inline-threshold=25 -mllvm -inlinehint-threshold=25 -Wno-unused-command-line-argument

proof-sanitized: proof-tools
	@mkdir -p $(CXX_SANITIZED)
	@$(BIN)/cmake -S . -B $(CXX_SANITIZED) $(NINJA) -DNEEDLEFORCE_TESTS=ON \
	  -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_COMPILER=clang++-19 \
	  -DCMAKE_CXX_FLAGS="-O1 -g1 $(INLINED) -fsanitize=address,undefined,float-cast-overflow -fno-sanitize-recover=all" > $(CXX_SANITIZED).log 2>&1 \
	  || (cat $(CXX_SANITIZED).log; false)
	@$(WATCHED) "compiling with sanitizers" -- $(BIN)/cmake --build $(CXX_SANITIZED) $(addprefix --target ,$(CXX_WITH_SANITIZERS))

proof-sanitizers: proof-sanitized
	@$(WATCHED) "C++ tests with sanitizers" --keep "tests passed" -- tests/proof/sanitizers.sh "$(REPEATED)" $(addprefix $(CXX_SANITIZED)/tests/cpp/,$(CXX_WITH_SANITIZERS))

proof-long: proof-sanitized  ## the long walks with sanitizers; SHARE=3 of 28 for a third day
	@$(WATCHED) "long walks with sanitizers" --keep "tests passed" -- $(BIN)/ctest --test-dir $(CXX_SANITIZED) --parallel $$(nproc) \
	  --output-on-failure --tests-regex "$(REPEATED)" $(call labels,$(CXX_WITH_SANITIZERS)) \
	  $$([ $(SHARE) = 0 ] || echo "--tests-information $(SHARE),,28")

proof-threads: proof-tools
	@$(WATCHED) "threads" --show -- tests/proof/threads.sh $(THREAD_TESTS)

# in four weeks of shares 28 different walks from the same seeds
proof-fuzz: proof-tools
	@$(WATCHED) "fuzz" --show -- tests/proof/fuzz.sh 40 $$(($(SHARE) + 1))

fuzz: proof-tools  ## MINUTES=10: the fuzzer alone, for longer
	@$(WATCHED) "fuzz" --show -- tests/proof/fuzz.sh $$(($(MINUTES) * 60))

# Where the studio looks for it: what is there goes into the source distribution and the wheels, so that a user needs no clang.
WASM := src/needleforce/studio/core
wasm: $(WASM)/needleforce.wasm  ## the core for WebAssembly and its module, in src/needleforce/studio/core

$(WASM)/needleforce.wasm: $(shell find include bindings/c bindings/wasm -type f) | .venv/.made
	@PYTHON=$(PYTHON) tools/system_packages.sh proof
	@$(WATCHED) "WebAssembly" -- bindings/wasm/build.sh $(WASM)

studio-static: setup wasm  ## the studio's simulator as files for any web server, in build/studio
	@$(BIN)/needleforce studio --static build/studio

bench: setup .venv/.test-packages  ## the bars as ratios, measured in one run
	@$(WATCHED) "packages to compare with" -- $(INSTALL) --requirement benchmarks/requirements.txt
	@$(BIN)/python benchmarks/run.py $(BENCH)

bench-full: BENCH = --full
bench-full: bench  ## the same with the full counts of recordings

# PYTHONS="/usr/bin/python3.11 ..." names the Pythons, instead of those on the search path and of pyenv
wheel: setup wasm .venv/.wheel-packages  ## dist/: source distribution and wheels, audited, and tried with every Python here
	@$(WATCHED) "wheels" --show -- $(BIN)/python tools/make_wheels.py
	@$(WATCHED) "trial of the wheels" --show -- $(BIN)/python tools/try_wheel.py dist/*.whl

# one of the objects that are compiled already
try-wheel: setup wasm .venv/.test-packages
	@$(WATCHED) "a wheel" -- $(BIN)/python tools/make_wheels.py --this
	@$(WATCHED) "trial of the wheel" --show -- $(BIN)/python tools/try_wheel.py --this build/wheels/python/*.whl

lint: .venv/.lint-packages  ## formatters and linters, changing nothing
	@$(BIN)/ruff check $(PYTHON_SOURCES)
	@$(BIN)/ruff format --check $(PYTHON_SOURCES)
	@$(BIN)/clang-format --dry-run --Werror $(CXX_SOURCES)
	@$(BIN)/codespell
	@$(BIN)/check-jsonschema --quiet --builtin-schema vendor.github-workflows .github/workflows/*.yml
	@$(BIN)/check-jsonschema --quiet --builtin-schema vendor.citation-file-format CITATION.cff

format: .venv/.lint-packages  ## the same, changing files
	@$(BIN)/ruff check --fix $(PYTHON_SOURCES)
	@$(BIN)/ruff format $(PYTHON_SOURCES)
	@$(BIN)/clang-format -i $(CXX_SOURCES)

# where there is a clang, the first page shows the studio
docs: setup  ## the pages of docs/ as HTML in build/docs
	@! command -v clang++-19 > /dev/null || $(MAKE) --no-print-directory wasm
	@$(WATCHED) "packages for the pages" -- $(INSTALL) --requirement docs/requirements.txt
	@$(WATCHED) "pages" -- $(BIN)/sphinx-build -W --show-traceback docs build/docs
	@$(WATCHED) "links" --show -- $(BIN)/python tools/check_links.py build/docs
	@echo "build/docs/index.html"

reference: setup  ## FILE=values.json through the public names: name, expected, got, pass
	@$(BIN)/python tests/reference.py $(FILE)

clean:  ## everything that was built, .venv included
	@rm -rf .venv build demo dist docs/reference/laws $(addprefix docs/reference/,api.md commands.md needle_file.md presets.md) docs/tutorials/files docs/gallery/pictures src/needleforce/studio/core src/needleforce/core src/needleforce/core.*
