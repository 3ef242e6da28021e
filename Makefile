# Each target sets up what it needs in .venv. Python 3.11 or later must be installed.
PYTHON ?= python3
BIN := .venv/bin

# Tests start Python some hundred times. Later processes load the modules that an earlier one compiled.
reproduce test test-all: export PYTHONDONTWRITEBYTECODE =

.PHONY: reproduce test test-all fuzz test-elsewhere coverage check bench docs notebooks install-check clean

reproduce: .venv/ready  ## recompute the paper
	$(BIN)/chaincor reproduce -o reproduction

test: .venv/ready-test  ## the quick tests: every capability, through LAMMPS
	$(BIN)/python -m tests.warm_kernels
	$(BIN)/python -m pytest -n auto --dist worksteal -m "not slow"

test-all: .venv/ready-test  ## the whole test suite, which CI runs
	$(BIN)/python -m tests.warm_kernels all
	$(BIN)/python -m pytest -n auto --dist worksteal

MINUTES ?= 60
fuzz: .venv/ready-test  ## spoilt files and random command lines: make fuzz MINUTES=60
	$(BIN)/python -m tests.fuzz $(MINUTES)

test-elsewhere: .venv/ready-test  ## the whole suite under conditions of other machines; takes long
	$(BIN)/python -m tests.elsewhere

coverage: .venv/ready-coverage  ## lines that no test runs; these include loops that Numba compiles
	$(BIN)/python -m pytest -n auto --dist worksteal --cov=chaincor --cov=analysis --cov=lammps_inputs --cov=workflows --cov-report=term-missing:skip-covered

check: .venv/ready-check  ## formatting, lint, types, order of imports, prose
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python -m tests.prose

bench: .venv/ready-bench  ## ratios of times to those of peers, measured in one run
	$(BIN)/python -m benchmarks

docs: .venv/ready-docs  ## the documentation site, in site/; fails on a warning or a broken link
	$(BIN)/python -m sphinx -W --keep-going -q -b html -d build/doctrees docs site
	$(BIN)/python -m sphinx -W --keep-going -q -b revealjs -d build/doctrees-slides docs/course/slides site/slides
	$(BIN)/python docs/check_links.py site
	$(BIN)/python docs/check_access.py site

notebooks: .venv/ready-notebook  ## the lessons as notebooks, in lessons/; .venv/bin/jupyter lab lessons opens them
	$(BIN)/chaincor lessons --force -o lessons

install-check:  ## a plain `pip install .` in a fresh environment, then without LAMMPS
	PYTHON=$(PYTHON) tests/install_check.sh

# Each of 11,600 modules is compiled when it is first imported, which makes installation a minute faster.
PIP = $(BIN)/python -m pip install --quiet --no-compile

.venv/pip:
	$(PYTHON) -m venv .venv
	$(PIP) --upgrade pip
	touch $@

# The first run compiles the modules and loops that later runs load, also where Python may not write bytecode.
.venv/ready: .venv/pip pyproject.toml
	$(PIP) --editable .
	-PYTHONDONTWRITEBYTECODE= $(BIN)/chaincor run > /dev/null
	touch $@

.venv/ready-notebook: .venv/pip pyproject.toml
	$(PIP) --editable ".[notebook]"
	touch $@

.venv/ready-%: .venv/pip pyproject.toml
	$(PIP) --editable . --group $*
	touch $@

clean:
	rm -rf .venv build dist reproduction site lessons
