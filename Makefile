# `make demo` and `make test` do everything on a fresh machine, set-up included; nothing is installed outside .venv.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

.PHONY: demo test lint slow gpu validate bench bench-pass bench-campaign heap-table spheroid-heap coarse-heap agreement sensitivity planted-truth clean

demo: $(READY)
	$(BIN)/taichidem demo --output demo

test: $(READY) lint
	$(BIN)/python -m pytest -n auto --dist loadscope

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

slow: $(READY)
	$(BIN)/python -m pytest -m slow

gpu: $(READY)
	$(BIN)/python -m pytest -m gpu

validate: $(READY)
	$(BIN)/python -m pytest -m validate || test $$? -eq 5

bench: $(READY)
	$(BIN)/python -m benchmarks

bench-pass: $(READY)
	$(BIN)/python -m benchmarks.bench_pass

bench-campaign: $(READY)
	$(BIN)/python -m benchmarks.campaign

heap-table: $(READY)
	$(BIN)/python -m benchmarks.heap_table

spheroid-heap: $(READY)
	$(BIN)/python -m benchmarks.spheroid_heap

coarse-heap: $(READY)
	$(BIN)/python -m benchmarks.coarse_heap

agreement: $(READY)
	$(BIN)/python -m benchmarks.agreement

sensitivity: $(READY)
	$(BIN)/python -m benchmarks.sensitivity

planted-truth: $(READY)
	$(BIN)/python -m benchmarks.planted_truth

$(READY): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(0 if (3, 10) <= sys.version_info < (3, 14) else 1)' || { \
	  echo "$(PYTHON) is $$($(PYTHON) --version 2>&1); taichidem needs CPython 3.10 to 3.13 (Taichi has no wheels for others)."; \
	  echo "Name another one, as in: make test PYTHON=python3.12"; exit 1; }
	@$(PYTHON) -m venv $(VENV) || { \
	  echo "No virtual environment could be made. On Debian or Ubuntu: apt-get install python3-venv"; exit 1; }
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[test]'
	@touch $(READY)

clean:
	rm -rf $(VENV) demo results build *.egg-info
