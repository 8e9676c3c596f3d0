# make test    the Vulkan driver, a virtual display and a browser, formatting, lints and tests; the test runner's summary comes last
# make demo    renders the hall by global illumination to out/hall.png and out/hall.exr
# make bench   run time against error: all graphs on all scenes with references, to out/bench/report.html
# make scenes  writes the generated files of scenes/ anew
# make peers   installs other renderers, for comparisons, into target/peers
# make references  renders the images of tests/references anew with Mitsuba: half an hour and more on two cores

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := test
.PHONY: test demo bench scenes peers references driver display browser lint

test: display browser lint
	cargo test

demo: driver
	cargo build --release
	mkdir -p out
	target/release/lightgraph render graphs/uniform_grid.ron --scene scenes/hall --size 640x480 --out out/hall.png --output color=out/hall.exr

bench: driver
	cargo build --release
	target/release/lightgraph bench --out out/bench

scenes:
	cargo run --quiet --example make_scenes

peers:
	peers/install.sh

references: peers
	peers/run.sh make_references.py

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
	cargo fmt --check
	cargo clippy --all-targets -- -D warnings
