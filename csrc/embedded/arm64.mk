# Builds the program that prints the recurrences' bits (tests/cpp/bits.cpp) for ARM64 and for this machine, runs the first under an
# emulator, compares line by line. Called by `make embedded` at the top.
# Optimised little: bits do not depend on it, and the loops with effects take a minute more.
OUT ?= build/embedded
CXX ?= g++
CROSS_CXX := aarch64-linux-gnu-g++
QEMU := qemu-aarch64-static

CORE := csrc/gaident
SOURCES := tests/cpp/bits.cpp $(CORE)/runtime/parallel.cpp $(wildcard $(CORE)/simulation/*.cpp) \
	$(addprefix $(CORE)/simulation/kernels/,dispatch.cpp kernel_baseline.cpp) $(wildcard $(CORE)/nonlinear/*.cpp) \
	$(addprefix $(CORE)/nonlinear/kernels/,dispatch_effects.cpp kernel_effects_baseline.cpp)
HEADERS := $(shell find $(CORE) tests/cpp -name '*.hpp')
FLAGS := -std=c++20 -ffp-contract=off -Wno-psabi -I csrc -I tests/cpp
OBJECTS := $(notdir $(SOURCES:.cpp=.o))
vpath %.cpp $(sort $(dir $(SOURCES)))

.PHONY: all
.DELETE_ON_ERROR:
all: $(OUT)/arm64.txt $(OUT)/here.txt
	cmp $(OUT)/here.txt $(OUT)/arm64.txt
	@echo "ARM64: $$(wc -l < $(OUT)/arm64.txt) lines equal to this machine's, bit for bit"

$(OUT)/arm64.txt: $(OUT)/arm64/bits
	timeout 600 $(QEMU) $< > $@
$(OUT)/here.txt: $(OUT)/here/bits
	$< > $@

$(OUT)/arm64/bits: $(addprefix $(OUT)/arm64/,$(OBJECTS))
	$(CROSS_CXX) -static -o $@ $^ -lpthread
$(OUT)/here/bits: $(addprefix $(OUT)/here/,$(OBJECTS))
	$(CXX) -o $@ $^ -lpthread

$(OUT)/%/kernel_effects_baseline.o: optimise := -O0
$(OUT)/arm64/%.o: %.cpp $(HEADERS)
	@mkdir -p $(@D)
	$(CROSS_CXX) $(FLAGS) $(or $(optimise),-O1) -c -o $@ $<
$(OUT)/here/%.o: %.cpp $(HEADERS)
	@mkdir -p $(@D)
	$(CXX) $(FLAGS) $(or $(optimise),-O1) -c -o $@ $<
