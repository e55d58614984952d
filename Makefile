# make check  sets everything up, then lint, types and unit tests, in two to three minutes
# make test   sets everything up, then lint, types and all tests
# make run    sets everything up, then the quickstart recipe
# make measure   makes the figures of the README anew, those of published artifacts from their trials
# make chaos   disturbs runs 240 times and counts what is lost (docs/reliability.md)
# make chaos-nodes   kills nodes of a Ray cluster ten times over a run and a sweep (docs/cluster.md)
# make scale   measures labels, trials and rollouts on one node of Ray and on two (docs/cluster.md)
# make docs   builds the documentation's site into build/site, to be opened without a network
# make leaks   watches memory and descriptors of a training for an hour
PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

.PHONY: setup check test lint types run measure docs chaos chaos-nodes scale leaks image clean

setup: $(READY)

# torch is asked for first and alone: an open range can bring several GB of accelerator packages.
$(READY): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check --constraint constraints.txt torch==2.13.0
	$(BIN)/pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[dev]'
	touch $(READY)

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: setup
	$(BIN)/mypy

check: lint types
	$(BIN)/pytest -n 2 -m "unit and not slow"

test: lint types
	$(BIN)/pytest -n 2 -v

run: setup
	$(BIN)/iowbc run recipes/quickstart.yaml

measure: run
	$(BIN)/iowbc show quickstart
	$(BIN)/iowbc run recipes/full.yaml
	$(BIN)/iowbc show full
	$(BIN)/iowbc run recipes/teacher.yaml
	$(BIN)/iowbc run recipes/probe.yaml
	$(BIN)/iowbc compare paper
	$(BIN)/iowbc bench sim
	$(BIN)/iowbc bench train
	$(BIN)/iowbc bench control full

docs: setup
	$(BIN)/pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[docs]'
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet
	@echo build/site/index.html

chaos: setup
	$(BIN)/python tests/chaos/chaos.py --events 200
	$(BIN)/python tests/chaos/chaos.py --recipe tests/chaos/workers.yaml --events 40

chaos-nodes: setup
	$(BIN)/python tests/chaos/nodes.py --kills 10 --actors 3 --gap 8
	$(BIN)/python tests/chaos/nodes.py --vary seed=0..1 --until teacher --kills 10

scale: setup
	$(BIN)/python tests/scaling.py

leaks: setup
	$(BIN)/python tests/chaos/leaks.py

image:
	docker build --tag iowbc .

clean:
	rm -rf $(VENV) build dist *.egg-info
