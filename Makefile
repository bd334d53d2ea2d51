# Everything that people and the build run, by the same names. `make` alone prints them.

PYTHON ?= python3
# The versions to install; `make test CONSTRAINTS=` takes the newest instead.
CONSTRAINTS ?= --constraint constraints.txt
BIN := .venv/bin
# What checks the page: Node and npm are for this alone, and nothing of it is shipped.
WEB := tools/web
# How tests are spread over processes: those of a module stay together, as they share a service.
PARALLEL := --numprocesses auto --maxprocesses 4 --dist loadscope --no-loadscope-reorder
# Folders whose tests start no service and render little.
QUICK := tests/schemas tests/renderer tests/service/client tests/service/converting schemas renderer
# The newest LLVM of Debian: Mitsuba needs 17 or newer, and would take the first that it finds.
LLVM := $(lastword $(sort $(wildcard /usr/lib/*/libLLVM.so.*)))
# Scenes of docs/explanation/accuracy-costs-time.md, and the most seconds for each.
STUDIED := study/chess study/soft gallery/basic gallery/normal_texturing gallery/lens gallery/glass
STUDY_SECONDS ?= 250
# How long `make soak` takes.
MINUTES ?= 30

.DEFAULT_GOAL := help
.PHONY: help install demo serve test-quick test test-slow test-peers test-image check docs dist audit fuzz gallery bench bench-counts chaos soak load bench-grading bench-peers bench-references study clean

help:  ## print this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "make %-17s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

install: .venv/installed  ## prepare .venv with everything needed to run

demo: .venv/installed  ## start a service, render a scene over HTTP, leave the picture in out/demo.png
	$(BIN)/penumbra demo

serve: .venv/installed  ## run the service on http://127.0.0.1:8000
	$(BIN)/penumbra serve

# Tests start hundreds of processes: each would compile every module again where bytecode is not kept.
test test-quick test-slow test-peers: export PYTHONDONTWRITEBYTECODE :=
test-quick: .venv/installed-test  ## run the tests that need no service and little time, for use while you work; a minute
	$(BIN)/pytest $(PARALLEL) -m 'not slow and not peer' $(QUICK)

test: .venv/installed-test  ## run the tests, but for the slow ones; seventeen minutes
	$(BIN)/pytest $(PARALLEL) -m 'not slow and not peer' --durations 25

test-slow: .venv/installed-test  ## run the slow tests: injected faults, sweeps, whole installations; twenty minutes
	$(BIN)/pytest $(PARALLEL) -m 'slow and not peer' --durations 25

test-peers bench-peers bench-references: export DRJIT_LIBLLVM_PATH ?= $(LLVM)
test-peers: .venv/installed-test .venv/installed-bench  ## compare with Mitsuba, which needs LLVM, and POV-Ray; two minutes
	$(BIN)/pytest -m peer \
	  tests/pictures/test_against_mitsuba.py tests/pictures/test_against_povray.py

test-image:  ## build the image with podman, and run its service on a read-only root; five minutes
	tools/try_image.sh

dist: .venv/installed-test  ## build the source archive and the wheel of a release into dist
	$(BIN)/python -m build --no-isolation --outdir dist

check: .venv/installed-check $(WEB)/node_modules/installed  ## lint, format, types, the page's own modules, which package may import which, images, known advisories, documentation
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/hadolint Dockerfile scenes/assignment/gradescope/Dockerfile
	$(WEB)/node_modules/.bin/prettier --config $(WEB)/prettier.json --check service/web tests/web tools/web
	$(WEB)/node_modules/.bin/eslint --config $(WEB)/eslint.config.js service/web tests/web
	$(WEB)/node_modules/.bin/tsc --project $(WEB)
	node $(WEB)/build_editor.js --check
	node --test tests/web/*.test.js
	$(BIN)/python -m benchmarks.audit
	$(BIN)/mkdocs build

# The theme gets fixes until May 2027; without this it names its successor at each build.
check docs: export NO_MKDOCS_2_WARNING := 1
docs: .venv/installed-docs  ## serve the documentation as a site on http://127.0.0.1:8001, built again when a page changes
	$(BIN)/mkdocs serve --livereload --dev-addr 127.0.0.1:8001

audit: .venv/installed-check  ## check the dependencies for known advisories; fails if the database cannot be reached
	$(BIN)/python -m benchmarks.audit --strict

fuzz: .venv/installed-test  ## send 100,000 malformed request bodies, into out/fuzz.json; some minutes
	$(BIN)/python -m benchmarks.fuzz

gallery: .venv/installed  ## render the gallery and the hard scenes into out, and the pictures of the cookbook
	$(BIN)/python -m tools.docs.render_gallery
	$(BIN)/python -m tools.docs.render_cookbook

bench: .venv/installed  ## measure times and errors on this machine, into out/bench.json; fails if more is computed than before
	$(BIN)/python -m benchmarks
	$(BIN)/python -m benchmarks.counts

bench-counts: .venv/installed  ## count the rays, calls and elements of small pictures; fails if there are more than before
	$(BIN)/python -m benchmarks.counts

chaos: .venv/installed-test  ## kill, stop and starve the service and check its guarantees, into out/chaos.json; up to an hour
	$(BIN)/python -m benchmarks.chaos

soak: .venv/installed-test  ## have random faults among mixed jobs for MINUTES, 30 by default, into out/soak.json
	$(BIN)/python -m benchmarks.chaos --soak --minutes $(MINUTES) --out out/soak.json

load: .venv/installed  ## measure the service's guarantees under load, into out/load.json; 5 minutes
	$(BIN)/python -m benchmarks.load

bench-grading: .venv/installed-test  ## measure the grader: honest and wrong programs, noise, copies, a class of 200; on an idle machine
	$(BIN)/python -m tools.docs.generate_assignment_page --measure
	$(BIN)/python -m tools.docs.measure_programs
	$(BIN)/python -m tools.docs.measure_noise
	$(BIN)/python -m tools.docs.measure_likeness
	$(BIN)/python -m tools.docs.measure_class

bench-peers: .venv/installed-bench  ## compare CPU seconds at equal error with other renderers, into out/peers.json; half an hour
	$(BIN)/python -m benchmarks.peers

bench-references: .venv/installed-bench  ## render the reference pictures again with another renderer
	$(BIN)/python -m benchmarks.peer_pictures

study: .venv/installed  ## measure what accuracy costs in time, into out/study; 25 minutes, on an idle machine
	set -e; for scene in $(STUDIED); do \
	  $(BIN)/penumbra study scenes/$$scene.json --out out/study/$${scene#*/} --budget $(STUDY_SECONDS); done

clean:  ## remove .venv and everything made
	rm -rf .venv $(WEB)/node_modules out build dist .mypy_cache .pytest_cache .ruff_cache .import_linter_cache

# A stamp is as old as what it installed: pip runs again only when the dependencies change.
.venv/created:
	$(PYTHON) -m venv .venv
	touch $@

.venv/installed: pyproject.toml constraints.txt | .venv/created
	$(BIN)/python -m pip install --quiet $(CONSTRAINTS) --editable '.[mesh,exr,study,postgres]'
	touch $@

.venv/installed-%: .venv/installed
	$(BIN)/python -m pip install --quiet $(CONSTRAINTS) --editable '.[$*]'
	touch $@

$(WEB)/node_modules/installed: $(WEB)/package-lock.json
	npm ci --prefix $(WEB) --no-audit --no-fund
	touch $@
