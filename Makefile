# Every target prepares what it needs in .venv and says what it does; nothing but Python 3.11 to 3.13 is asked for.
#
#   make demo        objects, scenes, an evaluation, a table and pictures in demo/   (no torch)
#   make test        the tests
#   make check       linter, types, import layers
#   make docs        the documentation, strictly, into site/
#   make test-slow   the long tests
#   make test-real   the tests on the Debian furniture catalogue
#   make test-lerobot  recorded data sets opened with LeRobot itself, in an environment of its own (8 GB)
#   make bench       the speed measurements (RECORD=--record keeps them for the documentation)
#   make web         the review page, into the package (needs Node.js and npm; only after changing web/review)
#   make format      format and mend what the linter can mend
#   make clean       delete .venv, demo/, site/ and the tools' caches

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
MAKEFLAGS += --no-builtin-rules --no-print-directory

VENV := .venv
LEROBOT_VENV ?= $(VENV)/lerobot
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check
TEST_WORKERS ?= 2
PYTEST := $(BIN)/python -m pytest -q
CLUTTER6D := $(BIN)/clutter6d
DEMO ?= demo
WORKERS ?= $(shell getconf _NPROCESSORS_ONLN)
BENCHMARKS := step_speed scaling physics_profile peers option_costs observation_kernels encoder_throughput
GENERATION_BENCHMARKS := placement_rate scene_rate
export PYTHON

.PHONY: help demo test test-slow test-real test-lerobot check docs bench web format clean

help:
	@sed -n 's/^#   //p' Makefile

demo: $(VENV)/.installed-core
	@echo "make: 1/5 processing objects of the built-in procedural source"
	@$(CLUTTER6D) assets process procedural --limit 48 --workers $(WORKERS) --out $(DEMO)/library
	@echo "make: 2/5 generating certified scenes of the moderate track"
	@$(CLUTTER6D) generate --track moderate --scenes 4 --seed 0 --workers $(WORKERS) --library $(DEMO)/library --out $(DEMO)/scenes
	@echo "make: 3/5 evaluating the planner on them"
	@$(CLUTTER6D) evaluate --policy planner --scenes $(DEMO)/scenes --pairs 1 --out $(DEMO)/evaluation
	@echo "make: 4/5 replaying what was recorded"
	@$(CLUTTER6D) replay $(DEMO)/evaluation
	@echo "make: 5/5 drawing the scenes"
	@$(CLUTTER6D) render $(DEMO)/scenes --out $(DEMO)/pictures
	@echo "make: done; the table is $(DEMO)/evaluation/report.md, the pictures are in $(DEMO)/pictures"
	@echo "make: for a video of each episode: $(CLUTTER6D) render $(DEMO)/evaluation"

test: $(VENV)/.installed-dev
	@echo "make: running the tests on $(TEST_WORKERS) processes"
	@$(PYTEST) -n $(TEST_WORKERS) --dist loadfile

test-slow: $(VENV)/.installed-dev
	@echo "make: running the long tests"
	@$(PYTEST) -m "slow and not (real or network or gpu or lerobot)"

test-real: $(VENV)/.installed-dev
	@echo "make: running the tests on the Debian furniture catalogue"
	@$(PYTEST) -m real

check: $(VENV)/.installed-dev
	@echo "make: formatting" && $(BIN)/ruff format --check --quiet .
	@echo "make: linting" && $(BIN)/ruff check --quiet .
	@echo "make: import layers" && $(BIN)/lint-imports --no-logo
	@echo "make: types" && $(BIN)/pyright

format: $(VENV)/.installed-dev
	@$(BIN)/ruff check --quiet --fix . ; $(BIN)/ruff format .

test-lerobot: $(VENV)/.installed-dev $(LEROBOT_VENV)/.installed
	@echo "make: opening recorded data sets with LeRobot"
	@CLUTTER6D_LEROBOT_PYTHON=$(LEROBOT_VENV)/bin/python $(PYTEST) -m lerobot -s

docs: $(VENV)/.installed-docs
	@echo "make: building the documentation into site/" && NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet

bench: $(VENV)/.installed-dev
	@echo "make: measuring for about twenty minutes; leave the machine alone meanwhile"
	@status=0; for script in $(BENCHMARKS); do echo "make: $$script"; \
	  $(BIN)/python benchmarks/$$script.py $(RECORD) || status=1; done; \
	for script in $(GENERATION_BENCHMARKS); do echo "make: $$script"; \
	  $(BIN)/python benchmarks/$$script.py || status=1; done; exit $$status

web:
	@command -v npm >/dev/null || { echo "make: install Node.js with npm first"; exit 1; }
	@echo "make: building the review page into clutter6d/assets/review/static"
	@npm ci --prefix web/review --ignore-scripts --silent && npm run build --prefix web/review --silent

clean:
	@rm -rf $(VENV) demo site .pytest_cache .ruff_cache .hypothesis .import_linter_cache

# LeRobot asks for another torch than ours.
$(LEROBOT_VENV)/.installed:
	@sh .ci/create-venv $(LEROBOT_VENV)
	@echo "make: installing LeRobot into $(LEROBOT_VENV), several gigabytes"
	@$(LEROBOT_VENV)/bin/python -m pip --disable-pip-version-check install --quiet lerobot==0.4.4 torch==2.9.1 torchvision==0.24.1
	@touch $@

# The environment is made once and brought up to date when the requirements change.
$(VENV)/.created:
	@sh .ci/create-venv $(VENV)
	@touch $@

$(VENV)/.installed-core: $(VENV)/.created pyproject.toml constraints.txt
	@echo "make: installing Clutter6D and the libraries it needs into $(VENV)"
	@$(PIP) install --quiet --quiet --constraint constraints.txt --editable .
	@touch $@

$(VENV)/.installed-dev: $(VENV)/.created pyproject.toml constraints.txt
	@echo "make: installing Clutter6D, its baselines (with torch) and its test tools into $(VENV)"
	@$(PIP) install --quiet --quiet --constraint constraints.txt --editable ".[baselines,dev]"
	@touch $@ $(VENV)/.installed-core

$(VENV)/.installed-docs: $(VENV)/.created pyproject.toml constraints.txt
	@echo "make: installing the documentation tools into $(VENV)"
	@$(PIP) install --quiet --quiet --constraint constraints.txt --editable ".[docs]"
	@touch $@ $(VENV)/.installed-core
