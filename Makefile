# SPDX-License-Identifier: Apache-2.0
# needleforce: `make help` lists what can be asked. Every target does its own set-up in .venv.
PYTHON ?= python3
BIN := .venv/bin
CORE_SOURCES := $(shell find include bindings -type f) CMakeLists.txt pyproject.toml
PYTHON_SOURCES := src tests benchmarks examples
CXX_SOURCES := $(shell find include bindings integrations tests examples benchmarks -name '*.hpp' -o -name '*.cpp' -o -name '*.h' -o -name '*.c')
CXX_TESTS := build/cpp
CXX_SANITIZED := build/sanitized
# every test in which one thread speaks to another
THREAD_TESTS := tests/cpp/exchange.cpp tests/cpp/swap.cpp tests/cpp/flight_recorder.cpp
MINUTES ?= 10
FILE ?= tests/reference_values.json

.DEFAULT_GOAL := help
.PHONY: help setup demo test test-cpp test-python proof proof-tools proof-effects proof-symbols proof-sanitizers proof-threads \
        proof-fuzz fuzz wasm bench bench-full lint format docs reference clean

help:  ## this list
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 14

.venv/.packages: constraints.txt tools/system_packages.sh
	@PYTHON=$(PYTHON) tools/system_packages.sh core
	@test -x $(BIN)/python || $(PYTHON) -m venv .venv
	@echo "setting up .venv (once)"
	@$(BIN)/pip install --quiet --disable-pip-version-check --requirement constraints.txt
	@touch $@

.venv/.core: .venv/.packages $(CORE_SOURCES)
	@echo "compiling the core"
	@$(BIN)/pip install --quiet --disable-pip-version-check --no-build-isolation --no-deps --editable .
	@touch $@

setup: .venv/.core  ## virtual environment, pinned packages, compiled core

demo: setup  ## the paper's experiment reproduced: table, demo/report.html, demo/results.json
	@$(BIN)/needleforce demo --out demo

test: setup test-cpp test-python  ## every test

test-cpp: .venv/.packages
	@PYTHON=$(PYTHON) tools/system_packages.sh tests
	@mkdir -p $(CXX_TESTS)
	@$(BIN)/cmake -S . -B $(CXX_TESTS) -G Ninja -DCMAKE_MAKE_PROGRAM=$(CURDIR)/$(BIN)/ninja -DNEEDLEFORCE_TESTS=ON -DCMAKE_BUILD_TYPE=Release > $(CXX_TESTS).log 2>&1 \
	  || (cat $(CXX_TESTS).log; false)
	@$(BIN)/cmake --build $(CXX_TESTS) > $(CXX_TESTS).log 2>&1 || (cat $(CXX_TESTS).log; false)
	@$(BIN)/ctest --test-dir $(CXX_TESTS) --output-on-failure

test-python: setup
	@$(BIN)/python -m pytest -n auto --dist loadfile

proof: proof-effects proof-symbols proof-sanitizers proof-threads proof-fuzz  ## the real-time claims, by compiler, sanitizers and fuzzer

proof-tools: .venv/.packages
	@PYTHON=$(PYTHON) tools/system_packages.sh proof
	@$(BIN)/pip install --quiet --disable-pip-version-check --requirement tests/proof/requirements.txt

proof-effects: proof-tools
	@tests/proof/function_effects.sh

proof-symbols: .venv/.packages
	@tests/proof/symbols.sh

# the energy controller's walks of a million steps are left to the fuzzer, which has the same sanitizers and runs faster
proof-sanitizers: proof-tools
	@mkdir -p $(CXX_SANITIZED)
	@$(BIN)/cmake -S . -B $(CXX_SANITIZED) -G Ninja -DCMAKE_MAKE_PROGRAM=$(CURDIR)/$(BIN)/ninja -DNEEDLEFORCE_TESTS=ON \
	  -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_COMPILER=clang++-19 \
	  -DCMAKE_CXX_FLAGS="-g1 -fsanitize=address,undefined,float-cast-overflow -fno-sanitize-recover=all" > $(CXX_SANITIZED).log 2>&1 \
	  || (cat $(CXX_SANITIZED).log; false)
	@$(BIN)/cmake --build $(CXX_SANITIZED) > $(CXX_SANITIZED).log 2>&1 || (cat $(CXX_SANITIZED).log; false)
	@for tests in $(CXX_SANITIZED)/tests/cpp/*_tests; do $$tests --gtest_brief=1 --gtest_filter=-EnergyController.* > $(CXX_SANITIZED).log 2>&1 || { cat $(CXX_SANITIZED).log; exit 1; }; done
	@echo "sanitizers: nothing found in the C++ tests"

proof-threads: proof-tools
	@tests/proof/threads.sh $(THREAD_TESTS)

proof-fuzz: proof-tools
	@tests/proof/fuzz.sh 60 1

fuzz: proof-tools  ## MINUTES=10: the fuzzer alone, for longer
	@tests/proof/fuzz.sh $$(($(MINUTES) * 60))

wasm: .venv/.packages  ## the core for WebAssembly and its module, in build/wasm
	@PYTHON=$(PYTHON) tools/system_packages.sh proof
	@bindings/wasm/build.sh build/wasm

bench: setup  ## the bars as ratios, measured in one run
	@$(BIN)/pip install --quiet --disable-pip-version-check --requirement benchmarks/requirements.txt
	@$(BIN)/python benchmarks/run.py $(BENCH)

bench-full: BENCH = --full
bench-full: bench  ## the same with the full counts of recordings

lint: .venv/.packages  ## formatters and linters, changing nothing
	@$(BIN)/ruff check $(PYTHON_SOURCES)
	@$(BIN)/ruff format --check $(PYTHON_SOURCES)
	@$(BIN)/clang-format --dry-run --Werror $(CXX_SOURCES)
	@$(BIN)/codespell

format: .venv/.packages  ## the same, changing files
	@$(BIN)/ruff check --fix $(PYTHON_SOURCES)
	@$(BIN)/ruff format $(PYTHON_SOURCES)
	@$(BIN)/clang-format -i $(CXX_SOURCES)

docs: setup  ## the pages of docs/ as HTML in build/docs
	@$(BIN)/pip install --quiet --disable-pip-version-check --requirement docs/requirements.txt
	@$(BIN)/sphinx-build -q -W docs build/docs && echo "build/docs/index.html"

reference: setup  ## FILE=values.json through the public names: name, expected, got, pass
	@$(BIN)/python tests/reference.py $(FILE)

clean:  ## everything that was built, .venv included
	@rm -rf .venv build demo docs/laws docs/api.md
