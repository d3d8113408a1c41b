# Needs Python >= 3.11 and make; everything else is set up in .venv.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
FLY_ARGS ?=

.PHONY: fly test system lint bench reference-flights clean
.DEFAULT_GOAL := fly

fly: $(VENV)/.fly  ## land a simulated drone and write a report
	$(BIN)/alight fly $(FLY_ARGS)

test: $(VENV)/.test  ## the unit tests
	$(BIN)/python -m pytest -n 2 -m "not system and not px4"

system: $(VENV)/.test  ## the tests that start real processes
	$(BIN)/python -m pytest -m "system" tests/system

lint: $(VENV)/.test $(VENV)/.lint  ## style, types, import rules
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: $(VENV)/.test  ## measured figures, as tables
	$(BIN)/python -m station.bench

reference-flights: $(VENV)/.test  ## fly the reference flights of the replay tests anew (after a change of messages or behaviour)
	$(BIN)/python -m station.replay.reference
	$(BIN)/alight replay tests/replay/flights/px4.mcap --update --yes

clean:
	rm -rf $(VENV) build *.egg-info

$(VENV)/.venv:
	@echo "Setting up Python packages in $(VENV) (once; about a minute) ..."
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	@touch $@

$(VENV)/.fly: $(VENV)/.venv pyproject.toml
	$(BIN)/python -m pip install --quiet -e '.[report]'
	@touch $@

$(VENV)/.test: $(VENV)/.fly pyproject.toml
	$(BIN)/python -m pip install --quiet -e '.[test]'
	@touch $@

$(VENV)/.lint: $(VENV)/.venv pyproject.toml
	$(BIN)/python -m pip install --quiet -e '.[lint]'
	@touch $@
