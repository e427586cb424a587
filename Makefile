# The two commands to know are `make demo` and `make test`; `make help` lists the rest.

PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
OUT := out
UV ?= uv
# The lock names every package there is to install. Left to resolve dependencies as well, pip meets
# "coverage[toml]", takes the newest coverage for it, and then refuses it for having no hash.
PIP_LOCKED := --quiet --disable-pip-version-check --require-hashes --no-deps

.DEFAULT_GOAL := help
.PHONY: help setup demo test lowest python-3.13 test-slow kernels mutants reference reproduce derive check-derive lint format bench docs wheel lock clean

help: ## list the commands
	@awk -F ':.*## ' '/^[a-z0-9.-]+:.*## / {printf "  make %-14s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

setup: $(STAMP) ## create .venv with the locked requirements and this package in it

$(STAMP): requirements/dev.txt pyproject.toml setup.py
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install $(PIP_LOCKED) -r requirements/dev.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	$(BIN)/python -m pip check
	@touch $@

demo: setup ## flutter speed and amplitude curve of run 14, with figures and data in out/
	@mkdir -p $(OUT)
	$(BIN)/aeroflutter validate run14
	$(BIN)/aeroflutter rootlocus run14 --out $(OUT)/run14-rootlocus.nc --plot $(OUT)/run14-rootlocus.png
	$(BIN)/aeroflutter rootlocus run14 --json > $(OUT)/run14-rootlocus.json
	$(BIN)/aeroflutter df run14 --out $(OUT)/run14-df.nc --plot $(OUT)/run14-df.png
	$(BIN)/aeroflutter df run14 --json > $(OUT)/run14-df.json
	@echo && echo "The results are in $(CURDIR)/$(OUT):" && ls $(OUT)

test: setup ## run the tests, with the coverage of aeroflutter, generated and derive
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n auto --cov --cov-report=term:skip-covered

# numba's machine code is not traced, so that report leaves the kernels out: here they are plain Python.
# pyproject.toml's settings omit them, hence no file of settings.
KERNELS = --rcfile=/dev/null --data-file=.coverage.kernels
kernels: setup ## run some tests with the kernels uncompiled, with the coverage of the kernels
	NUMBA_DISABLE_JIT=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m coverage run $(KERNELS) \
		--include='aeroflutter/*/_kernel*.py,aeroflutter/*/*/_kernel*.py' -m pytest -q -n 0 \
		tests/test_exact.py tests/test_maps.py -k \
		"first_limit_cycle or overflow or rest or event or table or samples or round_off"
	$(BIN)/python -m coverage report $(KERNELS) --show-missing

reproduce: setup ## the thesis's figures and tables by their own numbers, in out/reproduce
	$(BIN)/aeroflutter reproduce --folder $(OUT)/reproduce

lowest: ## run the tests with the lowest versions that pyproject.toml allows
	$(call tests-elsewhere,lowest,$(PYTHON),lowest)

python-3.13: ## run the tests with Python 3.13
	$(call tests-elsewhere,3.13,python3.13,dev)

# An environment of its own, then the tests: name, interpreter, lock.
define tests-elsewhere
	test -x .venv-$(1)/bin/python || $(2) -m venv .venv-$(1)
	.venv-$(1)/bin/python -m pip install $(PIP_LOCKED) -r requirements/$(3).txt
	.venv-$(1)/bin/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	OPENBLAS_NUM_THREADS=1 .venv-$(1)/bin/python -m pytest -n auto $(TESTS)
endef

test-slow: setup ## run the heavier proofs as well
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n auto -m "slow or not slow"

mutants: setup ## apply known mistakes one by one and see that the tests notice
	$(BIN)/python -m tests.mutants

reference: setup ## check the exact engine against heyoka (installs the extra "reference")
	$(BIN)/python -m pip install $(PIP_LOCKED) -r requirements/reference.txt
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -m slow tests/test_exact.py -k heyoka

derive: setup ## derive the equations again and write generated/
	$(BIN)/python -m derive

check-derive: setup ## fail if generated/ is not what the derivation gives
	$(BIN)/python -m derive --check

lint: setup ## check style, types and the direction of imports
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports --no-cache

format: setup ## format the code
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

bench: setup ## measure speed
	$(BIN)/python -m benchmarks

docs: setup ## build the documentation into docs/_build/html
	$(BIN)/sphinx-build -W --keep-going -b html docs docs/_build/html

wheel: setup ## build the wheel into dist/
	rm -rf build
	$(BIN)/python -m pip wheel --quiet --no-deps --no-build-isolation --wheel-dir dist .

COMPILE = $(UV) pip compile --quiet --python-version 3.11 --universal --generate-hashes \
	--no-config --no-emit-index-url \
	--custom-compile-command "make lock"
lock: ## pin the requirements again (needs uv)
	$(COMPILE) pyproject.toml --extra derive --extra test --extra lint --extra build --extra docs \
		--extra report --extra cluster --extra certify --output-file requirements/dev.txt
	$(COMPILE) pyproject.toml --constraint requirements/dev.txt --output-file requirements/runtime.txt
	$(COMPILE) pyproject.toml --constraint requirements/dev.txt --extra reference \
		--output-file requirements/reference.txt
	$(COMPILE) pyproject.toml --resolution lowest-direct --extra derive --extra test --extra build \
		--extra report --extra cluster --extra certify --output-file requirements/lowest.txt

clean: ## remove what can be made again, .venv excepted
	rm -rf $(OUT) build dist docs/_build docs/figures docs/gallery .coverage .mypy_cache .pytest_cache .ruff_cache
