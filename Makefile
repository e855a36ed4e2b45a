# Two commands: `make run` and `make test`. Both install what is missing first.
PY := .venv/bin/python
CASE ?= wind-5mw
OUT ?= results/$(CASE)
WORKERS ?= 2

.PHONY: run test check lint format-check rules types layers validate validate-quick install install-dev clean

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

validate: install-dev
	$(PY) -m pytest validation

# The same statements about Tan et al. 2023 on coarse FE meshes: what CI has time for.
validate-quick: install-dev
	$(PY) -m pytest validation/tan2023 --fidelity quick

install:
	@bash .ci/setup

install-dev:
	@bash .ci/setup dev

clean:
	rm -rf .venv .pytest_cache .mypy_cache .ruff_cache .import_linter_cache
