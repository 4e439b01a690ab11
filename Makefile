# make run [PORT=8000]   set everything up and serve the editor
# make test              set everything up and pass the tests
# make extremes          every row of the tables of numerical stability, with a million samples
# make gallery DATA=...  render the README's pictures, from the folder with the models
# make bench | lint | setup [PYTHON=python3.12]

PORT ?= 8000
export PYTHON

.PHONY: run test extremes bench gallery lint setup

run: setup
	@exec .venv/bin/sunbox serve --port $(PORT)

test:
	@.ci/setup test
	.venv/bin/sunbox info
	.venv/bin/ruff check .
	.venv/bin/mypy
	.venv/bin/pytest

extremes: setup
	SUNBOX_EXTREMES=1 .venv/bin/pytest tests/extremes

bench: setup
	.venv/bin/sunbox bench speed -o out/bench.json

gallery: setup
	.venv/bin/python -m service.bench.gallery "$(or $(DATA),$(error name the folder with the models: make gallery DATA=...))"

lint: setup
	.venv/bin/ruff check .
	.venv/bin/mypy

setup:
	@.ci/setup
