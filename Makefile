# `make help` lists the commands. Everything is set up in .venv and build; nothing outside this folder is touched.
PYTHON ?= python3
CXX ?= g++
JOBS ?= $(shell nproc 2>/dev/null || echo 2)
DEMO_DIR ?= build/demo
export PIP_DISABLE_PIP_VERSION_CHECK := 1
export CXX
# Packages are installed without bytecode: it is written as they are imported, once and not by each of the many interpreters of the tests,
# whatever the environment says.
unexport PYTHONDONTWRITEBYTECODE

# Recorded data, for the tests and the part of the demo that use real drives; both go without it where there is none.
ifeq ($(origin GAIDENT_DATA),undefined)
ifneq ($(wildcard ../shared/data),)
export GAIDENT_DATA := $(abspath ../shared/data)
endif
endif

BIN := .venv/bin
PIP_INSTALL := $(BIN)/python -m pip install --quiet --no-compile
# Built in folders that stay, so that a small change is a small build. The checks take warnings for errors, and build the C++ tests and
# the benchmark from the same objects at the same time.
PACKAGE := --no-build-isolation --config-settings=build-dir=build/python
CHECKED := --no-build-isolation --config-settings=build-dir=build/checked \
	$(patsubst %,--config-settings=cmake.define.GAIDENT_%=ON,WERROR TESTS BENCH)
CMAKE := $(BIN)/cmake -S . -G Ninja -DCMAKE_MAKE_PROGRAM=$(abspath $(BIN)/ninja)
CTEST := $(BIN)/ctest --output-on-failure --no-tests=error -j $(JOBS) --test-dir
export CMAKE_BUILD_PARALLEL_LEVEL := $(JOBS)

# Folders stand in the list for files that were added or deleted.
SOURCES := pyproject.toml CMakeLists.txt LICENSE README.md \
	$(shell find csrc python -name '__pycache__' -prune -o \( -type d -o -name '*.?pp' -o -name '*.py' -o -name '*.pyi' -o -name py.typed \) -print)

# One thing after the other, but for what `test` may do at the same time.
ifndef SIDE_BY_SIDE
.NOTPARALLEL:
endif
.PHONY: help install demo test fuzz bench real bare oldest embedded wasm try wheel windows arm64 tidy docs lint test-cpp test-python test-long clean build-checked test-checked test-sanitized test-extension test-threads
.DEFAULT_GOAL := help

help: ## list the commands
	@sed -n 's/^\([a-z-]*\):.*## /  make \1@/p' $(MAKEFILE_LIST) | column -t -s @ 2>/dev/null || sed -n 's/^\([a-z-]*\):.*## /  make \1: /p' $(MAKEFILE_LIST)

install: .venv/.installed ## set up .venv and install the package into it

demo: .venv/.installed ## identify a two-mass drive, find a hidden friction; text on the screen, pictures in build/demo
	@$(BIN)/gaident demo --out "$(DEMO_DIR)"

# What comes from the network beside what needs the compiler, then the tests.
test: ## the tests, C++ and Python, but for the long ones
	@$(MAKE) --no-print-directory --jobs=2 --output-sync=target SIDE_BY_SIDE=yes .venv/.requirements build-checked
	@$(MAKE) --no-print-directory test-checked test-python

lint: .venv/.requirements .venv/.tidied ## ruff and mypy, what Windows has otherwise included
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/mypy --platform win32 python/gaident/files.py

test-cpp: test-checked test-sanitized

build-checked: .venv/.built
	$(BIN)/cmake --build build/checked

test-checked: build-checked
	$(CTEST) build/checked

SANITIZED := $(CMAKE) -B build/sanitized -DGAIDENT_SANITIZE=ON -DGAIDENT_BENCH=OFF
test-sanitized: .venv/.tools ## the C++ tests again under AddressSanitizer and UBSan, and every header compiled alone
	@mkdir -p build/sanitized
	$(SANITIZED) -DGAIDENT_PYTHON=OFF > build/sanitized/configure.log || { cat build/sanitized/configure.log; exit 1; }
	$(BIN)/cmake --build build/sanitized --target all all_verify_interface_header_sets
	$(CTEST) build/sanitized

# From the same objects. Python itself is not built for AddressSanitizer, whose library has to be the first that is loaded; that of C++
# beside it, for the sanitizer asks for its exceptions before the extension brings it. With PYTHONMALLOC=malloc the sanitizer sees each
# block of Python; leaks are not counted, for Python frees little at its end.
GCC_LIBRARIES := libasan.so libubsan.so libstdc++.so
UNDER_SANITIZERS = LD_PRELOAD="$(foreach library,$(GCC_LIBRARIES),$(shell $(CXX) -print-file-name=$(library)))" PYTHONMALLOC=malloc \
	ASAN_OPTIONS=detect_leaks=0:detect_stack_use_after_return=1 UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1 \
	PYTHONPATH="$(abspath build/sanitized/package)" GAIDENT_SLOWER=20
# It has to be reported, else no sanitizer would be there.
BEYOND_THE_END := import numpy as np; from gaident import _core; one = np.ones(1); \
	_core.filtered(one, one, np.lib.stride_tricks.as_strided(np.ones(8), (1, 999)), [999])
# The first with those that are long, but for whole diagnoses of records of other sizes.
HOSTILE_TESTS := $(addprefix tests/python/trust/,test_hostile_arguments.py test_drawn_arguments.py) --deselect \
	tests/python/trust/test_hostile_arguments.py::test_a_size_that_no_drive_has_ends_in_a_verdict_or_one_error
CORE_TESTS := $(addprefix tests/python/,trust/test_hostile_records.py trust/test_interpreter.py models controllers/test_servo.py \
	identification/test_identify.py)
test-extension: .venv/.requirements ## Python tests with the extension under AddressSanitizer and UBSan, for GCC (docs/trust.md)
	@for library in $(GCC_LIBRARIES); do case "$$($(CXX) -print-file-name=$$library)" in /*) ;; \
		*) echo "'$(CXX)' has no $$library: make CXX=g++ $@" >&2; exit 1;; esac; done
	@mkdir -p build/sanitized
	$(SANITIZED) -DGAIDENT_PYTHON=ON -DPython_EXECUTABLE="$(abspath $(BIN)/python)" \
		-Dpybind11_DIR="$$($(BIN)/python -m pybind11 --cmakedir)" > build/sanitized/configure.log || { cat build/sanitized/configure.log; exit 1; }
	$(BIN)/cmake --build build/sanitized --target _core
	@rm -rf build/sanitized/package && mkdir build/sanitized/package && cp -R python/gaident build/sanitized/package
	@$(BIN)/cmake --install build/sanitized --component python --prefix build/sanitized/package > build/sanitized/install.log
	@$(UNDER_SANITIZERS) $(BIN)/python -c "$(BEYOND_THE_END)" 2> build/sanitized/beyond.log; \
		grep -q heap-buffer-overflow build/sanitized/beyond.log || { cat build/sanitized/beyond.log; exit 1; }
	$(UNDER_SANITIZERS) $(PYTEST) $(HOSTILE_TESTS)
	$(UNDER_SANITIZERS) $(PYTEST) -m "not long" $(CORE_TESTS)

# What runs on several threads; ctest takes one at a time, for the sanitizer takes five times the memory.
THREADED := test_parallel test_engine test_batch test_denormals test_counting
test-threads: .venv/.tools ## the C++ tests that use several threads, under ThreadSanitizer (docs/trust.md)
	@mkdir -p build/threads
	$(CMAKE) -B build/threads -DGAIDENT_SANITIZE=thread -DGAIDENT_BENCH=OFF > build/threads/configure.log || { cat build/threads/configure.log; exit 1; }
	$(BIN)/cmake --build build/threads --target $(THREADED)
	TSAN_OPTIONS=halt_on_error=1:second_deadlock_stack=1 $(BIN)/ctest --output-on-failure --no-tests=error --test-dir build/threads \
		-R '^($(subst $(eval ) ,|,$(strip $(THREADED))))$$'

PYTEST := $(BIN)/python -m pytest -n $(JOBS) --dist worksteal

test-python: .venv/.tested
	$(PYTEST) -m "not long"

test-long: .venv/.tested ## the Python tests that take more than two seconds each: whole diagnoses, some twenty minutes
	$(PYTEST) -m long

fuzz: .venv/.tested ## damaged files of every format and tables with known values, some minutes (docs/trust.md); FUZZ_FLAGS, ORACLE_FLAGS
	$(BIN)/python tests/fuzz/run.py --workers $(JOBS) $(FUZZ_FLAGS)
	$(BIN)/python tests/fuzz/oracle.py --workers $(JOBS) $(ORACLE_FLAGS)

bench: .venv/.tools ## build (plainly, without Python) and run the C++ benchmark; BENCH_FLAGS=... goes to it
	@mkdir -p build/plain
	$(CMAKE) -B build/plain > build/plain/configure.log || { cat build/plain/configure.log; exit 1; }
	$(BIN)/cmake --build build/plain --target gaident_bench
	build/plain/bench/gaident_bench $(BENCH_FLAGS)

real: .venv/.tested ## measured drives diagnosed and fitted (GAIDENT_DATA); fails where an answer is worse than the table's; REAL_FLAGS
	@rm -f build/real.jsonl
	$(BIN)/python bench/real.py --check --workers $(JOBS) --out build/real.jsonl $(REAL_FLAGS)

# From the objects of `test`: what stands in pyproject.toml for a build is in .venv already, and nothing else is.
bare: .venv/.tested ## the package in an empty environment, with what it installs itself
	@rm -rf build/bare
	$(BIN)/python -m pip wheel --quiet --no-deps $(CHECKED) --wheel-dir build/bare .
	$(PYTHON) -m venv build/bare/env
	build/bare/env/bin/python -m pip install --quiet build/bare/*.whl
	cd build/bare && env/bin/gaident --help > help.txt && env/bin/gaident doctor

# No part of CI yet: numpy 1.23.5 and 1.24.0 ended in a segmentation fault, not in every run; 1.26.0 did not, in three runs of 995 tests.
oldest: ## after `bare`, in its environment: the oldest versions that the package allows
	$(call listed,dependencies) | sed -n '/;/!s/>=/==/p' > build/bare/oldest.txt
	$(call listed,pictures) | sed 's/>=/==/' >> build/bare/oldest.txt
	build/bare/env/bin/python -m pip install --quiet --only-binary :all: -r build/bare/oldest.txt pytest hypothesis "mpmath==1.3.*"
	cd build/bare && env/bin/gaident doctor && env/bin/gaident demo --quiet --out demo
	env -u GAIDENT_DATA build/bare/env/bin/python -m pytest -q -p no:cacheprovider -m "not long" $(WHEEL_TESTS)

embedded: ## the search in a drive, on two emulated Cortex-M boards, compared bit for bit (docs/dsp.md)
	@csrc/embedded/tools.sh
	@$(MAKE) --no-print-directory -f csrc/embedded/embedded.mk OUT=build/embedded

wasm: .venv/.installed ## the core as WebAssembly, compared bit for bit in node; the page that identifies in a browser (docs/try.md)
	@csrc/embedded/tools.sh wasm
	@$(MAKE) --no-print-directory --jobs=$(JOBS) -f csrc/wasm/wasm.mk OUT=build/wasm
	@$(MAKE) --no-print-directory try

# The page alone.
try: .venv/.installed
	@$(MAKE) --no-print-directory --silent --jobs=$(JOBS) -f csrc/wasm/wasm.mk OUT=build/wasm core
	$(BIN)/python docs/tools/try_page.py build/wasm/core.js build/try/index.html

# What a user gets who has no compiler: only the environment's own programs are on the path; the demo runs without and with what draws,
# and the tests in WHEEL_TESTS. Fails where an installation without extras has 200 MB of files.
WHEEL := build/wheel
WHEEL_TESTS := $(addprefix tests/python/,models/test_simulate.py data/test_record.py data/test_read.py show/test_saved_0_1.py \
	cli/test_no_pictures.py trust/test_files.py)
WITHOUT_COMPILER = env -u GAIDENT_DATA PATH="$(abspath $(WHEEL)/bare/bin)"

# From the objects of `test`, as `bare`.
wheel: .venv/.tested .venv/.released ## this machine's wheel, installed and tried in an empty environment without a compiler
	@rm -rf $(WHEEL) && mkdir -p $(WHEEL)/out
	$(BIN)/python -m pip wheel --quiet --no-deps $(CHECKED) --wheel-dir $(WHEEL)/built .
	PATH="$(abspath $(BIN)):$$PATH" $(BIN)/auditwheel repair --wheel-dir $(WHEEL)/repaired $(WHEEL)/built/*.whl
	$(BIN)/python -m twine check --strict $(WHEEL)/repaired/*.whl
	$(PYTHON) -m venv $(WHEEL)/bare
	$(WHEEL)/bare/bin/python -m pip install --quiet --only-binary :all: $(WHEEL)/repaired/*.whl
	@for name in cc c++ gcc g++ clang cmake ninja make; do ! $(WITHOUT_COMPILER) /bin/sh -c "command -v $$name" || exit 1; done
	$(BIN)/python docs/tools/sizes.py $(WHEEL)/bare
	cd $(WHEEL)/out && $(WITHOUT_COMPILER) gaident doctor
	cd $(WHEEL)/out && $(WITHOUT_COMPILER) gaident demo --quiet --out without_pictures
	$(WHEEL)/bare/bin/python -m pip install --quiet --only-binary :all: "$$(echo $(WHEEL)/repaired/*.whl)[pictures]" pytest hypothesis "mpmath==1.3.*"
	cd $(WHEEL)/out && $(WITHOUT_COMPILER) gaident demo --quiet --out demo
	$(WITHOUT_COMPILER) $(WHEEL)/bare/bin/python -m pytest -q -p no:cacheprovider $(WHEEL_TESTS)
	@ls -l $(WHEEL)/repaired/*.whl

# The C++ tests of another system, NAME, by tests/cpp/NAME.cmake. Only the programs: what ctest has beside them calls a shell.
# -O1: half the compile time of -O3, the same bits. One test comes first, alone: two at a time would both make the folder of Wine.
# That folder is removed: it has a link to the whole file system, which the making of an sdist would follow.
define cross_tested
	@mkdir -p build/$(1)
	$(CMAKE) -B build/$(1) --toolchain tests/cpp/$(1).cmake -DGAIDENT_BENCH=OFF -DGAIDENT_WERROR=OFF -DCMAKE_CXX_FLAGS_RELEASE=-O1 \
		> build/$(1)/configure.log || { cat build/$(1)/configure.log; exit 1; }
	$(BIN)/cmake --build build/$(1)
	@WINEDEBUG=-all WINEPREFIX="$(abspath build/$(1)/wine)" $(BIN)/ctest --test-dir build/$(1) -I 1,1 > build/$(1)/first.log || true
	WINEDEBUG=-all WINEPREFIX="$(abspath build/$(1)/wine)" $(CTEST) build/$(1) -R '^test_'; ended=$$?; rm -rf build/$(1)/wine; exit $$ended
endef

windows: .venv/.tools ## the C++ tests as Windows programs under Wine, for which Debian has g++-mingw-w64-x86-64-posix and wine
	$(call cross_tested,windows)

arm64: .venv/.built ## the C++ tests on an emulated ARM64, and the recurrences there compared bit for bit
	@csrc/embedded/tools.sh arm64
	$(call cross_tested,arm64)
	qemu-aarch64-static build/arm64/tests/cpp/bits > build/arm64/bits.arm64
	build/checked/tests/cpp/bits > build/arm64/bits.here
	cmp build/arm64/bits.here build/arm64/bits.arm64
	@echo "ARM64: $$(wc -l < build/arm64/bits.here) lines equal to this machine's, bit for bit"

tidy: .venv/.tidied ## repair and format the Python and C++ sources
	$(BIN)/ruff check --fix-only .
	$(BIN)/ruff format .
	$(BIN)/clang-format -i $$(find csrc bench tests/cpp -name '*.?pp' -o -path 'csrc/embedded/*.[ch]')

# Pictures and formulas from the core, the tutorial run; warnings are errors (but not with --quiet, which hides them from --strict).
docs: .venv/.documented ## build the documentation into build/docs
	$(BIN)/python -W error docs/tools/pictures.py docs/pictures
	$(BIN)/python -W error docs/tools/run_pages.py
	@if command -v em++ >/dev/null; then $(MAKE) --no-print-directory try; else echo "without the page docs/try: no emscripten here" >&2; fi
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict
	@echo "written: build/docs/index.html"

clean: ## remove everything that these commands made
	rm -rf build docs/pictures .venv .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find python tests bench -name __pycache__ -prune -exec rm -rf {} +

# $(call listed,NAME): a list of pyproject.toml, a line each.
listed = $(BIN)/python -c 'import ast, re; print(*ast.literal_eval(re.search(r"(?ms)^$(1) = (\[[^\n]*\]|\[.*?^\])", open("pyproject.toml").read())[1]), sep="\n")'

# The environment, in steps. A stamp is renewed when what it was made from changes.
.venv/.tools: pyproject.toml Makefile
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' || { echo "gaident needs Python 3.10 or newer as '$(PYTHON)' (name another one: make PYTHON=python3.12 ...)" >&2; exit 1; }
	@$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || { echo "Python's venv module is missing; on Debian: apt install python3-venv" >&2; exit 1; }
	@$(PYTHON) -c 'import os, sysconfig; open(os.path.join(sysconfig.get_path("include"), "Python.h")).close()' 2>/dev/null || { echo "Python.h is missing; on Debian: apt install python3-dev" >&2; exit 1; }
	@command -v $(firstword $(CXX)) >/dev/null || { echo "no C++ compiler '$(CXX)'; on Debian: apt install g++" >&2; exit 1; }
	$(PYTHON) -m venv .venv
	@$(call listed,requires) > .venv/build-requires.txt
	$(PIP_INSTALL) -r .venv/build-requires.txt cmake ninja
	@touch $@

.venv/.installed: .venv/.tools $(SOURCES)
	$(PIP_INSTALL) $(PACKAGE) ".[pictures]"
	@touch $@

# What the tests need, and the package built for them, apart: the first waits for the network, the second for the compiler.
.venv/.requirements: .venv/.tools
	@$(call listed,dependencies) > .venv/requires.txt && $(call listed,test) >> .venv/requires.txt
	$(PIP_INSTALL) -r .venv/requires.txt
	@touch $@

.venv/.built: .venv/.tools $(SOURCES)
	$(PIP_INSTALL) --no-deps $(CHECKED) .
	@touch $@

.venv/.tested: .venv/.requirements .venv/.built
	@touch .venv/.installed $@

.venv/.documented: .venv/.installed
	@$(call listed,docs) > .venv/docs-requires.txt
	$(PIP_INSTALL) -r .venv/docs-requires.txt
	@touch $@

.venv/.released: .venv/.tools
	@$(call listed,release) > .venv/release-requires.txt
	$(PIP_INSTALL) -r .venv/release-requires.txt
	@touch $@

.venv/.tidied: .venv/.tools
	@$(call listed,tidy) > .venv/tidy-requires.txt
	$(PIP_INSTALL) -r .venv/tidy-requires.txt
	@touch $@
