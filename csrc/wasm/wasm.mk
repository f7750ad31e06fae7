# Builds the core for WebAssembly, and the programs that print its bits (bits.cpp, search_bits.cpp in tests/cpp) for WebAssembly and
# for this machine; runs the first in node, compares line by line. Called by `make wasm` at the top.
#
#     core     $(OUT)/core.js: the C interface in one file, no threads, for the page docs/try
OUT ?= build/wasm
CXX ?= g++
NODE ?= node
EMXX := em++
# Debian's node modules, which Debian's emscripten asks for and another node does not look at.
export NODE_PATH := $(NODE_PATH):/usr/share/nodejs

CORE := csrc/gaident
HERE := csrc/wasm
PLANT := $(wildcard $(addprefix $(CORE)/,simulation/*.cpp runtime/*.cpp)) \
	$(addprefix $(CORE)/simulation/kernels/,dispatch.cpp kernel_baseline.cpp)
EFFECTS := $(wildcard $(CORE)/nonlinear/*.cpp) \
	$(addprefix $(CORE)/nonlinear/kernels/,dispatch_effects.cpp kernel_effects_baseline.cpp)
ROOMS := genetic search estimation identification target plant numeric
SEARCH := $(wildcard $(ROOMS:%=$(CORE)/%/*.cpp)) $(HERE)/interface.cpp
SOURCES := $(PLANT) $(EFFECTS) $(SEARCH) tests/cpp/bits.cpp tests/cpp/search_bits.cpp
HEADERS := $(shell find $(CORE) tests/cpp $(HERE) -name '*.hpp' -o -name '*.h')
vpath %.cpp $(sort $(dir $(SOURCES)))

objects = $(addsuffix .o,$(addprefix $(OUT)/$1/,$(basename $(notdir $2))))
BITS := $(PLANT) $(EFFECTS) tests/cpp/bits.cpp
SEARCH_BITS := $(PLANT) $(SEARCH) tests/cpp/search_bits.cpp

FLAGS := -std=c++20 -ffp-contract=off -Wno-psabi -I csrc -I tests/cpp
# Exceptions are WebAssembly's own; fused products are made two at a time (numeric/fused_wasm.hpp).
WASM := -fwasm-exceptions -msimd128
LINK := $(WASM) -O2 -sSINGLE_FILE -sWASM_ASYNC_COMPILATION=0 -sALLOW_MEMORY_GROWTH -sTOTAL_STACK=4MB
EMPTY :=
COMMA := ,
OPEN := (
EXPORTED := $(shell sed -nE 's/^[a-z].*[ *](gaident_[a-z_]*)[$(OPEN)].*/_\1/p' $(HERE)/interface.h) _malloc _free

.PHONY: all core
.SECONDARY:
.DELETE_ON_ERROR:
all: $(OUT)/bits.checked $(OUT)/search_bits.checked core
	@cat $(OUT)/bits.checked $(OUT)/search_bits.checked
core: $(OUT)/core.js

$(OUT)/core.js: $(call objects,wasm,$(PLANT) $(SEARCH))
	$(EMXX) $(LINK) -sMODULARIZE -sEXPORT_NAME=gaidentCore -sENVIRONMENT=worker,node -sFILESYSTEM=0 \
		-sEXPORTED_FUNCTIONS=$(subst $(EMPTY) $(EMPTY),$(COMMA),$(EXPORTED)) -sEXPORTED_RUNTIME_METHODS=UTF8ToString -o $@ $^

$(OUT)/%.checked: $(OUT)/%.here.txt $(OUT)/%.wasm.txt
	cmp $^
	@echo "WebAssembly: $$(wc -l < $<) lines of $* equal to this machine's, bit for bit" > $@

# As a processor without the instruction runs the C library: with it exp and log have other last bits.
# (Other libraries take no notice.)
$(OUT)/%.here.txt: $(OUT)/%.here
	GLIBC_TUNABLES=glibc.cpu.hwcaps=-FMA,-FMA4,-AVX2,-FMA_Usable,-FMA4_Usable,-AVX2_Usable $< > $@
$(OUT)/%.wasm.txt: $(OUT)/%.js
	timeout 600 $(NODE) $< > $@

$(OUT)/bits.js: $(call objects,wasm,$(BITS))
$(OUT)/search_bits.js: $(call objects,wasm,$(SEARCH_BITS))
$(OUT)/bits.js $(OUT)/search_bits.js:
	$(EMXX) $(LINK) -o $@ $^
$(OUT)/bits.here: $(call objects,here,$(BITS))
$(OUT)/search_bits.here: $(call objects,here,$(SEARCH_BITS))
$(OUT)/bits.here $(OUT)/search_bits.here:
	$(CXX) -o $@ $^ -lpthread

# The loops with effects are for the comparison only. Less than -O1 has too many local variables for WebAssembly.
$(OUT)/here/kernel_effects_baseline.o: optimise := -O0
$(OUT)/wasm/kernel_effects_baseline.o: optimise := -O1
$(OUT)/wasm/%.o: %.cpp $(HEADERS)
	@mkdir -p $(@D)
	$(EMXX) $(FLAGS) -Wno-ignored-attributes $(WASM) $(or $(optimise),-O2) -c -o $@ $<
$(OUT)/here/%.o: %.cpp $(HEADERS)
	@mkdir -p $(@D)
	$(CXX) $(FLAGS) $(or $(optimise),-O1) -c -o $@ $<
