# make demo | test | test-all | coverage | serve | bench | docs | pictures | lock | clean
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PYTEST := $(BIN)/pytest --numprocesses auto --dist loadfile --no-loadscope-reorder
PYPROJECTS := core/pyproject.toml clients/python/pyproject.toml service/pyproject.toml benchmarks/pyproject.toml
KERNELS := $(wildcard core/fingersplit/*_kernel.py core/fingersplit/*/*_kernel.py core/fingersplit/*/*/*_kernel.py)
COMPILE_LOCK := uv pip compile --universal --python-version 3.11 --generate-hashes --no-header --no-annotate \
	--no-emit-package fingersplit --no-emit-package fingersplit-client $(PYPROJECTS) --extra all --extra cluster --quiet

export PYTHONUNBUFFERED := 1
export PIP_DISABLE_PIP_VERSION_CHECK := 1
# Bytecode is kept even where the surroundings say otherwise: tests start many processes.
export PYTHONDONTWRITEBYTECODE :=

.DEFAULT_GOAL := help
.PHONY: help demo test test-all coverage serve bench docs pictures lock clean

help:
	@echo "make demo      set up, start the service, plan grasps for a mug, print them and write a picture"
	@echo "make test      set up, then lint, types and tests (about 11 minutes on 2 cores)"
	@echo "make test-all  the long campaigns: every object, hostile files, faults"
	@echo "make serve     the service on http://127.0.0.1:8000 (interactive documentation at /docs)"
	@echo "make bench     speed, quality and the paper's tables; report in build/bench"
	@echo "make coverage  the tests, and every line that none of them runs"
	@echo "make docs      the documentation site; in build/docs"
	@echo "make pictures  render the animation of the README again"
	@echo "make lock      resolve the pinned requirements again (needs uv)"
	@echo "make clean     remove .venv, build/ and compiled kernels"

demo: $(VENV)/.kernels
	@$(BIN)/python examples/demo.py

serve: $(VENV)/.kernels $(VENV)/.viewer
	@$(BIN)/fingersplit serve

bench: $(VENV)/.dev $(VENV)/.kernels
	@$(BIN)/fingersplit bench --report build/bench

test: $(VENV)/.dev $(VENV)/.kernels $(VENV)/.viewer
	@$(BIN)/python tests/support/chromium.py
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy --num-workers auto
	$(PYTEST) -m "not campaign"

test-all: $(VENV)/.dev $(VENV)/.kernels
	$(PYTEST) -m campaign

docs: $(VENV)/.dev
	@$(BIN)/sphinx-build -q -W --keep-going -b html docs build/docs
	@echo "==> Open build/docs/index.html"

pictures: $(VENV)/.kernels
	@$(BIN)/python scripts/pictures.py

coverage: $(VENV)/.dev $(VENV)/.kernels $(VENV)/.viewer
	$(PYTEST) -m "not campaign" --cov --cov-report=term-missing:skip-covered

lock:
	$(COMPILE_LOCK) --group dev -o requirements/dev.lock
	$(COMPILE_LOCK) --group build -c requirements/dev.lock -o requirements/run.lock

clean:
	rm -rf $(VENV) build
	find core service clients benchmarks tests -name __pycache__ -prune -exec rm -rf {} +

$(VENV)/bin/pip:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "Fingersplit needs Python 3.11 or newer; choose one with 'make PYTHON=/path/to/python3.x ...'."; exit 1; }
	@echo "==> Creating the virtual environment $(VENV)"
	@$(PYTHON) -m venv $(VENV)

$(VENV)/.run: requirements/run.lock $(PYPROJECTS) | $(VENV)/bin/pip
	@echo "==> Installing the pinned requirements (downloads about 250 MB the first time; a minute or two)"
	@$(BIN)/pip install --quiet --require-hashes -r requirements/run.lock
	@echo "==> Installing fingersplit, its service, client and benchmarks from this checkout"
	@$(BIN)/pip install --quiet --no-deps --no-build-isolation -e core -e clients/python -e service -e benchmarks
	@touch $@

$(VENV)/.dev: requirements/dev.lock $(VENV)/.run
	@echo "==> Installing the pinned test tools"
	@$(BIN)/pip install --quiet --require-hashes -r requirements/dev.lock
	@touch $@

$(VENV)/.viewer: $(VENV)/.run
	@$(BIN)/fingersplit setup-viewer
	@touch $@

$(VENV)/.kernels: $(VENV)/.run $(KERNELS)
	@echo "==> Compiling the planner's kernels (one to four minutes, once)"
	@$(BIN)/fingersplit warm
	@touch $@
