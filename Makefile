# Two commands: `make run` and `make test`. Both install what is missing first.
PY := .venv/bin/python
CASE ?= wind-5mw
OUT ?= results/$(CASE)
WORKERS ?= 2
BENCH ?=
GALLERY ?= 1

.PHONY: run test check lint format-check rules types layers validate validate-quick docs bench install install-dev install-docs clean

run: install
	.venv/bin/flexgear run $(CASE) --out $(OUT)

test: install-dev
	$(PY) -m pytest -n $(WORKERS)

# What CI runs: format, lint, types, import layers, tests.
check: lint test

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
	$(PY) -m pytest validation

# The same on coarse FE meshes, without the studies of FE meshes: what CI has time for.
validate-quick: install-dev
	$(PY) -m pytest validation --fidelity quick --ignore validation/fe_convergence \
		--ignore validation/tooth_influence

# The manual as plain files: docs/_build/index.html. GALLERY=0 leaves the examples unrun.
docs: install-docs
	$(PY) -m sphinx -q -W --keep-going -b html -D plot_gallery=$(GALLERY) docs docs/_build

# Ratios of speed against other ways and programs: writes docs/benchmarks.md with its pictures.
# BENCH=--quick tries it out; peers that cannot be installed are named as skipped.
bench: install
	@bash .ci/setup bench || echo "bench: goes on without the optional peers"
	PYTHONPATH=tests $(PY) -m benchmarks $(BENCH)

install:
	@bash .ci/setup

install-dev:
	@bash .ci/setup dev

install-docs:
	@bash .ci/setup dev,docs

clean:
	rm -rf .venv .pytest_cache .mypy_cache .ruff_cache .import_linter_cache
