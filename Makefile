# Everything that people and the build run, by the same names. `make` alone prints them.

PYTHON ?= python3
# The versions to install; `make test CONSTRAINTS=` takes the newest instead.
CONSTRAINTS ?= --constraint constraints.txt
BIN := .venv/bin
PIP := $(BIN)/python -m pip install --quiet $(CONSTRAINTS)
# What `make install` installs beside the package, and what tests need besides.
EXTRAS := server,mesh,exr,study,postgres
ALL_EXTRAS := $(EXTRAS),dask,flip,s3,traces
# Narrower: make test TESTS=tests/renderer
TESTS ?= tests
# Those of a module stay together, as they share a service or a cluster.
PYTEST := $(BIN)/pytest --numprocesses auto --maxprocesses 4 --dist loadscope --no-loadscope-reorder
# Benchmarks to run: make bench BENCH="load soak"
BENCH ?= rendering targets load soak fuzz grading peers
# Scenes of `make study`, and the most seconds for each.
STUDIED := study/chess study/soft gallery/basic gallery/normal_texturing gallery/lens gallery/glass
STUDY_SECONDS ?= 250
# The newest LLVM of Debian: Mitsuba needs 17 or newer, and would take the first that it finds.
LLVM := $(lastword $(sort $(wildcard /usr/lib/*/libLLVM.so.*)))
WEB := tools/web

.DEFAULT_GOAL := help
.PHONY: help install demo serve test test-all check docs gallery bench study dist clean

help:  ## print this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "make %-9s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

install: .venv/installed  ## prepare .venv with everything needed to run

demo: .venv/installed  ## start a service, render a scene over HTTP, leave the picture in out/demo.png
	$(BIN)/penumbra demo

serve: .venv/installed  ## run the service on http://127.0.0.1:8000
	$(BIN)/penumbra serve

# Tests start hundreds of processes: each would compile every module again where bytecode is not kept.
test test-all: export PYTHONDONTWRITEBYTECODE :=
test: .venv/installed-test  ## run the fast tests; six minutes on two cores
	$(PYTEST) -m 'not slow' $(TESTS)

test-all: .venv/installed-test  ## run the slow tests: injected faults, sweeps, whole installations; half an hour
	$(PYTEST) -m slow $(TESTS)

# The theme gets fixes until May 2027; without this it names its successor at each build.
check docs: export NO_MKDOCS_2_WARNING := 1
check: .venv/installed-test .venv/installed-check node_modules/installed  ## lint, format, types, imports, examples in docstrings, the page's modules, documentation
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/hadolint Dockerfile scenes/assignment/gradescope/Dockerfile
	node_modules/.bin/prettier --config $(WEB)/prettier.json --check service/web tests/web tools/web
	node_modules/.bin/eslint --config $(WEB)/eslint.config.js service/web tests/web
	node_modules/.bin/tsc --project $(WEB)
	node $(WEB)/build_editor.js --check
	node --test tests/web/*.test.js
	$(PYTEST) --doctest-modules schemas renderer accuracy service scenes
	$(BIN)/mkdocs build

docs: .venv/installed-docs  ## serve the documentation as a site on http://127.0.0.1:8001, built again when a page changes
	$(BIN)/mkdocs serve --livereload --dev-addr 127.0.0.1:8001

gallery: .venv/installed  ## render the pictures of the gallery, the cookbook and the pages
	$(BIN)/python tools/render_pictures.py

bench: export DRJIT_LIBLLVM_PATH ?= $(LLVM)
bench: .venv/installed-test .venv/installed-bench  ## measure on this machine, which should be idle: make bench BENCH="rendering load"
	set -e; for part in $(BENCH); do $(BIN)/python -m benchmarks.$$part; done

study: .venv/installed  ## measure what accuracy costs in time, into out/study; 25 minutes, on an idle machine
	set -e; for scene in $(STUDIED); do \
	  $(BIN)/penumbra study scenes/$$scene.json --out out/study/$${scene#*/} --budget $(STUDY_SECONDS); done

# Where Node is, the page is built of few files. They go at once, as the service prefers them to their sources.
dist: .venv/installed-test  ## build the source archive and the wheel of a release into dist
	trap 'rm -rf service/built_web' EXIT; \
	if command -v npm; then $(MAKE) node_modules/installed && node $(WEB)/build_page.js || exit; fi; \
	$(BIN)/python -m build --no-isolation --outdir dist

clean:  ## remove .venv and everything made
	rm -rf .venv node_modules out build dist .mypy_cache .pytest_cache .ruff_cache .import_linter_cache

# A stamp is as old as what it installed: pip runs again only when the dependencies change.
.venv/created:
	$(PYTHON) -m venv .venv
	$(PIP) --upgrade pip  # groups of dependencies need 25.1
	touch $@

.venv/installed: pyproject.toml constraints.txt | .venv/created
	$(PIP) --editable '.[$(EXTRAS)]'
	touch $@

.venv/installed-test: .venv/installed
	$(PIP) --editable '.[$(ALL_EXTRAS)]' --group test
	touch $@

.venv/installed-%: .venv/installed
	$(PIP) --group $*
	touch $@

node_modules/installed: package-lock.json
	npm ci --no-audit --no-fund
	touch $@
