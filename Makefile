# Two commands: `make run` and `make test`. Both install what is missing first.
# WORKERS: processes of tests and of validation, each on one core.
PY := .venv/bin/python
CASE ?= wind-5mw
OUT ?= results/$(CASE)
WORKERS ?= 2
BENCH ?=
GALLERY ?= 1

.PHONY: run test test-all check lint format-check rules types layers validate docs bench install install-dev install-docs clean

run: install
	.venv/bin/flexgear run $(CASE) --out $(OUT)
	@echo 'next: . .venv/bin/activate makes flexgear a command in this terminal'

# Each worker has its half of the files, and takes over from the other when it is done: what the
# tests of a file share is made once, mostly.
test: install-dev
	$(PY) -m pytest -n $(WORKERS) --dist worksteal -m "not slow"

# The long ones, too: every command's pictures of every case, interrupted commands, clusters.
test-all: install-dev
	$(PY) -m pytest -n $(WORKERS) --dist worksteal

# What CI runs on every change: format, lint, types, import layers, all tests.
check: lint test-all

lint: format-check rules types layers

format-check: install-dev
	$(PY) -m ruff format --check --quiet .

rules: install-dev
	$(PY) -m ruff check .

types: install-dev
	$(PY) -m mypy

layers: install-dev
	.venv/bin/lint-imports

# Every published figure beside the computed one: results/validation/index.html.
validate: install-dev
	OMP_NUM_THREADS=1 $(PY) -m pytest validation -n $(WORKERS) --dist worksteal

# The manual as plain files: docs/_build/index.html. GALLERY=0 leaves the examples unrun.
docs: install-docs
	$(PY) -m sphinx -q -W --keep-going -b html -D plot_gallery=$(GALLERY) docs docs/_build

# Ratios of speed against other ways and programs: writes docs/benchmarks.md with its pictures.
# BENCH=--quick tries it out; peers that cannot be installed are named as skipped.
bench: install
	@bash .ci/setup bench || echo "bench: goes on without the optional peers"
	PYTHONPATH=tests:validation $(PY) -m benchmarks $(BENCH)

install:
	@bash .ci/setup

install-dev:
	@bash .ci/setup dev

install-docs:
	@bash .ci/setup dev,docs

clean:
	rm -rf .venv .pytest_cache .mypy_cache .ruff_cache .import_linter_cache
