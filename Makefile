# skinspec - `make help` lists what there is to make.

BUILD   ?= build
PREFIX  ?= /usr/local
DESTDIR ?=
CC      ?= cc
VERSION := $(shell sed -n 's/.*SKINSPEC_VERSION "\(.*\)"/\1/p' src/base/version.h)

# Contraction off: a fused multiply-add would make results differ between machines.
CFLAGS   ?= -O2 -g
WARNINGS := -Wall -Wextra -Wpedantic -Wconversion -Wshadow
ALL_CFLAGS = -std=c11 -D_POSIX_C_SOURCE=200809L -Isrc -I. -fPIC -pthread -ffp-contract=off \
             -ftree-vectorize $(WARNINGS) $(CFLAGS) $(EXTRA)
PACKAGES := sqlite3 nettle libcjson libsystemd
# Asked when a recipe runs, not when the Makefile is read: they may be installed by then.
WIRES    := libserialport libusb-1.0 libudev
MOCKS    := umockdev-1.0
WIDE_LIBS := -lmpfr -lgmp
PKG_CFLAGS = $(shell pkg-config --cflags $(PACKAGES) $(WIRES))
PKG_LIBS   = $(shell pkg-config --libs $(PACKAGES))
WIRES_LIBS = $(shell pkg-config --libs $(WIRES))
PICTURE_LIBS = $(shell pkg-config --libs libpng)

core_c  := $(wildcard src/base/*.c src/optics/*.c src/colour/*.c src/match/*.c src/plan/*.c)
db_c    := $(wildcard db/*.c)
json_c  := $(wildcard src/json/*.c)
station_c := $(wildcard src/station/*.c)
# What a client needs as well: the protocol and the shapes that travel by it.
wire_c  := $(patsubst %,src/station/%.c,protocol protocol_lines schema schema_compile schema_format strict_json wire wire_match wire_scene events)
drivers_c := $(wildcard drivers/*.c drivers/*/*.c)
# What a capture is, without the drivers that make one.
capture_c := drivers/driver.c drivers/link/capture.c drivers/link/capture_read.c
cli_c   := $(wildcard src/cli/*.c src/cube/*.c src/trial/*.c)
tests_c := $(wildcard tests/*/test_*.c)
# A driver may bring its own, and what they need: simulators, whatever the programs share.
own_tests_c := $(wildcard drivers/*/tests/test_*.c)
own_sims_c  := $(wildcard drivers/*/tests/sim_*.c)
own_support_c := $(filter-out $(own_tests_c) $(own_sims_c),$(wildcard drivers/*/tests/*.c))
# What stands for the instruments; wire_memory is the one that needs a driver's link.
sims_c  := $(filter-out tests/sim/test_%.c tests/sim/wire_memory.c,$(wildcard tests/sim/*.c)) $(own_sims_c)
support_c := $(wildcard tests/support/*.c $(addprefix tests/drivers/,contract.c cue.c capture_case.c)) $(sims_c) $(wildcard tests/sim/wire_memory.c) \
           $(own_support_c)
# What mocks the system's devices for unmodified programs, and the program that does.
mock_c  := $(wildcard tests/sim/mock/*.c)
fuzz_c  := $(wildcard tests/fuzz/*.c)
# High-precision twins, and the program that holds our functions against them.
stability_c := $(filter-out tests/stability/test_%,$(wildcard tests/stability/*.c))
accuracy_c := $(wildcard tests/accuracy/*.c)
accuracy_data = $(patsubst %,$(BUILD)/accuracy/%.csv,white-half-space white-two-layer coverage-half-space coverage-two-layer \
           placement-half-space placement-two-layer true-half-space true-two-layer SO2-two-layer thin-two-layer \
           thick-two-layer dermis-two-layer)
bench_c := $(wildcard tests/search/*.c tests/bench/*.c tests/match/bench.c tests/store/bench.c)
new_driver := $(wildcard tests/new_driver/drivers/*/*.[ch] tests/new_driver/drivers/*/tests/*.[ch])
all_h   := $(wildcard src/*.h src/*/*.h db/*.h drivers/*.h drivers/*/*.h drivers/*/tests/*.h tests/*/*.h tests/*/*/*.h)
public_h := $(shell sed -n 's/^.include "\(.*\)".*/\1/p' src/skinspec.h)
objects  = $(patsubst %.c,$(BUILD)/obj/%.o,$(1))
core_o  := $(call objects,$(core_c))
db_o    := $(call objects,$(db_c))
json_o  := $(call objects,$(json_c))
station_o := $(call objects,$(station_c)) $(BUILD)/obj/protocol_schema.o
wire_o  := $(call objects,$(wire_c)) $(BUILD)/obj/protocol_schema.o
drivers_o := $(call objects,$(drivers_c))
capture_o := $(call objects,$(capture_c))
cli_o   := $(call objects,$(cli_c))
tests   := $(patsubst tests/%.c,$(BUILD)/tests/%,$(tests_c)) \
           $(patsubst drivers/%.c,$(BUILD)/tests/drivers/%,$(own_tests_c))

unity   := build/unity
lib_a   := $(BUILD)/libskinspec.a
lib_so  := $(BUILD)/libskinspec.so.0
program := $(BUILD)/skinspec
daemon  := $(BUILD)/skinspecd
simhost := $(if $(wildcard tests/sim/mock/host.c),$(BUILD)/simhost)
tables  := $(BUILD)/tables/table-two-layer.db $(BUILD)/tables/table-paper.db

.PHONY: FORCE help all demo test test-new-driver test-fuzz test-faults faults-asan test-kill test-soak soak bench bench-peers de2000 error-vs-time accuracy stability asan \
        cover lint format docs install clean need-build need-test need-fuzz need-faults need-stability need-lint
.DELETE_ON_ERROR:
# Kept, though only an implicit rule asks for them.  No others: a secondary object that is not there yet
# does not make its program anew where its source is older than that, as one that was copied may be.
.SECONDARY: $(call objects,$(tests_c) $(own_tests_c) $(fuzz_c) $(stability_c) $(bench_c) $(accuracy_c))

help: ## this list
	@sed -n 's/^\([a-z0-9-]*\):.*## /  make \1\t/p' Makefile | expand -t 20

all: $(program) $(daemon) $(lib_a) $(lib_so) ## the programs and the library

demo: $(program) $(daemon) $(tables) ## a station on a simulated instrument: calibrate, measure, the record
	@BUILD=$(BUILD) tools/demo

test: need-test all $(tests) $(simhost) $(tables) ## all tests
	@BUILD=$(BUILD) tools/run-tests $(tests)

test-new-driver: need-test all $(simhost) $(tables) ## a driver added to a copy of the tree: what it touches, its tests, a station with it
	@BUILD=$(BUILD) python3 -B tests/new_driver/new_driver.py

FUZZ_SECONDS ?= 60
fuzzed := protocol session km_ascii ocean_ooi xrite_rci
test-fuzz: need-fuzz ## random lines and sessions against the station and drivers for FUZZ_SECONDS (60)
	@$(MAKE) --no-print-directory BUILD=$(BUILD)/fuzz CC=clang CFLAGS='-O1 -g -fno-omit-frame-pointer' \
	    EXTRA='-fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=all' \
	    $(patsubst %,$(BUILD)/fuzz/fuzz_%,$(fuzzed))
	@tools/protocol-docs --seeds $(BUILD)/fuzz/seeds-protocol --sessions $(BUILD)/fuzz/seeds-session \
	    --dictionary $(BUILD)/fuzz/protocol.dict
	@tests/fuzz/seeds_captures.py $(BUILD)/fuzz/seeds-km_ascii drivers/km_ascii/captures/*
	@tests/fuzz/seeds_captures.py $(BUILD)/fuzz/seeds-xrite_rci drivers/xrite_rci/captures/*
	@python3 -B tests/fuzz/seeds_ocean_ooi.py $(BUILD)/fuzz/seeds-ocean_ooi
	@tools/run-fuzzers $(BUILD)/fuzz $(FUZZ_SECONDS) $(fuzzed)

# What fails in instruments, drivers, links and their simulators; `make test` runs each once.
PLUGS ?= 300
fault_tests = $(filter $(BUILD)/tests/drivers/% $(BUILD)/tests/link/% $(BUILD)/tests/sim/%,$(tests))
test-faults: need-faults all $(fault_tests) $(simhost) $(tables) ## failing instruments: ASan, valgrind, unplugged PLUGS (300) times (30 minutes)
	@$(MAKE) --no-print-directory BUILD=$(BUILD)/asan CFLAGS='-O1 -g -fno-omit-frame-pointer' \
	    EXTRA='-fsanitize=address,undefined -fno-sanitize-recover=all' faults-asan
	@tools/run-faults valgrind $(BUILD)
	@PLUGS=$(PLUGS) tools/run-faults plugs $(BUILD)

faults-asan: all $(fault_tests) $(simhost) $(tables)
	@tools/run-faults asan $(BUILD)

KILLS ?= 500
test-kill: need-test $(program) $(daemon) $(tables) ## the station killed KILLS (500) times while four clients measure
	@BUILD=$(BUILD) python3 -B tests/soak/kill.py $(KILLS)

SOAK_SECONDS ?= 60
test-soak: need-test ## 32 clients for SOAK_SECONDS (60) under AddressSanitizer, then ThreadSanitizer
	@$(MAKE) --no-print-directory BUILD=$(BUILD)/asan CFLAGS='-O1 -g -fno-omit-frame-pointer' \
	    EXTRA='-fsanitize=address,undefined -fno-sanitize-recover=all' soak
	@$(MAKE) --no-print-directory BUILD=$(BUILD)/tsan CFLAGS='-O1 -g -fno-omit-frame-pointer' \
	    EXTRA='-fsanitize=thread' soak

soak: $(program) $(daemon) $(tables)
	@BUILD=$(BUILD) python3 -B tests/soak/soak.py $(SOAK_SECONDS)

asan: ## all tests under AddressSanitizer and UndefinedBehaviorSanitizer
	@$(MAKE) --no-print-directory BUILD=$(BUILD)/asan CFLAGS='-O1 -g -fno-omit-frame-pointer' \
	    EXTRA='-fsanitize=address,undefined -fno-sanitize-recover=all' test

cover: need-cover ## coverage of optics, colour, match, db and drivers: 95 % of lines, 90 % of branches
	@rm -rf $(BUILD)/cover/obj
	@$(MAKE) --no-print-directory BUILD=$(BUILD)/cover CFLAGS='-O0 -g' EXTRA='--coverage' test
	@cd $(BUILD)/cover && gcovr --root $(CURDIR) --object-directory obj --exclude-throw-branches \
	    --filter '$(CURDIR)/src/(optics|colour|match|json|station)/' --filter '$(CURDIR)/(db|drivers)/' --sort-percentage \
	    --txt - --fail-under-line 95
	@cd $(BUILD)/cover && gcovr --root $(CURDIR) --object-directory obj --exclude-throw-branches \
	    --filter '$(CURDIR)/src/(optics|colour|match|json|station)/' --filter '$(CURDIR)/(db|drivers)/' --branches \
	    --txt - --fail-under-branch 90

bench: need-test all $(BUILD)/bench/load $(BUILD)/bench/drivers $(BUILD)/bench/planner $(simhost) $(tables) ## every figure of docs/performance.md beside its bar; BENCH='search map' for some (15 minutes)
	@BUILD=$(BUILD) python3 -B tests/bench/run.py $(BENCH)

bench-peers: need-test all $(BUILD)/bench/load $(simhost) $(tables) ## the figures that others are compared with, who are put into the build folder and by apt first
	@BUILD=$(BUILD) python3 -B tests/bench/run.py --peers $(BENCH)

$(BUILD)/bench/load: $(BUILD)/obj/tests/bench/load.o $(lib_a)
	@mkdir -p $(@D)
	@$(CC) $(ALL_CFLAGS) $^ -o $@ -lm

de2000: $(BUILD)/bench/de2000 ## the search by CIEDE2000 beside every row: speed, and 20 000 answers each of 10 000 to 1 000 000 rows
	@$(BUILD)/bench/de2000 2000 20000

$(BUILD)/bench/de2000: $(call objects,tests/bench/de2000.c tests/support/de2000_rows.c) $(lib_a)
	@mkdir -p $(@D)
	@$(CC) $(ALL_CFLAGS) $^ -o $@ -lm

$(BUILD)/bench/planner: $(BUILD)/obj/tests/bench/planner.o $(db_o) $(lib_a)
	@mkdir -p $(@D)
	@$(CC) $(ALL_CFLAGS) $^ -o $@ $(PKG_LIBS) -lm

$(BUILD)/bench/map_rate: $(BUILD)/obj/tests/bench/map_rate.o $(lib_a)
	@mkdir -p $(@D)
	@$(CC) $(ALL_CFLAGS) $^ -o $@ -lm

# Ours beside cminpack's lmder.
$(BUILD)/obj/tests/bench/inversion.o: PKG_CFLAGS += $(shell pkg-config --cflags cminpack)
$(BUILD)/bench/inversion: $(BUILD)/obj/tests/bench/inversion.o $(lib_a)
	@mkdir -p $(@D)
	@$(CC) $(ALL_CFLAGS) $^ -o $@ $(shell pkg-config --libs cminpack) -lm

$(BUILD)/bench/transport: $(call objects,tests/bench/transport.c tests/support/doubling.c) $(lib_a)
	@mkdir -p $(@D)
	@$(CC) $(ALL_CFLAGS) $^ -o $@ -lm

# Ours beside nanoflann, which is C++.
$(BUILD)/obj/tests/bench/peers/nanoflann.o: tests/bench/peers/nanoflann.cpp tests/bench/peers/nanoflann.h
	@mkdir -p $(@D)
	@$(CXX) -std=c++11 -O3 -march=native -I. -c $< -o $@
$(BUILD)/bench/search: $(call objects,tests/bench/search.c tests/support/skin_queries.c) $(BUILD)/obj/tests/bench/peers/nanoflann.o $(lib_a)
	@mkdir -p $(@D)
	@$(CXX) $(filter-out -std=%,$(CFLAGS)) -pthread $^ -o $@ -lm

# Where boxes begin to pay; not part of a build, which would then depend on the machine.
calibrate-search: $(BUILD)/bench/few ## measure up to how many rows looking at all is quicker: src/match/kd_few.h
	@$< src/match/kd_few.h

$(BUILD)/bench/few: $(call objects,tests/bench/few.c tests/support/skin_queries.c) $(lib_a)
	@mkdir -p $(@D)
	@$(CC) $(ALL_CFLAGS) $^ -o $@ -lm

$(BUILD)/bench/growth: $(call objects,tests/bench/growth.c tests/support/skin_queries.c) $(lib_a)
	@mkdir -p $(@D)
	@$(CC) $(ALL_CFLAGS) $^ -o $@ -lm

$(BUILD)/bench/match: $(call objects,tests/match/bench.c tests/support/figures.c) $(db_o) $(lib_a)
	@mkdir -p $(@D)
	@$(CC) $(ALL_CFLAGS) $^ -o $@ $(PKG_LIBS) -lm

$(BUILD)/bench/tables: $(BUILD)/obj/tests/bench/tables.o $(db_o) $(lib_a)
	@mkdir -p $(@D)
	@$(CC) $(ALL_CFLAGS) $^ -o $@ $(PKG_LIBS) -lm

# Drivers and the simulators in one program.
$(BUILD)/bench/drivers: $(BUILD)/obj/tests/bench/drivers.o \
        $(call objects,$(sims_c) tests/sim/wire_memory.c tests/support/ocean_bench.c) $(drivers_o) $(lib_a)
	@mkdir -p $(@D)
	@$(CC) $(ALL_CFLAGS) $^ -o $@ $(PKG_LIBS) $(WIRES_LIBS) -lm

# Costs compiled in are of the same run as the page.
error-vs-time: $(program) ## docs/error-vs-time.md, its picture, and the costs that plans are made by: this machine's (4 minutes)
	@$(program) bench --force --markdown docs/error-vs-time.md --svg docs/error-vs-time.svg --c-source src/plan/costs_default.c

search: $(BUILD)/search/search ## nearest rows of tables up to a million against brute force, 20 000 queries each (2 minutes)
	@$<

$(BUILD)/search/search: $(call objects,tests/search/main.c tests/support/brute.c tests/support/textbook.c tests/support/skin_queries.c) $(lib_a)
	@mkdir -p $(@D)
	@$(CC) $(ALL_CFLAGS) $^ -o $@ -lm

stability: need-stability $(BUILD)/stability/stability ## every function of optics, colour and match over extreme inputs, against MPFR
	@$(BUILD)/stability/stability
	@MAKE='$(MAKE) --no-print-directory' BUILD=$(BUILD) tools/compare-levels -O0 -O2 -O3 '-O3 -march=native'

$(BUILD)/stability/stability: $(call objects,$(stability_c) tests/support/figures.c) $(lib_a)
	@mkdir -p $(@D)
	@$(CC) $(ALL_CFLAGS) $^ -o $@ $(WIDE_LIBS) -lm

accuracy: need-test $(BUILD)/accuracy/inversion $(BUILD)/accuracy/real_skin $(accuracy_data) ## accuracy of the inversion, each figure beside its bar (3 minutes)
	@$(BUILD)/accuracy/inversion $(BUILD)/accuracy
	@$(BUILD)/accuracy/real_skin

# Spectra with known truth, from equations that share no code with src/.
accuracy_white := 40000 --seed 5 --skins tests/reference/inversion.csv
accuracy_coverage := 10000 --seed 7
accuracy_placement := 10000 --seed 8 --placement 0.008
accuracy_true := 1000 --seed 9
accuracy_SO2 := 1000 --seed 9 --set SO2=0.6
accuracy_thin := 1000 --seed 9 --set epidermis_mm=0.06
accuracy_thick := 1000 --seed 9 --set epidermis_mm=0.1
accuracy_dermis := 1000 --seed 9 --set dermis=0.6
define accuracy_rule
$(BUILD)/accuracy/$(1)-%.csv: tests/reference/inversion.py | need-test
	@mkdir -p $$(@D)
	@python3 -B $$< --spectra $$* $(accuracy_$(1)) > $$@
endef
$(foreach kind,white coverage placement true SO2 thin thick dermis,$(eval $(call accuracy_rule,$(kind))))

$(BUILD)/accuracy/%: $(BUILD)/obj/tests/accuracy/%.o \
        $(call objects,tests/support/figures.c tests/support/measured_skin.c) $(lib_a)
	@mkdir -p $(@D)
	@$(CC) $(ALL_CFLAGS) $^ -o $@ -lm

lint: need-lint ## layout, static analysis, and warnings of gcc and clang as errors
	@tools/lint

format: need-lint ## lay out the sources by clang-format
	@clang-format -i $(core_c) $(json_c) $(station_c) $(db_c) $(drivers_c) $(cli_c) $(tests_c) $(own_tests_c) \
	    $(support_c) $(mock_c) $(fuzz_c) $(stability_c) $(bench_c) $(accuracy_c) $(new_driver) $(all_h) docs/examples/*.c

docs: ## docs/protocol.md from the protocol's description
	@tools/protocol-docs > docs/protocol.md.new && mv docs/protocol.md.new docs/protocol.md

install: all ## program, library, headers and examples below DESTDIR/PREFIX
	install -d $(DESTDIR)$(PREFIX)/bin $(DESTDIR)$(PREFIX)/lib/pkgconfig \
	    $(DESTDIR)$(PREFIX)/share/skinspec/examples $(DESTDIR)$(PREFIX)/include/skinspec
	install $(program) $(daemon) $(DESTDIR)$(PREFIX)/bin
	install -m 644 $(lib_a) $(DESTDIR)$(PREFIX)/lib
	install $(lib_so) $(DESTDIR)$(PREFIX)/lib
	ln -sf libskinspec.so.0 $(DESTDIR)$(PREFIX)/lib/libskinspec.so
	sed -e 's|@PREFIX@|$(PREFIX)|' -e 's|@VERSION@|$(VERSION)|' src/skinspec.pc.in \
	    > $(DESTDIR)$(PREFIX)/lib/pkgconfig/skinspec.pc
	install -m 644 docs/examples/* $(DESTDIR)$(PREFIX)/share/skinspec/examples
	for header in skinspec.h $(public_h); do \
	    install -D -m 644 src/$$header $(DESTDIR)$(PREFIX)/include/skinspec/$$header || exit 1; \
	done

clean: ## remove what was built
	rm -rf $(BUILD)

# ---- what has to be there ------------------------------------------------------------

need-build:
	@tools/need cmd:cc=gcc cmd:pkg-config=pkg-config file:/usr/include/argp.h=libc6-dev \
	    lib:sqlite3=libsqlite3-dev lib:nettle=nettle-dev lib:libcjson=libcjson-dev \
	    lib:libsystemd=libsystemd-dev lib:libserialport=libserialport-dev \
	    lib:libusb-1.0=libusb-1.0-0-dev lib:libudev=libudev-dev lib:libpng=libpng-dev

need-test: need-build $(unity)/unity.c
	@tools/need cmd:python3=python3 cmd:spec2cie=argyll lib:mpfr=libmpfr-dev lib:umockdev-1.0=libumockdev-dev \
	    cmd:umockdev-wrapper=umockdev

need-fuzz: need-build
	@tools/need cmd:clang=clang cmd:python3=python3

need-stability: need-build
	@tools/need lib:mpfr=libmpfr-dev

need-faults: need-test
	@tools/need cmd:valgrind=valgrind

need-cover: need-test
	@tools/need cmd:gcovr=gcovr

need-lint: need-test
	@tools/need cmd:clang=clang cmd:clang-format=clang-format cmd:clang-tidy=clang-tidy \
	    cmd:cppcheck=cppcheck lib:cminpack=libcminpack-dev

$(unity)/unity.c: | need-build
	@tools/need cmd:xz=xz-utils
	@tools/fetch-unity $(unity)

# ---- how things are made ------------------------------------------------------------

# Other flags, other objects: this file changes when they do.
$(BUILD)/flags: FORCE | need-build
	@mkdir -p $(@D)
	@echo '$(ALL_CFLAGS)' | cmp -s - $@ || echo '$(ALL_CFLAGS)' > $@

$(BUILD)/obj/%.o: %.c $(BUILD)/flags | need-build
	@mkdir -p $(@D)
	@echo "  CC $<"
	@$(CC) $(ALL_CFLAGS) $(PKG_CFLAGS) -MMD -MP -c $< -o $@

# Loops become vectors only where a square root sets no errno and no trap is taken; and a few
# zeros after a row are not worth a call of memset(), which clang never makes of them.
vector_c := src/optics/quick.c src/optics/shared_layers.c src/optics/transport_lanes.c \
            src/colour/colour_many.c src/colour/delta_e_many.c src/colour/delta_e_box.c \
            src/match/start.c src/match/coarse.c src/match/box_lanes.c src/match/refine_lanes.c src/match/refine_many.c src/match/skeleton.c \
            src/match/lattice.c src/cube/map_picture.c src/cli/map_fit.c
vector_flags = -fno-math-errno -fno-trapping-math \
               $(if $(findstring clang,$(shell $(CC) --version)),,-fno-tree-loop-distribute-patterns)
$(call objects,$(vector_c)): private override EXTRA += $(vector_flags)
# One fit by itself, and what guesses for many, are short loops and calls: the same bits, 3 % and 30 % quicker.
fit_c := src/match/refine.c src/match/least_squares.c src/match/misfit.c src/match/guess.c
$(call objects,$(fit_c)): private override EXTRA += $(if $(findstring -O2,$(CFLAGS)),-O3)

# The protocol's description becomes part of the program.  It is ASCII: every byte is a char.
$(BUILD)/gen/protocol_schema.c: src/station/protocol.schema.json
	@mkdir -p $(@D)
	@{ echo '#include "station/protocol_schema.h"'; echo 'const char protocol_schema_text[] = {'; \
	    od -An -v -tx1 $< | sed 's/ *\([0-9a-f][0-9a-f]\)/0x\1,/g'; echo '0};'; } > $@

$(BUILD)/obj/protocol_schema.o: $(BUILD)/gen/protocol_schema.c $(BUILD)/flags | need-build
	@mkdir -p $(@D)
	@$(CC) $(ALL_CFLAGS) -c $< -o $@

# Somebody else's sources: our warnings do not apply.
$(BUILD)/obj/unity.o: $(unity)/unity.c $(BUILD)/flags | need-build
	@mkdir -p $(@D)
	@$(CC) $(ALL_CFLAGS) -w -DUNITY_INCLUDE_DOUBLE -c $< -o $@

# Private: or the flags of a tests' object would count as those of everything.
$(BUILD)/obj/tests/%.o: private override EXTRA += -isystem $(unity) -DUNITY_INCLUDE_DOUBLE
$(call objects,$(own_tests_c) $(own_support_c)): private override EXTRA += -isystem $(unity) -DUNITY_INCLUDE_DOUBLE
$(call objects,$(tests_c) $(own_tests_c) $(support_c)): | $(unity)/unity.c
# With several jobs at a time: not before the packages that tests need are there.
$(call objects,$(mock_c) $(tests_c)): | need-test
$(call objects,$(stability_c)): | need-stability

$(lib_a): $(core_o)
	@rm -f $@
	@ar rcs $@ $^

$(lib_so): $(core_o) src/libskinspec.map
	@$(CC) $(ALL_CFLAGS) -shared -Wl,-soname,libskinspec.so.0 \
	    -Wl,--version-script=src/libskinspec.map $(core_o) -o $@ -lm
	@ln -sf $(@F) $(BUILD)/libskinspec.so

$(program): $(cli_o) $(wire_o) $(capture_o) $(json_o) $(db_o) $(lib_a)
	@echo "  LD $@"
	@$(CC) $(ALL_CFLAGS) $^ -o $@ $(PKG_LIBS) $(PICTURE_LIBS) -lm

$(daemon): $(station_o) $(json_o) $(db_o) $(drivers_o) $(lib_a)
	@echo "  LD $@"
	@$(CC) $(ALL_CFLAGS) $^ -o $@ $(PKG_LIBS) $(WIRES_LIBS) -lm

$(call objects,$(mock_c)) $(BUILD)/obj/tests/sim/test_mock_%.o: \
    PKG_CFLAGS = $(shell pkg-config --cflags $(MOCKS) $(WIRES))
$(BUILD)/simhost: $(call objects,$(mock_c) $(sims_c)) $(lib_a)
	@echo "  LD $@"
	@$(CC) $(ALL_CFLAGS) $^ -o $@ $(shell pkg-config --libs $(MOCKS) $(WIRES)) -lm

# What of a test's may be made to run out; see tests/station/scarce_tools.h.
run_short := json/test_memory $(addprefix station/test_,scarce_answers scarce_start rights)
scarce := malloc calloc realloc strdup pthread_create \
          $(addprefix sd_event_add_,io time time_relative defer)
$(addprefix $(BUILD)/tests/,$(run_short)): LINK := $(scarce:%=-Wl,--wrap=%)

# A test may use everything but the main programs.  One that is named test_NAME_umockdev.c makes
# itself mocked devices: the library that redirects its system calls comes first, before libasan.
not_main = $(filter-out %/main.o,$(1))
$(BUILD)/obj/tests/%_umockdev.o $(BUILD)/obj/drivers/%_umockdev.o: PKG_CFLAGS += $(shell pkg-config --cflags $(MOCKS))
$(BUILD)/tests/%_umockdev: PRELOAD = -Wl,--no-as-needed -lumockdev-preload -Wl,--as-needed
$(BUILD)/tests/%_umockdev: MOCKS_LIBS = $(shell pkg-config --libs $(MOCKS))
$(filter %_umockdev,$(tests)): $(call objects,$(filter-out %/host.c,$(mock_c)))
$(BUILD)/tests/stability/test_stability: $(call objects,$(filter-out %/main.c,$(stability_c)))
# The library once more: the studies stand behind it.
$(BUILD)/tests/stability/test_stability: MOCKS_LIBS = $(lib_a) $(WIDE_LIBS)
used_by_tests = $(call objects,$(support_c)) $(BUILD)/obj/unity.o \
        $(call not_main,$(cli_o) $(station_o)) $(json_o) $(db_o) $(drivers_o) $(lib_a)
link_test = mkdir -p $(@D) && $(CC) $(ALL_CFLAGS) $(PRELOAD) $(LINK) $^ -o $@ \
        $(PKG_LIBS) $(PICTURE_LIBS) $(WIRES_LIBS) $(MOCKS_LIBS) -lm
$(BUILD)/tests/%: $(BUILD)/obj/tests/%.o $(used_by_tests)
	@$(link_test)
$(BUILD)/tests/drivers/%: $(BUILD)/obj/drivers/%.o $(used_by_tests)
	@$(link_test)

# Programs that are mock and client in one: the preload library before all others, so that
# they need no wrapper, and AddressSanitizer finds its own in place.
$(BUILD)/tests/sim/test_mock_%: $(BUILD)/obj/tests/sim/test_mock_%.o $(BUILD)/obj/unity.o \
        $(call objects,$(filter-out %/host.c,$(mock_c)) $(sims_c)) $(lib_a)
	@mkdir -p $(@D)
	@$(CC) $(ALL_CFLAGS) -Wl,--no-as-needed -lumockdev-preload -Wl,--as-needed $^ -o $@ \
	    $(shell pkg-config --libs $(MOCKS) $(WIRES)) -lm

# Their waits take no time.
on_serial_line := $(BUILD)/fuzz_km_ascii $(BUILD)/fuzz_xrite_rci
$(on_serial_line): FUZZ_LINK := -Wl,--wrap=call_wait,--wrap=call_now_ms
$(on_serial_line): $(BUILD)/obj/tests/fuzz/driver_session.o

$(BUILD)/fuzz_%: $(BUILD)/obj/tests/fuzz/fuzz_%.o $(BUILD)/obj/tests/support/table_files.o \
        $(call not_main,$(station_o)) $(json_o) $(db_o) $(drivers_o) $(lib_a)
	@$(CC) $(ALL_CFLAGS) -fsanitize=fuzzer $(FUZZ_LINK) $^ -o $@ $(PKG_LIBS) $(WIRES_LIBS) -lm

# What rows are made by: a change there makes the tables anew.
$(BUILD)/tables/table-%.db: $(lib_a) $(db_o) | $(program)
	@mkdir -p $(@D)
	@$(program) table build --model $* --out $@ --force

-include $(patsubst %.o,%.d,$(core_o) $(json_o) $(station_o) $(db_o) $(drivers_o) $(cli_o) \
    $(call objects,$(tests_c) $(own_tests_c) $(support_c) $(mock_c) $(fuzz_c) $(stability_c) $(bench_c) $(accuracy_c)))
