# make test    the Vulkan driver, formatting, lints and tests; the test runner's summary comes last
# make test-all  with a virtual display and a browser for the window and for pages, with the slow tests, which `make test` leaves
#              out by name, and the lints and tests of the Python module and the page
# make web     the page for browsers, the engine as WebAssembly and an editor, to target/web
# make test-web  the same in Chromium without a display, on a software adapter: pictures go to out/web
# make python  the Python module, built and installed into target/python/venv
# make wheel   the Python wheel, to target/wheels, tried in an environment of its own
# make blender the add-on for Blender, with the Python module inside, to out/lightgraph_blender.zip
# make test-blender  the add-on in Blender, against Cycles; installs Blender as a Python module (400 MB) into target/blender
# make demo    renders the hall by global illumination to out/hall.png and out/hall.exr
# make bench   run time against error: all graphs on twelve scenes, to out/bench/report.html
# make stress  every graph under what scenes and parameters can do, at most a quarter of an hour, to out/stress/report.html
# make scenes  writes the generated files of scenes/ anew
# make peers   installs other renderers, for comparisons, into target/peers
# make mutants  2,000 mutants of each kind of file, within memory and time; `make test` takes 200
# make fuzz    coverage-guided fuzzing of all targets, MINUTES=10 in all; needs cargo-fuzz and a nightly toolchain
# make soak    `watch` and the window under random edits, MINUTES=60 each: memory and descriptors stay flat
# make vscode  packages the extension for Visual Studio Code, editors/vscode/lightgraph.vsix; needs npm
# make neovim  drives a headless Neovim through a fault, its remedy and a rename; installs Neovim through apt
# make editor  two minutes of random edits against the language server
# make book    the pages of docs/ as a book, to out/book; installs mdBook into target/book
# make deny    licences, duplicates, sources and advisories of dependencies; needs cargo-deny
# make references  renders the images of tests/references anew with Mitsuba: some minutes on a GPU by LIGHTGRAPH_MITSUBA=cuda_ad_rgb,
#              hours on two cores

# Drivers look for a display there, and complain where it is not set.
export XDG_RUNTIME_DIR ?= /tmp

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := test
.PHONY: test test-all pytest web test-web python wheel blender test-blender demo bench stress scenes peers references mutants fuzz soak vscode neovim editor book deny driver display browser lint lint-all

# What takes two thirds of the time of the tests: references by other renderers, furnaces, lobes, proofs of skipping, random
# edits and mutants, every field edited live, every graph under every setting, a thousand frames in flight. And what looks at
# pages in a browser.
SLOW := references:: skips:: mutated:: reloads:: bench_run:: traced:: toggles:: stress:: turned:: seams:: trusted:: unbiased:: \
    furnace:: lobes:: probe::every_shipped shipped::every_shader shipped::no_shader record::recorded report_page:: bench_page::

# Most of the time of the library's own tests: every graph in many orders and memories.
SLOW_UNITS := plan::tests::memory::the_shipped_graphs

# The library, the command and the language server: the window, the Python module and the page stand on crates of their own.
CORE := --package lightgraph --package lightgraph-cli --package lightgraph-lsp --no-default-features --features lightgraph-cli/lsp

test: SKIPPED := $(SLOW:%=--skip %)
test: UNITS_SKIPPED := $(SLOW_UNITS:%=--skip %)
test: PACKAGES := $(CORE)
test-all: pytest lint-all
# A first build has nothing to go on from, and takes a tenth less without what the next would go on from.
test: export CARGO_INCREMENTAL ?= $(if $(wildcard target/debug/incremental),1,0)
test: driver
test-all: display browser
test test-all: lint
	cargo test $(or $(PACKAGES),--workspace) --lib --bins -- $(UNITS_SKIPPED)
	cargo test $(PACKAGES) --doc
	cargo test $(PACKAGES) --examples --test it -- $(SKIPPED)

pytest: display
	scripts/install-python.sh
	cargo build
	scripts/python-module.sh
	target/python/venv/bin/python -m pytest --quiet crates/python/tests

VENV := VIRTUAL_ENV="$(CURDIR)/target/python/venv"

python: driver
	scripts/install-python.sh
	$(VENV) target/python/venv/bin/maturin develop --quiet --release --manifest-path crates/python/Cargo.toml
	target/python/venv/bin/python -c 'import lightgraph; print("lightgraph", lightgraph.__version__, "is in target/python/venv")'

wheel: driver
	scripts/install-python.sh
	scripts/wheel.sh

blender:
	scripts/install-python.sh
	scripts/blender-addon.sh

test-blender: driver
	scripts/install-blender.sh
	cargo build
	scripts/python-module.sh target/blender/venv
	target/blender/venv/bin/python -m pytest --quiet editors/blender/tests
	scripts/blender-window.sh

web:
	@scripts/web.sh

test-web: driver
	@scripts/test-web.sh

# Without the window and the language server, and unoptimised: a renderer's time is the device's.
demo: driver
	cargo build --package lightgraph-cli --no-default-features --profile demo
	mkdir -p out
	target/demo/lightgraph render graphs/gi/final_gather.ron --scene scenes/hall --size 640x480 --frames 2 --out out/hall.png --output color=out/hall.exr

# Every graph on twelve scenes, along its own axes; then finer grids of those that gain by them; then the paper's scenes, its graph
# and the fast one, in all phases.
bench: driver
	cargo build --release
	target/release/lightgraph bench --scenes $(BENCHED) --sweep "grid=2,4;face=8;bounces=4" $(BRIEFLY)
	target/release/lightgraph bench --resume --scenes $(BENCHED) --graphs graphs/gi/final_gather.ron --sweep "rays=1,2,4,16" $(BRIEFLY)
	target/release/lightgraph bench --resume --scenes $(BENCHED) --graphs graphs/gi/first_bounce.ron --sweep "directions=2,4,16" $(BRIEFLY)
	target/release/lightgraph bench --resume --scenes $(BENCHED) --graphs graphs/gi/pathtrace.ron --sweep "samples=1,4,16,64" $(BRIEFLY)
	target/release/lightgraph bench --resume --graphs $(FINE) --scenes cornell_point,room_spot,hall,corridor,two_rooms:lit --sweep "grid=8;face=16;bounces=6" --phases everything --images 6 --out out/bench
	target/release/lightgraph bench --resume --graphs $(ROWS) --scenes hall,art_gallery --sweep "grid=4;face=16;bounces=2" --images 6 --out out/bench

BENCHED := cornell_point,room_spot,room_area,empty_room,hall,corridor,two_rooms:lit,furnace_80,apartment,atrium,street,workshop
BRIEFLY := --phases everything --seconds 0 --patience 2 --rounds 4 --brief 0.15 --images 6 --out out/bench
FINE := graphs/gi/fast_grid.ron,graphs/gi/facing_probes.ron,graphs/gi/inset_grid.ron,graphs/gi/nonuniform_grid.ron,graphs/gi/fast_grid_visible.ron
ROWS := graphs/gi/uniform_grid.ron,graphs/gi/fast_grid.ron,graphs/gi/infinite_bounce.ron

stress: driver
	cargo build --release
	target/release/lightgraph stress --seconds 840 --out out/stress

scenes:
	cargo run --quiet --example make_scenes

peers:
	peers/install.sh

references: peers
	peers/run.sh make_references.py

mutants:
	LIGHTGRAPH_MUTANTS=2000 cargo test --test it -- mutants:: --nocapture

fuzz:
	scripts/fuzz.sh $(or $(MINUTES),10)

soak: display
	cargo build --release
	scripts/soak.sh $(or $(MINUTES),60)

vscode:
	cd editors/vscode && npm install --no-package-lock --no-audit --no-fund --ignore-scripts && npm run package

neovim:
	cargo build
	scripts/neovim.sh

editor:
	LIGHTGRAPH_EDITS=120 cargo test --test it -- editor:: --nocapture

# A test holds docs/SUMMARY.md to the pages that there are.
book:
	@[ -x target/book/bin/mdbook ] || cargo install mdbook --version '^0.5' --locked --no-default-features --root target/book
	target/book/bin/mdbook build

# Advisories need RustSec's repository of them: where there is no way to it, the rest is checked and that is said.
deny:
	@if ! cargo deny --version >/dev/null 2>&1; then \
	    echo "make: \`cargo deny\` is not installed; \`cargo install --locked cargo-deny\` installs it" >&2; \
	    exit 1; \
	fi
	cargo deny check licenses bans sources
	@if git ls-remote --exit-code https://github.com/RustSec/advisory-db HEAD >/dev/null 2>&1; then \
	    cargo deny check advisories; \
	else \
	    echo "make: advisories are NOT checked: https://github.com/RustSec/advisory-db can't be reached" >&2; \
	fi

# Installs Mesa's software driver where there is no Vulkan driver at all.
driver:
	@scripts/install-driver.sh

# The same, and Xvfb for the tests that open a window.
display:
	@scripts/install-driver.sh display

# Installs Chromium where there is no browser: a test looks at the page of results in one.
browser:
	@scripts/install-browser.sh

lint:
	@for tool in fmt clippy; do \
	    if ! cargo "$$tool" --version >/dev/null 2>&1; then \
	        echo "make: \`cargo $$tool\` is not installed; \`rustup component add rustfmt clippy\` installs it" >&2; \
	        exit 1; \
	    fi; \
	done
	cargo fmt --all --check
	cargo clippy $(or $(PACKAGES),--workspace) --all-targets -- -D warnings

# The stages before the device, and the language server on them, build without wgpu; the page's engine builds for a
# browser, and `make test-web` tests it there. Where cargo-deny is installed, dependencies are held to deny.toml too.
lint-all:
	cargo clippy --package lightgraph --package lightgraph-lsp --no-default-features --all-targets -- -D warnings
	@if [ -d "$$(rustc --print sysroot)/lib/rustlib/wasm32-unknown-unknown" ]; then \
	    cargo clippy --package lightgraph-web --lib --target wasm32-unknown-unknown -- -D warnings; \
	else \
	    echo "make: the page's engine is NOT checked: \`rustup target add wasm32-unknown-unknown\` adds its target" >&2; \
	fi
	@if cargo tree --package lightgraph-lsp --edges normal | grep -E ' wgpu(-core|-hal)? v'; then \
	    echo "make: the stages before the device must not depend on one" >&2; \
	    exit 1; \
	fi
	@if cargo deny --version >/dev/null 2>&1; then \
	    cargo deny check licenses bans sources; \
	else \
	    echo "make: dependencies are NOT held to deny.toml: cargo-deny is not installed" >&2; \
	fi
