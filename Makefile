# Everything a fresh machine needs: each target makes the virtual environment first.
PYTHON ?= python3
BIN := .venv/bin
STAMP := .venv/.installed
IMAGES ?=
TESTS ?= tests notebooks

.PHONY: help venv lint format test test-all demo docs board clean

help:
	@echo "make demo      install, then train a little, evaluate, write runs/demo/report.html (IMAGES=/folder for your own)"
	@echo "make test      install, then the tests that take under 20 minutes on two cores"
	@echo "make test-all  the slow ones too"
	@echo "make lint      ruff, mypy, import-linter      make format  ruff's formatter"
	@echo "make docs      the API reference, as site/index.html"
	@echo "make board     TensorBoard on runs/           make venv    only the environment"

venv: $(STAMP)

$(STAMP): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "diffnav needs Python 3.11 or newer, $(PYTHON) is " + sys.version.split()[0] + "; run make PYTHON=/path/to/python3.11")'
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet -c constraints.txt torch
	$(BIN)/python -m pip install --quiet -c constraints.txt -e '.[dev]'
	@touch $(STAMP)

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

format: $(STAMP)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

test: $(STAMP)
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 --nbmake -m "not slow" $(TESTS)

test-all: $(STAMP)
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 --nbmake --hypothesis-profile=default $(TESTS)

demo: $(STAMP)
	$(BIN)/python -m eval.demo $(if $(IMAGES),'data.root="$(IMAGES)"')

docs: $(STAMP)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict
	@echo "site/index.html: open it in a browser"

board: $(STAMP)
	$(BIN)/tensorboard --logdir runs

clean:
	rm -rf .venv build dist site *.egg-info .pytest_cache .ruff_cache .mypy_cache
