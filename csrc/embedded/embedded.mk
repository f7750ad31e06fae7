# Builds the drive's programs for two emulated processors and for this machine, runs them, compares line by line, reports memory and
# instructions. Called by `make embedded` at the top.
OUT ?= build/embedded
CXX ?= g++
CC ?= cc
CROSS := arm-none-eabi-
QEMU := qemu-system-arm
HERE := csrc/embedded

WARNINGS := -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Werror
COMMON := -O2 -ffp-contract=off -I$(OUT) -I$(HERE)
CORE := -std=c++20 -ffreestanding -fno-exceptions -fno-rtti -fno-threadsafe-statics
SMALL := -ffunction-sections -fdata-sections -fno-tree-loop-distribute-patterns
LINK := -nostdlib -nostartfiles -T $(HERE)/mps2.ld -Wl,--gc-sections -Wl,--fatal-warnings

M4 := -mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16
M7 := -mcpu=cortex-m7 -mthumb -mfloat-abi=hard -mfpu=fpv5-d16

# program.processor.arithmetic
RUNS := identify.m4.Float identify.m4.Fixed identify.m7.Double slices.m4.Float
flags_m4 := $(M4)
flags_m7 := $(M7)
board_m4 := mps2-an386
board_m7 := mps2-an500

processor = $(word 2,$(subst ., ,$1))
arithmetic = $(word 3,$(subst ., ,$1))
program = $(word 1,$(subst ., ,$1))

SOURCES := $(wildcard $(HERE)/*) $(wildcard csrc/gaident/*/*.hpp) $(OUT)/genes.hpp $(OUT)/record.hpp $(OUT)/record.h

.PHONY: all
.DELETE_ON_ERROR:
all: $(RUNS:%=$(OUT)/%.checked)
	@cat $(^:.checked=.report)

$(OUT)/make_tables: $(HERE)/make_tables.cpp $(wildcard csrc/gaident/*/*.hpp)
	@mkdir -p $(OUT)
	$(CXX) -std=c++20 -O1 -ffp-contract=off $(WARNINGS) -o $@ $<
$(OUT)/genes.hpp: $(OUT)/make_tables
	$< genes > $@
$(OUT)/record.hpp: $(OUT)/make_tables
	$< record > $@
$(OUT)/record.h: $(OUT)/make_tables
	$< record c > $@

# $1: the run
define run_rules
$(OUT)/$1.elf: $(SOURCES)
	$(if $(filter slices,$(call program,$1)),\
	$(CROSS)gcc $(flags_$(call processor,$1)) $(COMMON) $(SMALL) $(WARNINGS) -std=c99 -ffreestanding -c -o $$@.main.o $(HERE)/slices.c,\
	$(CROSS)g++ $(flags_$(call processor,$1)) $(COMMON) $(SMALL) $(WARNINGS) $(CORE) -DGAIDENT_ARITHMETIC=$(call arithmetic,$1) -c -o $$@.main.o $(HERE)/identify.cpp)
	$(if $(filter slices,$(call program,$1)),\
	$(CROSS)g++ $(flags_$(call processor,$1)) $(COMMON) $(SMALL) $(WARNINGS) $(CORE) -DGAIDENT_ARITHMETIC=$(call arithmetic,$1) -c -o $$@.core.o $(HERE)/gaident.cpp)
	$(CROSS)gcc $(flags_$(call processor,$1)) $(COMMON) $(SMALL) -Wall -Wextra -Werror -std=c99 -ffreestanding -c -o $$@.board.o $(HERE)/mps2.c
	$(CROSS)gcc $(flags_$(call processor,$1)) $(LINK) -Wl,-Map=$$@.map -o $$@ $$@.main.o $(if $(filter slices,$(call program,$1)),$$@.core.o) $$@.board.o -lgcc

$(OUT)/$1.host: $(SOURCES)
	$(CC) $(COMMON) $(WARNINGS) -std=c99 -c -o $$@.board.o $(HERE)/host.c
	$(if $(filter slices,$(call program,$1)),\
	$(CC) $(COMMON) $(WARNINGS) -std=c99 -c -o $$@.main.o $(HERE)/slices.c,\
	$(CXX) $(COMMON) $(WARNINGS) $(CORE) -DGAIDENT_ARITHMETIC=$(call arithmetic,$1) -c -o $$@.main.o $(HERE)/identify.cpp)
	$(if $(filter slices,$(call program,$1)),\
	$(CXX) $(COMMON) $(WARNINGS) $(CORE) -DGAIDENT_ARITHMETIC=$(call arithmetic,$1) -c -o $$@.core.o $(HERE)/gaident.cpp)
	$(CC) -o $$@ $$@.main.o $(if $(filter slices,$(call program,$1)),$$@.core.o) $$@.board.o -lm

$(OUT)/$1.host.txt: $(OUT)/$1.host
	$$< > $$@

$(OUT)/$1.elf.txt: $(OUT)/$1.elf
	timeout 1200 $(QEMU) -M $(board_$(call processor,$1)) -nographic -monitor none -serial none -icount shift=3 \
		-semihosting-config enable=on,target=native -kernel $$< > $$@ 2>&1 || { tail -n 5 $$@; exit 1; }
endef
$(foreach run,$(RUNS),$(eval $(call run_rules,$(run))))

# Bit for bit: every line but this machine's own.
%.checked: %.elf.txt %.host.txt %.elf
	@grep -v '^#' $*.elf.txt > $*.elf.lines
	@grep -v '^#' $*.host.txt > $*.host.lines
	@test -s $*.host.lines
	cmp $*.elf.lines $*.host.lines
	@{ echo "$(notdir $*): $$(wc -l < $*.elf.lines) lines equal to this machine's, bit for bit"; \
	$(CROSS)size -A $*.elf | awk '$$1 == ".text" || $$1 == ".ARM.exidx" { f += $$2 } $$1 == ".data" { f += $$2; r += $$2 } \
		$$1 == ".bss" || $$1 == ".stack" { r += $$2 } END { printf "    flash %.1f of 96 KiB, RAM %.1f of 48 KiB (4 KiB of it stack)\n", f/1024, r/1024 }'; \
	grep '^# ' $*.elf.txt | sed 's/^#/   /'; tail -n 3 $*.elf.lines | head -n 2 | sed 's/^/    /'; } > $*.report
	@touch $@
